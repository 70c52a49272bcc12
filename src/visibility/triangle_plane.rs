//! The exact test of a ray against a triangle, in 64 bits.

use std::ops::Range;

use glam::DVec3;

/// The hit of a ray on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub triangle: usize,
    /// Distance in units of the ray's direction.
    pub distance: f64,
    /// Barycentric weights of the second and third corner.
    pub u: f64,
    pub v: f64,
    /// Whether the ray hit the front.
    pub front: bool,
}

/// A triangle, prepared for intersection.
#[derive(Clone, Copy, Debug)]
pub(super) struct TrianglePlane {
    corner: DVec3,
    /// Of any length, on the front.
    normal: DVec3,
    /// Gradients of the barycentric weights of the second and third corner.
    gradients: [DVec3; 2],
    /// Index of the triangle.
    pub triangle: u32,
    /// Whether rays do not hit its back.
    pub back_is_covered: bool,
}

/// A ray in the frame of a triangle.
#[derive(Clone, Copy)]
pub(super) struct LocalRay {
    pub from: DVec3,
    /// Of any length.
    pub direction: DVec3,
    /// What is added to the index of the triangle: several groups may have it.
    pub first: u32,
}

impl TrianglePlane {
    pub fn new(triangle: u32, [a, b, c]: [DVec3; 3]) -> TrianglePlane {
        let (u, v) = (b - a, c - a);
        // A length of the order of one keeps squares of tiny and of huge triangles within range.
        let size = u.length().max(v.length()).max(f64::MIN_POSITIVE);
        let (u, v) = (u / size, v / size);
        let normal = u.cross(v);
        let square = normal.length_squared();
        let gradient =
            |edge: DVec3| if square > 0.0 { edge / (square * size) } else { DVec3::ZERO };
        let gradients = [gradient(v.cross(normal)), gradient(normal.cross(u))];
        TrianglePlane { corner: a, normal, gradients, triangle, back_is_covered: false }
    }

    /// Intersection of the line from a point along a direction with the triangle, within `reach` in
    /// units of the direction: its plane first (Badouel 1990).
    #[inline(always)]
    pub fn intersect(&self, from: DVec3, direction: DVec3, reach: Range<f64>) -> Option<Hit> {
        let &TrianglePlane { corner, normal, gradients, triangle, back_is_covered } = self;
        let (facing, to) = (normal.dot(direction), corner - from);
        // Hits out of range are rejected without a division. Negated, so that NaN, as for a line in
        // the plane, is no hit.
        let (rise, steep) = (normal.dot(to) * facing.signum(), facing.abs());
        if !(rise > reach.start * steep && rise <= reach.end * steep) || steep == 0.0 {
            return None;
        }
        if back_is_covered && facing > 0.0 {
            return None;
        }
        let distance = rise / steep;
        let at = direction * distance - to;
        let (u, v) = (at.dot(gradients[0]), at.dot(gradients[1]));
        // Closes the seam between neighbours: far above the rounding of the test (some 1e-15), far
        // below visibility.
        let tolerance = 1e-12;
        let inside = u >= -tolerance && v >= -tolerance && u + v <= 1.0 + tolerance;
        let triangle = triangle as usize;
        inside.then_some(Hit { triangle, distance, u, v, front: facing < 0.0 })
    }

    /// The same if it is further than `start`, and nearer than `best`: of equal distances the lower
    /// index wins, in any order of traversal.
    #[inline(always)]
    pub fn nearer(
        &self,
        LocalRay { from, direction, first }: LocalRay,
        start: f64,
        ignored: Option<usize>,
        best: Option<Hit>,
    ) -> Option<Hit> {
        if Some((self.triangle + first) as usize) == ignored {
            return None;
        }
        // Rounded up, so that equal distances are still compared.
        let rounding = |b: &Hit| 4.0 * f64::EPSILON * b.distance.abs();
        let end = best.as_ref().map_or(f64::INFINITY, |b| b.distance + rounding(b));
        let mut hit = self.intersect(from, direction, start..end)?;
        hit.triangle += first as usize;
        let is_behind =
            best.is_some_and(|b| (b.distance, b.triangle) < (hit.distance, hit.triangle));
        (!is_behind).then_some(hit)
    }
}
