//! Visible share of a light: by points on it, or by rays towards it.

use std::ops::Range;

use super::GatherPoint;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::rotation::second_rotation;
use crate::scene::{Rgb, Sun};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Sums of form factors over points on a light, or over rays towards it, all with equal weight.
#[derive(Debug, Default)]
pub(crate) struct Visible {
    pub points: f64,
    /// Of those that are visible; times the transmittance of panes, per channel.
    pub seen: Rgb,
    /// Of all that are above the horizon and face the point.
    pub all: f64,
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

    /// Whether some of it is visible, and some is not.
    pub fn is_partial(&self) -> bool {
        self.seen != Rgb::ZERO && self.seen.element_sum() < 3.0 * (1.0 - 1e-12) * self.all
    }

    pub fn add(&mut self, other: &Visible) {
        self.points += other.points;
        self.seen += other.seen;
        self.all += other.all;
    }

    /// Sums of cosines at `point` over the rays of `range`, to points spread over the disc of `sun`
    /// by this `rotation`.
    pub fn of_sun(
        sun: &Sun,
        point: &GatherPoint,
        rotation: f64,
        range: Range<u32>,
        surfaces: &RayScene,
        panes: &Panes,
    ) -> Visible {
        let mut out = Visible { points: f64::from(range.end - range.start), ..Default::default() };
        let second_rotation = second_rotation(rotation);
        for [x, y] in range.map(sobol_02_point) {
            let direction = sun.towards([(x + second_rotation).fract(), (y + rotation).fract()]);
            let cosine = point.normal.dot(direction).max(0.0);
            let reach = point.near..f64::INFINITY;
            out.all += cosine;
            let from = point.position;
            if cosine > 0.0 && !surfaces.occluded(from, direction, reach.clone(), |_| true) {
                out.seen += cosine * panes.transmittance(from, direction, reach);
            }
        }
        out
    }

    /// Irradiance of `sun` at `point` by these sums of cosines, W/m² per channel.
    pub fn irradiance_of_sun(&self, sun: &Sun, point: &GatherPoint) -> Rgb {
        match sun.unoccluded(point.normal.dot(sun.direction)) {
            Some(irradiance) => irradiance * (self.seen / self.all.max(f64::MIN_POSITIVE)),
            None => sun.irradiance * (self.seen / self.points.max(1.0)),
        }
    }
}
