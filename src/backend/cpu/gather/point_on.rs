//! Points on a light, and the form factors that they estimate.

use std::f64::consts::PI;

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::lights::Light;
use crate::scene::Scene;

/// A point on a light.
pub(super) struct PointOn {
    /// Vector from the gathering point, scene unit.
    pub to: DVec3,
    /// The form factor of all of the light, estimated from this point; 0 behind it or below the
    /// horizon.
    pub factor: f64,
    pub is_hole: bool,
}

/// The point of `light` for a point in the unit square, uniform over its area.
pub(super) fn point_on(
    light: &Light,
    scene: &Scene,
    point: &GatherPoint,
    [x, y]: [f64; 2],
) -> PointOn {
    let (k, across) = light.surface.locate(x);
    let triangle = light.triangles[k] as usize;
    let [a, b, c] = scene.corners(triangle);
    // Uniform over a triangle (Pharr, Jakob, Humphreys 2016, 13.6.5).
    let (root, v) = (across.sqrt(), y);
    let target = a * (1.0 - root) + (b * (1.0 - v) + c * v) * root;
    let is_hole = !scene.is_solid(triangle, [root * (1.0 - v), root * v]);
    let to = target - point.position;
    let facing = (-scene.normal(triangle).dot(to)).max(0.0);
    let above = point.normal.dot(to).max(0.0);
    let r2 = to.length_squared();
    let lit = facing > 0.0 && above > 0.0;
    let factor = light.surface.total_area() * facing * above / (PI * r2 * r2);
    PointOn { to, factor: if lit { factor } else { 0.0 }, is_hole }
}
