//! Selection of cuts: contact segments with light on both sides, or with a slit on one.
//!
//! The inside of a closed solid that stands on a surface is dark and not visible; values at
//! vertices there are extrapolated from outside. Only behind a wall, a plate or the rim of a floor,
//! or where a solid is open, is there visible light that differs, or visible darkness. But across a
//! slit between two solids, narrower than elements, an element would extend past both, and the slit
//! would be as bright as the surface beside the solids.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::snapping::clipped;
use crate::mesh::contacts::ContactSegment;
use crate::sampling::hemisphere::HemisphereSamples;
use crate::scene::Scene;
use crate::visibility::buried;
use crate::visibility::ray_scene::RayScene;

/// Number of rays that test whether a point is inside a solid: below 200, one front among them
/// shows that it is not ([`buried::INSIDE`]). Plain choice.
const OPENNESS_RAYS: u32 = 128;

/// Tests on which sides of a contact segment light may fall.
pub(super) struct Openness {
    rays: Arc<RayScene>,
    directions: HemisphereSamples,
    /// Distances of test points beside a segment, which is no shorter, scene unit: within and
    /// beyond thin walls.
    beside: [f64; 2],
    /// Height of test points above the surface, in units of these distances.
    above: f64,
}

impl Openness {
    pub fn new(scene: &Scene, above: f64, beside: [f64; 2]) -> Openness {
        let directions = HemisphereSamples::progressive(OPENNESS_RAYS);
        Openness { rays: RayScene::of_scene(scene), directions, beside, above }
    }

    /// Whether, somewhere along the `segment` of the triangle with these `corners`, neither side is
    /// inside a solid that stands there, or the side that is not is a slit. A segment too short for
    /// a test beside it is tested as the whole line that it ends.
    pub fn is_worth_a_cut(&self, segment: &ContactSegment, [a, b, c]: [DVec3; 3]) -> bool {
        let Some(ends) = clipped(segment.ends).filter(|ends| !is_on_side(ends)) else {
            return false;
        };
        let on_plane = |p: DVec2| a + p.x * (b - a) + p.y * (c - a);
        let line = segment.ends.map(on_plane);
        let normal = (b - a).cross(c - a).normalize();
        let across = normal.cross(line[1] - line[0]).normalize_or_zero();
        let mut long_enough =
            self.beside.iter().filter(|&&beside| line[0].distance(line[1]) >= beside);
        long_enough.any(|&beside| {
            let [from, to] = part_of_length(beside, ends.map(on_plane), line);
            [0.2, 0.5, 0.8].into_iter().any(|share| {
                let point = from.lerp(to, share) + self.above * beside * normal;
                let at = |away: DVec3| point + beside * away;
                match [across, -across].map(|away| self.is_open(at(away), normal)) {
                    [true, true] => true,
                    [true, false] => self.is_slit(at(across), across),
                    [false, true] => self.is_slit(at(-across), -across),
                    [false, false] => false,
                }
            })
        })
    }

    /// Whether another wall is nearer than the finest element edge, seen `away` from the wall
    /// beside.
    fn is_slit(&self, point: DVec3, away: DVec3) -> bool {
        let [_, finest] = self.beside;
        self.rays.occluded(point, away, 0.0..finest, |_| true)
    }

    fn is_open(&self, point: DVec3, normal: DVec3) -> bool {
        // Most points are in the open, which the first 4 rays show; 4 divides the number of rays.
        let batch = 4;
        let max_backs = buried::INSIDE * f64::from(OPENNESS_RAYS);
        let (mut cast, mut backs) = (0, 0);
        while f64::from(backs) < max_backs && f64::from(backs + OPENNESS_RAYS - cast) >= max_backs {
            let directions = self.directions.directions_in(cast..cast + batch, normal, 0.5);
            self.rays.closest_hits(point, directions, 0.0, None, |_, hit| {
                backs += u32::from(hit.is_some_and(|hit| !hit.front));
            });
            cast += batch;
        }
        f64::from(backs) < max_backs
    }
}

/// Whether a part of a triangle, by its ends in barycentric coordinates, is one of its sides: there
/// is no cut where a neighbour begins.
fn is_on_side(ends: &[DVec2; 2]) -> bool {
    // About the rounding of coordinates in single precision.
    let from_side = |side: fn(&DVec2) -> f64| ends.iter().all(|p| side(p).abs() < 1e-7);
    from_side(|p| p.x) || from_side(|p| p.y) || from_side(|p| 1.0 - p.x - p.y)
}

/// The `part` of a `line`, extended on both sides to `length` if the line is that long. Of a line
/// across the side of two triangles the part on one of them may be arbitrarily short: with a cut on
/// the other alone, the surface would continue around its end.
fn part_of_length(length: f64, part: [DVec3; 2], line: [DVec3; 2]) -> [DVec3; 2] {
    let (along, whole) = ((line[1] - line[0]).normalize_or_zero(), line[0].distance(line[1]));
    let [from, to] = part.map(|p| along.dot(p - line[0]));
    let wanted = (to - from).max(length).min(whole);
    let start = ((from + to - wanted) / 2.0).clamp(0.0, whole - wanted);
    [start, start + wanted].map(|at| line[0] + at * along)
}
