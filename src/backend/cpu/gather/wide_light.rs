//! A light that fills much of the hemisphere: rays over it tell how much of it is visible.
//!
//! ```text
//!    ════════════ light ════════════      share of it that is visible
//!      │  ╲    ╱ ▄▄▄▄                       = rays that meet it / rays towards it
//!      │    ╲╱   ████  what hides it        = 3/4
//!      ╲  ╱ ╲ │
//!        ● point                          irradiance = closed form × that share
//! ```
//!
//! Rays towards it are of equal weight, and points spread over its area are not: those right above
//! count for most of a sky that reaches to the horizon, and are few.

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::lights::Light;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::scene::{Rgb, Scene};

use super::visible::{Visible, point_on};

/// A light as seen from a point.
pub(super) struct WideLight {
    pub light: u32,
    /// Form factor from the point to all of it, as if nothing were in between.
    unoccluded: f64,
    exitance: Rgb,
    /// Inward normals of the pyramids from the point to its triangles.
    pyramids: Vec<[DVec3; 3]>,
}

/// Points by which their weights are compared. Chosen by hand.
const POINTS: u32 = 32;

/// Rays towards a light, at least: with fewer, none of them may be.
const LEAST_RAYS: f64 = 8.0;

impl WideLight {
    /// `light`, whose number and unoccluded form factor are given, from `point`.
    pub fn new(
        light: &Light,
        (number, unoccluded): (u32, f64),
        scene: &Scene,
        point: &GatherPoint,
    ) -> WideLight {
        let pyramid = |&t: &u32| {
            let [a, b, c] = scene.corners(t as usize).map(|corner| corner - point.position);
            let (ab, bc, ca) = (b.cross(a), c.cross(b), a.cross(c));
            // Seen from behind it sends nothing.
            (a.dot(bc) > 0.0).then_some([ab, bc, ca])
        };
        let pyramids = light.triangles.iter().filter_map(pyramid).collect();
        WideLight { light: number, unoccluded, exitance: light.exitance, pyramids }
    }

    /// Whether rays over the hemisphere know better how much of a `light` with this `unoccluded`
    /// form factor is visible from `point` than one ray to a point on it for each `rays_a_point` of
    /// them: whether more of these, of which there are `rays`, go there than such points are worth.
    /// n points of weights w are worth (Σ w)² / Σ w² of equal weight (Kish 1965, section 11.7).
    pub fn is_wide(
        light: &Light,
        unoccluded: f64,
        scene: &Scene,
        point: &GatherPoint,
        [rays, rays_a_point]: [u32; 2],
    ) -> bool {
        if !light.convex || f64::from(rays) * unoccluded < LEAST_RAYS {
            return false;
        }
        let weights = (0..POINTS).map(|i| point_on(light, scene, point, sobol_02_point(i)).factor);
        let (sum, squares) =
            weights.fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
        let worth = sum * sum / (squares * f64::from(POINTS)).max(f64::MIN_POSITIVE);
        unoccluded * f64::from(rays_a_point) > worth
    }

    /// Whether the light lies in a `direction` above the horizon, behind whatever hides it.
    fn is_towards(&self, direction: DVec3) -> bool {
        let is_inside = |normals: &[DVec3; 3]| normals.iter().all(|n| n.dot(direction) >= 0.0);
        self.pyramids.iter().any(is_inside)
    }

    /// Counts a ray in a `direction` above the horizon in what is `visible`: with what panes let
    /// through of it, if it meets the light.
    pub fn add_ray(&self, direction: DVec3, passed: Option<Rgb>, visible: &mut Visible) {
        if passed.is_some() || self.is_towards(direction) {
            visible.all += 1.0;
        }
        visible.seen += passed.unwrap_or(Rgb::ZERO);
    }

    /// The form factor to what rays found `visible` of it, per channel.
    pub fn form_factor(&self, visible: &Visible) -> Rgb {
        visible.seen * visible.share_of(Some(self.unoccluded))
    }

    /// Its irradiance where rays found this much of it `visible`.
    pub fn irradiance(&self, visible: &Visible) -> Rgb {
        self.exitance * self.form_factor(visible)
    }
}
