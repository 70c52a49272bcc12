//! Lights: what emits, in pieces that are looked at one by one.

use std::collections::HashMap;
use std::sync::Arc;

use super::GatherPoint;
use crate::form_factor::closed_form::point_to_polygon;
use crate::geometry::weld::position_key;
use crate::sampling::surface::AreaSampler;
use crate::scene::{Rgb, Scene};

/// Emitting triangles of one material that hang together by corners.
#[derive(Clone, Debug)]
pub(crate) struct Light {
    /// Its triangles, ascending.
    pub triangles: Vec<u32>,
    /// Chooses among them in proportion to area.
    pub surface: AreaSampler,
    /// Exitance of all of them, W/m² per channel.
    pub exitance: Rgb,
    /// Whether no part of it can hide another: all of it lies behind each of its triangles' planes.
    /// Then the closed forms of the triangles that face a place add up to the light's.
    pub convex: bool,
}

/// The lights of a scene.
#[derive(Clone, Debug)]
pub(crate) struct Lights {
    scene: Arc<Scene>,
    /// Every light.
    pub lights: Vec<Light>,
    /// Light of each triangle, or [`NO_LIGHT`].
    pub of_triangle: Vec<u32>,
}

/// What a triangle that does not emit has for a light.
pub(crate) const NO_LIGHT: u32 = u32::MAX;

/// Lights that are looked at one by one from a place, at most: those that could give most. The
/// others are seen with all else.
pub(crate) const APART: usize = 8;

/// Nor are those that could not give this share of what all lights could.
const LEAST: f64 = 1e-3;

impl Lights {
    /// Finds the lights of `scene`.
    pub fn new(scene: Arc<Scene>) -> Lights {
        let count = scene.triangles().len();
        let emits = |t: &usize| scene.material(*t).exitance != Rgb::ZERO;
        let mut of_triangle = vec![NO_LIGHT; count];
        let mut at: HashMap<([u64; 3], u32), Vec<usize>> = HashMap::new();
        let keys = |t: usize| {
            let material = scene.triangles()[t].material;
            scene.corners(t).map(|p| (position_key(p), material))
        };
        for t in (0..count).filter(emits) {
            keys(t).into_iter().for_each(|k| at.entry(k).or_default().push(t));
        }
        let mut lights = vec![];
        for start in (0..count).filter(emits) {
            if of_triangle[start] != NO_LIGHT {
                continue;
            }
            let id = lights.len() as u32;
            let (mut triangles, mut open) = (vec![], vec![start]);
            of_triangle[start] = id;
            while let Some(t) = open.pop() {
                triangles.push(t as u32);
                for s in keys(t).into_iter().flat_map(|k| &at[&k]) {
                    if of_triangle[*s] == NO_LIGHT {
                        of_triangle[*s] = id;
                        open.push(*s);
                    }
                }
            }
            triangles.sort_unstable();
            let convex = is_convex(&scene, &triangles);
            let exitance = scene.material(start).exitance;
            let surface = AreaSampler::new(triangles.iter().map(|&t| scene.area(t as usize)));
            lights.push(Light { triangles, surface, exitance, convex });
        }
        Lights { scene, lights, of_triangle }
    }

    /// The lights that are worth a look of their own from `place`, most first, each with the form
    /// factor from there to the whole of it, as if nothing were in between.
    pub fn importance_ranked(&self, place: &GatherPoint) -> Vec<(u32, f64)> {
        let factor = |light: &Light| -> f64 {
            let corners = light.triangles.iter().map(|&t| self.scene.corners(t as usize));
            corners.map(|c| point_to_polygon(place.position, place.normal, &c)).sum()
        };
        let all = (0..).zip(&self.lights).map(|(k, light)| (k, factor(light)));
        let mut seen: Vec<(u32, f64)> = all.filter(|l| l.1 > 0.0).collect();
        let power = |l: &(u32, f64)| l.1 * self.lights[l.0 as usize].exitance.max_element();
        let least = LEAST * seen.iter().map(power).sum::<f64>();
        seen.retain(|l| power(l) > least);
        seen.sort_by(|a, b| power(b).total_cmp(&power(a)).then(a.0.cmp(&b.0)));
        seen.truncate(APART);
        seen
    }
}

/// Slack of the test for convexity, in units of the light's extent: rounding of its corners.
const FLAT: f64 = 1e-9;

fn is_convex(scene: &Scene, triangles: &[u32]) -> bool {
    let corners: Vec<_> = triangles.iter().flat_map(|&t| scene.corners(t as usize)).collect();
    let extent = corners.iter().map(|p| p.distance(corners[0])).fold(0.0, f64::max);
    // Quadratic in the triangles of a light: more than this are looked at as they are.
    triangles.len() <= 1024
        && triangles.iter().all(|&t| {
            let (normal, on) = (scene.normal(t as usize), scene.corners(t as usize)[0]);
            corners.iter().all(|p| normal.dot(p - on) <= FLAT * extent)
        })
}
