//! A convex polygon prepared for integration: its normal and a sphere around it.

use std::f64::consts::PI;

use glam::DVec3;

use super::edge::edges;
use super::lambert::lambert;
use crate::geometry::polygon::{clip, fan, max_distance};
use crate::geometry::quadrature::{collapsed_point, gauss_legendre_for_gap};

/// A convex planar polygon with its unit normal and a sphere around it.
pub(super) struct Face {
    pub corners: Vec<DVec3>,
    pub normal: DVec3,
    /// Mean of the corners, centre of the sphere.
    pub centre: DVec3,
    /// Distance from `centre` to the farthest corner.
    pub radius: f64,
}

impl Face {
    /// The face with these corners and this unit normal; `None` if it has fewer than three corners
    /// or no extent.
    pub fn new(corners: Vec<DVec3>, normal: DVec3) -> Option<Face> {
        let centre = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let radius = max_distance(&corners, centre);
        (corners.len() > 2 && radius > 0.0).then_some(Face { corners, normal, centre, radius })
    }

    /// Form factor from a surface element at `point` with unit `normal`, where the element and this
    /// face are entirely in front of each other.
    pub fn factor_from(&self, point: DVec3, normal: DVec3) -> f64 {
        let gap = point.distance(self.centre) - self.radius;
        // Lambert's formula loses the ratio of distance to size in digits, with a relative error of
        // 64 · 2e-16 times a few here; in cubature nothing cancels.
        if gap < 64.0 * self.radius {
            return lambert(point, normal, &self.corners);
        }
        self.integrate(gap, |y| {
            let ray = y - point;
            let square = ray.length_squared();
            -normal.dot(ray) * self.normal.dot(ray) / (PI * square * square)
        })
    }

    /// Surface integral of `f`, smooth but for singularities `gap` away from the face: a Gauss
    /// product rule on each triangle of a fan, collapsed towards the first corner.
    pub fn integrate(&self, gap: f64, f: impl Fn(DVec3) -> f64) -> f64 {
        let rule = gauss_legendre_for_gap(gap / self.radius);
        let mut sum = 0.0;
        for triangle in fan(&self.corners) {
            let [a, b, c] = triangle;
            let jacobian = (b - a).cross(c - a).length();
            for u in rule {
                for v in rule {
                    let value = f(collapsed_point(triangle, u.x, v.x));
                    sum += u.weight * v.weight * u.x * jacobian * value;
                }
            }
        }
        sum
    }

    /// Both parts of a cut through the centre, perpendicular to the longest edge.
    pub fn halves(&self) -> impl Iterator<Item = Face> {
        let longest = edges(&self.corners).max_by(|a, b| a.length.total_cmp(&b.length));
        let axis = longest.map_or(DVec3::ZERO, |edge| edge.direction);
        let half = |axis| Face::new(clip(&self.corners, self.centre, axis), self.normal);
        [half(axis), half(-axis)].into_iter().flatten()
    }
}
