//! Axis-aligned boxes: the one box type of the crate.
//!
//! ```text
//!        6────────7  high          Corner k lies on the high side of the
//!       ╱│       ╱│                x, y and z axis where k has the bits
//!      2────────3 │                1, 2 and 4.
//!      │ 4──────│─5     y  z
//!      │╱       │╱      │ ╱        A box contains its boundary. The empty
//! low  0────────1       └── x      box has low = ∞ and high = −∞.
//! ```

use super::COINCIDENCE_TOLERANCE;
use glam::{BVec3, DVec3};

/// An axis-aligned box from its lowest to its highest coordinates, both within it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest coordinates, scene unit.
    pub low: DVec3,
    /// Highest coordinates, scene unit.
    pub high: DVec3,
}

impl Aabb {
    /// Contains no point; the neutral element of [`Aabb::union`].
    pub const EMPTY: Aabb = Aabb { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    /// Contains every point.
    pub const EVERYTHING: Aabb = Aabb { low: DVec3::NEG_INFINITY, high: DVec3::INFINITY };

    /// The six sides by the corners that [`Aabb::corners`] numbers, counter-clockwise from outside.
    pub const FACES: [[usize; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

    /// The box around all of `points` except the fraction `share` of their weight at either end of
    /// each axis; none if they have no weight or all coincide.
    pub fn around_most(points: &[(DVec3, f64)], share: f64) -> Option<Aabb> {
        let total: f64 = points.iter().map(|(_, weight)| weight).sum();
        let allowed = share * total;
        let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
        for axis in 0..3 {
            let mut along: Vec<(f64, f64)> =
                points.iter().map(|&(at, weight)| (at[axis], weight)).collect();
            along.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
            low[axis] = first_beyond(allowed, along.iter())?;
            high[axis] = first_beyond(allowed, along.iter().rev())?;
        }
        (total > 0.0 && low != high).then_some(Aabb { low, high })
    }

    /// The box around the weights of `points`, less 1 % at either end of each axis, if its diagonal
    /// is less than a quarter of `diagonal`: in an ordinary room the light fills the room.
    pub fn concentrated(points: &[(DVec3, f64)], diagonal: f64) -> Option<Aabb> {
        Aabb::around_most(points, 0.01).filter(|most| most.diagonal() * 4.0 < diagonal)
    }

    /// The smallest box around `points`; [`Aabb::EMPTY`] around none.
    pub fn from_points(points: impl IntoIterator<Item = DVec3>) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for point in points {
            bounds.include(point);
        }
        bounds
    }

    /// Grows the box until it contains `point`.
    pub fn include(&mut self, point: DVec3) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }

    /// The smallest box around both.
    pub fn union(self, other: Aabb) -> Aabb {
        Aabb { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// The box with every side moved outwards by `margin`, scene unit.
    pub fn expanded(self, margin: f64) -> Aabb {
        Aabb { low: self.low - margin, high: self.high + margin }
    }

    /// Whether `point` is within the box or on its boundary.
    pub fn contains(&self, point: DVec3) -> bool {
        point.cmpge(self.low).all() && point.cmple(self.high).all()
    }

    /// Whether the two boxes have a point in common, if only on their boundaries.
    pub fn overlaps(&self, other: &Aabb) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }

    /// Lengths of the sides along x, y and z, scene unit.
    pub fn size(&self) -> DVec3 {
        self.high - self.low
    }

    /// Length of the longest side, scene unit.
    pub fn longest_side(&self) -> f64 {
        self.size().max_element()
    }

    /// Length of the diagonal, scene unit.
    pub fn diagonal(&self) -> f64 {
        self.size().length()
    }

    /// The axis (0 to 2) of the longest side; the last of those that are equal but for rounding.
    pub fn longest_axis(&self) -> usize {
        let size = self.size();
        let long = (1.0 - COINCIDENCE_TOLERANCE) * size.max_element();
        (0..3).rfind(|&axis| size[axis] >= long).unwrap_or(2)
    }

    /// The point in the middle. Written so that finite coordinates do not overflow.
    pub fn centre(&self) -> DVec3 {
        self.low + self.size() / 2.0
    }

    /// The eight corners, in the order of the module's drawing.
    pub fn corners(&self) -> [DVec3; 8] {
        [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
            let on_high_side = BVec3::new(k & 1 != 0, k & 2 != 0, k & 4 != 0);
            DVec3::select(on_high_side, self.high, self.low)
        })
    }
}

/// Of coordinates with weights the first one at which the sum of the weights is above `allowed`.
fn first_beyond<'p>(allowed: f64, mut along: impl Iterator<Item = &'p (f64, f64)>) -> Option<f64> {
    let mut sum = 0.0;
    let is_beyond = |&&(_, weight): &&(f64, f64)| {
        sum += weight;
        sum > allowed
    };
    along.find(is_beyond).map(|&(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn contains_its_points_and_no_others() {
        let points = [DVec3::new(1.0, -2.0, 3.0), DVec3::new(-1.0, 5.0, 3.5), DVec3::ZERO];
        let bounds = Aabb::from_points(points);
        assert_eq!((bounds.low, bounds.high), (DVec3::new(-1., -2., 0.), DVec3::new(1., 5., 3.5)));
        assert!(points.iter().all(|&p| bounds.contains(p)));
        assert!(!bounds.contains(DVec3::new(1.1, 0.0, 0.0)));
        assert!(!Aabb::EMPTY.contains(DVec3::ZERO) && Aabb::EVERYTHING.contains(DVec3::ZERO));
        assert_eq!(Aabb::EMPTY.union(bounds), bounds);
        assert_eq!((bounds.longest_axis(), bounds.longest_side()), (1, 7.0));
        assert_eq!(bounds.centre(), DVec3::new(0.0, 1.5, 1.75));
        let cube = Aabb { low: DVec3::ZERO, high: DVec3::new(1.0 + 1e-15, 1.0 - 1e-15, 0.5) };
        assert_eq!(cube.longest_axis(), 1, "the last of equals");
    }

    #[test]
    fn overlaps_where_sides_touch() {
        let unit = Aabb { low: DVec3::ZERO, high: DVec3::ONE };
        let moved =
            |by: f64| Aabb { low: unit.low + DVec3::X * by, high: unit.high + DVec3::X * by };
        assert!(unit.overlaps(&moved(1.0)) && unit.overlaps(&moved(-1.0)));
        assert!(!unit.overlaps(&moved(1.5)) && unit.overlaps(&moved(1.5).expanded(0.5)));
        assert!(!unit.overlaps(&Aabb::EMPTY) && unit.overlaps(&Aabb::EVERYTHING));
    }

    #[test]
    fn faces_are_seen_from_outside() {
        let bounds = Aabb { low: DVec3::new(-1.0, 2.0, 0.5), high: DVec3::new(3.0, 4.0, 1.0) };
        let corners = bounds.corners();
        for [a, b, c, d] in Aabb::FACES.map(|face| face.map(|k| corners[k])) {
            let normal = (b - a).cross(c - a);
            assert!(normal.dot(a - bounds.centre()) > 0.0);
            assert_eq!(normal.dot(d - a), 0.0);
        }
    }
}
