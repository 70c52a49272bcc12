//! Visible share of a light: by points on it, or by rays towards it.

use std::f64::consts::PI;

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::lights::Light;
use crate::scene::{Rgb, Scene};

/// Sums of form factors over points on a light, or over rays towards it, all with equal weight.
#[derive(Debug, Default)]
pub(super) struct Visible {
    pub points: f64,
    /// Of those that are visible; times the transmittance of panes, per channel.
    pub seen: Rgb,
    /// Of all that are above the horizon and face the point.
    pub all: f64,
}

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

impl Visible {
    /// The value of one unit of `seen`: a share of the form factor of all of the light where that
    /// is known in closed form, else of the points.
    pub fn share_of(&self, unoccluded: Option<f64>) -> f64 {
        match unoccluded {
            Some(factor) => factor / self.all.max(1e-300),
            None => 1.0 / self.points.max(1.0),
        }
    }

    pub fn add(&mut self, other: &Visible) {
        self.points += other.points;
        self.seen += other.seen;
        self.all += other.all;
    }
}
