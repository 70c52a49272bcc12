//! What arrives straight from luminaires: by rays to points of their openings.
//!
//! ```text
//!   one that is a point       E = I cos θ / d²             one ray: exact
//!   one with an opening       E = ∫ I cos θ / d² dA / A · visible share
//!                                 by Gauss points           by rays, until they agree
//! ```
//!
//! So where nothing hides an opening there is no noise. A hemicube with the intensity in the place
//! of the cosine, as seen from the lamp, would have the pixels of its shadows fall on the floor.

use std::f64::consts::PI;

use glam::DVec3;

use super::GatherPoint;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::quadrature::{GAUSS_LEGENDRE_3, Node};
use crate::sampling::low_discrepancy::{r2_point, sobol_02_point};
use crate::sampling::rotation::{CellRotation, second_rotation};
use crate::scene::{Luminaire, Rgb};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// The luminaires of a scene, and what rays to them meet.
pub(crate) struct LuminaireLight<'a> {
    pub luminaires: &'a [Luminaire],
    pub rays: &'a RayScene,
    pub panes: &'a Panes,
    pub rotations: &'a CellRotation,
}

/// An opening this many times smaller than it is far away is a point: the second moment of what it
/// sends is then 1e-7 of it at most.
const POINT_DISTANCE: f64 = 1e3;

/// Rays to an opening: initially, and in total where some of them are occluded. A penumbra then has
/// about forty steps, and noise below its change between vertices.
const RAYS: [u32; 2] = [16, 256];

impl LuminaireLight<'_> {
    /// Irradiance at `point`, W/m² per channel.
    pub fn irradiance(&self, point: &GatherPoint) -> Rgb {
        self.luminaires.iter().map(|luminaire| luminaire.scale * self.of(luminaire, point)).sum()
    }

    /// The same where nothing hides them.
    pub fn unoccluded(&self, point: &GatherPoint) -> Rgb {
        let of = |l: &Luminaire| l.scale * unoccluded(l, point.position, point.normal);
        self.luminaires.iter().map(of).sum()
    }

    /// The luminaires that `point` sees, by their indices, and what they light it with in units of
    /// their scales, W/m²: a mean of the channels where panes let through less of one.
    pub fn unscaled(&self, point: &GatherPoint) -> Vec<(u32, f64)> {
        let of = |luminaire| self.of(luminaire, point).element_sum() / 3.0;
        let all = (0..).zip(self.luminaires.iter().map(of));
        all.filter(|&(_, irradiance)| irradiance > 0.0).collect()
    }

    /// Irradiance at `point` in units of the scale, W/m² per channel.
    fn of(&self, luminaire: &Luminaire, point: &GatherPoint) -> Rgb {
        let GatherPoint { position, normal, .. } = *point;
        let unoccluded = unoccluded(luminaire, position, normal);
        if unoccluded == 0.0 {
            return Rgb::ZERO;
        }
        let distance = luminaire.position.distance(position);
        let seen = match luminaire.extent() * POINT_DISTANCE <= distance {
            true => self.passed(point, luminaire.position),
            false => self.seen_share(luminaire, point),
        };
        unoccluded * seen
    }

    /// The share of the light of an opening that arrives at `point`, per channel.
    fn seen_share(&self, luminaire: &Luminaire, point: &GatherPoint) -> Rgb {
        let rotation = self.rotations.at(point.position, point.near);
        let second_rotation = second_rotation(rotation);
        let (mut seen, mut all) = (Rgb::ZERO, 0.0);
        for (start, end) in [(0, RAYS[0]), (RAYS[0], RAYS[1])] {
            for k in start..end {
                let [x, y] = sobol_02_point(k);
                let [z, _] = r2_point(k as usize, rotation);
                let (x, y) = ((x + second_rotation).fract(), (y + rotation).fract());
                let target = luminaire.point([x, y, z]);
                let irradiance = luminaire.irradiance(target, point.position, point.normal);
                all += irradiance;
                if irradiance > 0.0 {
                    seen += irradiance * self.passed(point, target);
                }
            }
            if seen == Rgb::ZERO || seen == Rgb::splat(all) {
                break;
            }
        }
        seen / f64::max(all, f64::MIN_POSITIVE)
    }

    /// The share per channel of light that arrives at `point` from `target`.
    fn passed(&self, point: &GatherPoint, target: DVec3) -> Rgb {
        let to = target - point.position;
        let reach = point.near / to.length()..1.0 - COINCIDENCE_TOLERANCE;
        if self.rays.occluded(point.position, to, reach.clone(), |_| true) {
            return Rgb::ZERO;
        }
        self.panes.transmittance(point.position, to, reach)
    }
}

/// Irradiance at `at` with this unit `normal` where nothing hides the opening, in units of the
/// scale.
///
/// Each side of the opening is cut into panels that are half as long as the opening is far, or as
/// 16, with three Gauss points each: where intensity is smooth the error is
/// about 8⁻⁶ = 4e-6 (see [`crate::geometry::quadrature`]).
fn unoccluded(luminaire: &Luminaire, at: DVec3, normal: DVec3) -> f64 {
    if luminaire.extent() * POINT_DISTANCE <= luminaire.position.distance(at) {
        return luminaire.irradiance(luminaire.position, at, normal);
    }
    let distance = luminaire.distance_to_box(at);
    let DVec3 { x, y, z } = luminaire.opening.size;
    // Around a round one the second coordinate is an angle, of four panels at least.
    let sides = if luminaire.opening.is_round { [x.max(y), PI * x.max(y), z] } else { [x, y, z] };
    let panels = |side: f64| (2.0 * side / distance).ceil().min(16.0) as u32;
    let mut panels = sides.map(panels);
    if luminaire.opening.is_round {
        panels[1] = panels[1].max(4);
    }
    let [x, y, z] = panels.map(nodes);
    let mut sum = 0.0;
    for x in x {
        for y in y.clone() {
            for z in z.clone() {
                let point = luminaire.point([x.x, y.x, z.x]);
                let weight = x.weight * y.weight * z.weight;
                sum += weight * luminaire.irradiance(point, at, normal);
            }
        }
    }
    sum
}

/// Three Gauss points in each of `panels` parts of [0, 1]; its middle where there is none.
fn nodes(panels: u32) -> impl Iterator<Item = Node> + Clone {
    let middle: &[Node] = &[Node { x: 0.5, weight: 1.0 }];
    let rule = if panels == 0 { middle } else { &GAUSS_LEGENDRE_3 };
    let width = 1.0 / f64::from(panels.max(1));
    (0..panels.max(1)).flat_map(move |k| {
        let in_panel = move |node: &Node| Node {
            x: (f64::from(k) + node.x) * width,
            weight: node.weight * width,
        };
        rule.iter().map(in_panel)
    })
}
