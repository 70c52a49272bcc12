//! Contact segments as lines between lattice points, with near points merged.
//!
//! The lattice is one of barycentric weights: points on a side are exactly on it, and equal for the
//! two triangles that share the side.

use glam::{DVec2, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};
use serde::{Deserialize, Serialize};

use crate::mesh::contacts::{ContactSegment, part_inside};

/// Steps of the lattice along a side: those of a 32-bit coordinate in a file.
pub(super) const STEPS: u32 = 1 << 24;

/// A point of a triangle on the lattice: the weights of its second and third corner, in steps.
pub(super) type LatticePoint = [u32; 2];

/// The cuts of a triangle.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Cuts {
    pub segments: Vec<[LatticePoint; 2]>,
    /// Points on each side, steps from its first corner.
    pub on_sides: [Vec<u32>; 3],
}

/// Points of a triangle, with near ones merged.
pub(super) struct Snapping {
    corners: [DVec3; 3],
    /// Height of each corner above the side opposite, scene unit.
    heights: [f64; 3],
    distance: f64,
    /// Points so far, by their cell of a grid.
    known: FxHashMap<[i64; 3], Vec<(DVec3, LatticePoint)>>,
}

impl Snapping {
    pub fn new(corners: [DVec3; 3], distance: f64) -> Snapping {
        let [a, b, c] = corners;
        let double_area = (b - a).cross(c - a).length();
        let opposite = [b.distance(c), c.distance(a), a.distance(b)];
        let heights = opposite.map(|side| double_area / side);
        Snapping { corners, heights, distance, known: FxHashMap::default() }
    }

    pub fn cuts(mut self, segments: &[ContactSegment]) -> Cuts {
        let mut cuts = Cuts::default();
        let mut known = FxHashSet::default();
        for segment in segments {
            let Some(ends) = clipped(segment.ends) else { continue };
            let [from, to] = ends.map(|end| self.snapped(end));
            let together = [from, to].map(sides_of);
            let along_side = (0..3).any(|k| together[0][k] && together[1][k]);
            if from != to && !along_side && known.insert([from.min(to), from.max(to)]) {
                cuts.segments.push([from, to]);
            }
        }
        for point in cuts.segments.iter().flatten() {
            for (k, step) in side_steps(*point).into_iter().enumerate() {
                cuts.on_sides[k].extend(step);
            }
        }
        cuts
    }

    /// The lattice point for these weights of the second and third corner: a corner, a point on a
    /// side or another point, if these are near.
    fn snapped(&mut self, point: DVec2) -> LatticePoint {
        let weights = [1.0 - point.x - point.y, point.x, point.y].map(|w| w.clamp(0.0, 1.0));
        let position = self.position(weights);
        let corner = (0..3).find(|&k| position.distance(self.corners[k]) < self.distance);
        if let Some(k) = corner {
            return [[0, 0], [STEPS, 0], [0, STEPS]][k];
        }
        let lattice = self.on_lattice(weights);
        let [u, v] = lattice.map(|k| f64::from(k) / f64::from(STEPS));
        let position = self.position([1.0 - u - v, u, v]);
        let cell = (position / self.distance).floor().as_i64vec3().to_array();
        let known = self.known_near(cell, position, lattice);
        known.unwrap_or_else(|| {
            self.known.entry(cell).or_default().push((position, lattice));
            lattice
        })
    }

    fn position(&self, weights: [f64; 3]) -> DVec3 {
        (0..3).map(|k| weights[k] * self.corners[k]).sum()
    }

    /// The lattice point nearest to the point of these weights: on a side, if one is near.
    fn on_lattice(&self, [a, b, c]: [f64; 3]) -> LatticePoint {
        let steps = |w: f64| ((w * f64::from(STEPS)).round() as u32).min(STEPS);
        let height = [a * self.heights[0], b * self.heights[1], c * self.heights[2]];
        let near_side = (0..3)
            .filter(|&k| height[k] < self.distance)
            .min_by(|&k, &l| height[k].total_cmp(&height[l]));
        match near_side {
            Some(0) => {
                let v = steps(c / (b + c));
                [STEPS - v, v]
            }
            Some(1) => [0, steps(c / (a + c))],
            Some(_) => [steps(b / (a + b)), 0],
            None => {
                let u = steps(b);
                [u, steps(c).min(STEPS - u)]
            }
        }
    }

    /// A point known already that is near a `position` in this `cell` of the grid. A point on a
    /// side stays on it.
    fn known_near(
        &self,
        cell: [i64; 3],
        position: DVec3,
        lattice: LatticePoint,
    ) -> Option<LatticePoint> {
        let sides = sides_of(lattice);
        let same_sides = |other| (0..3).all(|k| !sides[k] || sides_of(other)[k]);
        let steps = || -1..=1;
        let beside =
            steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| [x, y, z])));
        // At an element size of 0 cells are at the end of their range.
        let cells = beside.map(|d: [i64; 3]| [0, 1, 2].map(|k| cell[k].saturating_add(d[k])));
        let mut points = cells.flat_map(|cell| self.known.get(&cell).into_iter().flatten());
        let is_near = |(p, other): &&(DVec3, LatticePoint)| {
            p.distance(position) < self.distance && same_sides(*other)
        };
        points.find(is_near).map(|&(_, known)| known)
    }
}

/// The part of a segment that lies in the triangle; none if there is none.
pub(super) fn clipped(ends: [DVec2; 2]) -> Option<[DVec2; 2]> {
    let shares = part_inside(ends.map(|p| [1.0 - p.x - p.y, p.x, p.y]))?;
    Some(shares.map(|share| ends[0].lerp(ends[1], share)))
}

/// The sides that a point is on, indexed by their first corner.
fn sides_of([u, v]: LatticePoint) -> [bool; 3] {
    [v == 0, u + v == STEPS, u == 0]
}

/// Steps from the start of each side whose interior contains the point.
pub(super) fn side_steps([u, v]: LatticePoint) -> [Option<u32>; 3] {
    let within = |step: u32| (0 < step && step < STEPS).then_some(step);
    let [first, second, third] = sides_of([u, v]);
    [within(u).filter(|_| first), within(v).filter(|_| second), within(STEPS - v).filter(|_| third)]
}
