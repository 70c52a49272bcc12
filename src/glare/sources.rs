//! What dazzles: luminaires, and surfaces that emit.
//!
//! What is seen of a source is sampled at points of it; solid angles of triangles and distances of
//! openings are exact, so that what is not hidden at all has no error.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;

use super::{Glare, Observer, position_index};
use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::Weld;
use crate::light::PathTracer;
use crate::sampling::low_discrepancy::{fold_to_triangle, sobol_02_point};
use crate::scene::{Luminaire, Rgb, Scene, luminance};

/// A source of glare, as an observer sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct GlareSource {
    /// Name of the group it is in, or number of the luminaire.
    pub name: String,
    /// cd/m², the mean over what is seen.
    pub luminance: f64,
    /// Of what is seen, sr.
    pub solid_angle: f64,
    /// Towards the middle of what is seen.
    pub direction: DVec3,
    /// p.
    pub position_index: f64,
}

impl GlareSource {
    /// L² ω / p², cd² sr/m⁴.
    pub fn term(&self) -> f64 {
        let ratio = self.luminance / self.position_index;
        ratio * ratio * self.solid_angle
    }
}

/// Points of a source, shared out among its triangles: a visible share is known to 1 % or so.
const POINTS: usize = 4096;

/// What is seen of a source so far.
#[derive(Default)]
struct Seen {
    solid_angle: f64,
    /// Of all of it, seen or not.
    all: f64,
    flux: f64,
    direction: DVec3,
}

impl Seen {
    fn add(&mut self, towards: DVec3, solid_angle: f64, radiance: Rgb) {
        if radiance.max_element() > 0.0 {
            self.solid_angle += solid_angle;
            self.flux += solid_angle * luminance(radiance);
            self.direction += solid_angle * towards;
        }
    }

    /// Adds it to `glare`, if it is seen at all.
    fn enter(self, name: String, observer: &Observer, glare: &mut Glare) {
        let direction = self.direction.normalize_or_zero();
        if let Some(position_index) =
            position_index(observer, direction).filter(|_| self.solid_angle > 0.0)
        {
            let Seen { solid_angle, flux, .. } = self;
            let luminance = flux / solid_angle;
            glare.sources.push(GlareSource {
                name,
                luminance,
                solid_angle,
                direction,
                position_index,
            });
        }
    }
}

/// Adds the sources of `scene` to `glare`.
pub(super) fn find(scene: &Scene, tracer: &PathTracer, observer: &Observer, glare: &mut Glare) {
    for triangles in emitting(scene) {
        let name = scene.groups()[scene.triangles()[triangles[0]].group as usize].clone();
        let points = (POINTS / triangles.len()).max(4);
        let mut seen = Seen::default();
        for &t in &triangles {
            surface(scene, tracer, observer, t, points, &mut seen);
        }
        match seen.all > 0.0 {
            true => seen.enter(name, observer, glare),
            false => {
                let is_behind = |t: &usize| {
                    let ahead = |p: DVec3| (p - observer.eye).dot(observer.direction) > 0.0;
                    !scene.corners(*t).into_iter().any(ahead)
                };
                if triangles.iter().all(is_behind) {
                    glare.behind.push(name);
                }
            }
        }
    }
    for (k, lamp) in scene.luminaires().iter().enumerate() {
        luminaire(lamp, format!("luminaire {}", k + 1), tracer, observer, glare);
    }
}

/// Triangles that emit, those of each source together, by the first of each.
fn emitting(scene: &Scene) -> Vec<Vec<usize>> {
    let emits = |&t: &usize| scene.exitance(t).max_element() > 0.0;
    let all: Vec<usize> = (0..scene.triangles().len()).filter(emits).collect();
    let (mut weld, mut first) = (Weld::default(), vec![]);
    let mut joined = UnionFind::new(all.len());
    for (k, &t) in all.iter().enumerate() {
        for corner in scene.corners(t) {
            let number = weld.number(corner) as usize;
            first.resize(first.len().max(number + 1), k);
            joined.join(first[number], k);
        }
    }
    let mut sources: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (k, &t) in all.iter().enumerate() {
        sources.entry(joined.find(k)).or_default().push(t);
    }
    sources.into_values().collect()
}

/// Adds what is seen of triangle `t`, by this many points.
fn surface(
    scene: &Scene,
    tracer: &PathTracer,
    observer: &Observer,
    t: usize,
    points: usize,
    seen: &mut Seen,
) {
    let [a, b, c] = scene.corners(t);
    let normal = scene.normal(t);
    if normal.dot(observer.eye - a) <= 0.0 {
        return;
    }
    let whole = solid_angle([a, b, c].map(|p| p - observer.eye));
    let places = || (0..points as u32).map(|k| fold_to_triangle(sobol_02_point(k)));
    let position = |[u, v]: [f64; 2]| a + u * (b - a) + v * (c - a);
    // Solid angle by area.
    let weight = |place| {
        let (towards, distance) = (position(place) - observer.eye).normalize_and_length();
        -normal.dot(towards) / (distance * distance)
    };
    let weights: f64 = places().map(weight).sum();
    for place in places() {
        let direction = (position(place) - observer.eye).normalize();
        if direction.dot(observer.direction) <= 0.0 {
            continue;
        }
        let share = whole * weight(place) / weights;
        seen.all += share;
        if scene.is_solid(t, place) {
            let passed = tracer.passed_to(observer.eye, position(place), Some(t));
            seen.add(direction, share, passed * scene.exitance_at(t, place) / PI);
        }
    }
}

/// Solid angle of a triangle with its corners at these places (Van Oosterom and Strackee 1983).
fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
    let [x, y, z] = [a, b, c].map(DVec3::length);
    let volume = a.dot(b.cross(c)).abs();
    2.0 * libm::atan2(volume, x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
}

/// Adds what is seen of a luminaire: intensity over the projected area of its opening.
fn luminaire(
    lamp: &Luminaire,
    name: String,
    tracer: &PathTracer,
    observer: &Observer,
    glare: &mut Glare,
) {
    let (towards, distance) = (lamp.position - observer.eye).normalize_and_length();
    if towards.dot(observer.direction) <= 0.0 {
        glare.behind.push(name);
        return;
    }
    // The irradiance of what faces the lamp is I/d².
    let intensity = lamp.irradiance(lamp.position, observer.eye, towards) * distance * distance;
    let area = lamp.projected_area(towards);
    if intensity <= 0.0 {
        return;
    }
    if area <= 0.0 {
        glare.without_size.push(name);
        return;
    }
    let mut seen = Seen::default();
    let points = 256_u32;
    for k in 0..points {
        let [x, y] = sobol_02_point(k);
        let point = lamp.point([x, y, (f64::from(k) + 0.5) / f64::from(points)]);
        let passed = tracer.passed_to(observer.eye, point, None);
        let share = area / (distance * distance) / f64::from(points);
        seen.add(towards, share, passed * lamp.scale * intensity / area);
    }
    seen.enter(name, observer, glare);
}
