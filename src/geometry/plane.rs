//! Oriented planes in Hesse normal form: all points p with n·p = offset.
//!
//! The positive side is where the unit normal n points. Signed distances are positive there; they
//! are in the unit of the coordinates, as the offset is.

use glam::DVec3;

use super::aabb::Aabb;

/// The plane of all points p with n·p = offset.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// Unit normal n.
    pub normal: DVec3,
    /// Signed distance of the plane from the origin along `normal`.
    pub offset: f64,
}

impl Plane {
    /// The plane through `point` with unit normal `normal`.
    pub fn through(point: DVec3, normal: DVec3) -> Plane {
        Plane { normal, offset: normal.dot(point) }
    }

    /// The point of the plane that is nearest to the origin.
    pub fn nearest_to_origin(&self) -> DVec3 {
        self.normal * self.offset
    }

    /// Distance of `point` from the plane, positive on the side that the normal points to.
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// The largest signed distance in a box: that of the corner farthest along the normal.
    pub fn max_signed_distance(&self, bounds: &Aabb) -> f64 {
        let along_normal = self.normal.cmpge(DVec3::ZERO);
        self.signed_distance(DVec3::select(along_normal, bounds.high, bounds.low))
    }

    /// The smallest and the largest signed distance of `points`; (∞, −∞) if there are none.
    pub fn signed_distance_range(&self, points: &[DVec3]) -> (f64, f64) {
        let distances = points.iter().map(|&point| self.signed_distance(point));
        distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), distance| {
            (low.min(distance), high.max(distance))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signed_distances_of_points_and_boxes() {
        // x + 2y + 2z = 6: two along the normal (1, 2, 2)/3.
        let plane = Plane::through(DVec3::new(6.0, 0.0, 0.0), DVec3::new(1.0, 2.0, 2.0) / 3.0);
        let close = |actual: f64, right: f64| assert!((actual - right).abs() < 1e-15, "{actual}");
        close(plane.signed_distance(DVec3::ZERO), -2.0);
        close(plane.signed_distance(plane.nearest_to_origin()), 0.0);
        let corners = [DVec3::ZERO, DVec3::splat(3.0), DVec3::NEG_Z];
        let (low, high) = plane.signed_distance_range(&corners);
        close(low, -2.0 - 2.0 / 3.0);
        close(high, 3.0);
        let bounds = Aabb { low: DVec3::NEG_ONE, high: DVec3::splat(3.0) };
        close(plane.max_signed_distance(&bounds), 3.0);
        let mirrored = Plane { normal: -plane.normal, offset: -plane.offset };
        close(mirrored.max_signed_distance(&bounds), 2.0 + 5.0 / 3.0);
    }
}
