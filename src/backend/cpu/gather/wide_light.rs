//! A light that fills much of the hemisphere: its visible share is estimated by rays over that.
//!
//! ```text
//!    ════════════ light ════════════      share of it that is visible
//!      │  ╲    ╱ ▄▄▄▄                       = rays that hit it / rays towards it
//!      │    ╲╱   ████  blocker              = 3/4
//!      ╲  ╱ ╲ │
//!        ● point                          irradiance = closed form × that share
//! ```
//!
//! Rays towards it have equal weight, unlike points spread over its area: of a sky that reaches to
//! the horizon, the few points right above have most of the weight.

use glam::DVec3;

use super::scene_rays::RAYS_PER_SHADOW_RAY;
use crate::gather::GatherPoint;
use crate::gather::light_tree::patch::Patch;
use crate::gather::visible::Visible;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::scene::Rgb;

/// A light seen from a point.
pub(super) struct WideLight<'a> {
    pub patch: &'a Patch,
    /// Unoccluded form factor from the point to all of it.
    unoccluded: f64,
    /// Inward normals of the pyramids from the point to its triangles.
    pyramids: Vec<[DVec3; 3]>,
}

impl<'a> WideLight<'a> {
    /// `patch`, which causes this `irradiance` at `point` if nothing is in the way; none unless
    /// rays over the hemisphere estimate its visible share better than points on it.
    pub fn new(
        patch: &'a Patch,
        irradiance: Rgb,
        point: &GatherPoint,
        min_rays: u32,
    ) -> Option<WideLight<'a>> {
        let unoccluded = irradiance.element_sum() / patch.exitance.element_sum();
        if !is_wide(patch, unoccluded, point, min_rays) {
            return None;
        }
        let pyramid = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner - point.position);
            let (ab, bc, ca) = (b.cross(a), c.cross(b), a.cross(c));
            // It emits nothing backwards.
            (a.dot(bc) > 0.0).then_some([ab, bc, ca])
        };
        let pyramids = patch.triangles.iter().filter_map(|t| pyramid(t.corners)).collect();
        Some(WideLight { patch, unoccluded, pyramids })
    }

    /// Whether this triangle of the scene is part of it.
    pub fn has(&self, triangle: usize) -> bool {
        self.patch.triangles.iter().any(|t| t.number as usize == triangle)
    }

    /// Whether the light, occluded or not, lies in a `direction` above the horizon.
    fn is_towards(&self, direction: DVec3) -> bool {
        let is_inside = |normals: &[DVec3; 3]| normals.iter().all(|n| n.dot(direction) >= 0.0);
        self.pyramids.iter().any(is_inside)
    }

    /// Counts a ray in a `direction` above the horizon in the `visible` sums: with the
    /// transmittance `passed` of panes, if it hits the light.
    pub fn add_ray(&self, direction: DVec3, passed: Option<Rgb>, visible: &mut Visible) {
        if passed.is_some() || self.is_towards(direction) {
            visible.all += 1.0;
        }
        visible.seen += passed.unwrap_or(Rgb::ZERO);
    }

    /// The form factor to the `visible` part, per channel.
    pub fn form_factor(&self, visible: &Visible) -> Rgb {
        visible.seen * visible.share_of(Some(self.unoccluded))
    }

    /// The irradiance of one ray where some arrive and some do not, W/m²: a length over the
    /// channels.
    pub fn of_one_ray(&self, visible: &Visible) -> f64 {
        match visible.is_partial() {
            true => self.patch.exitance.length() * visible.share_of(Some(self.unoccluded)),
            false => 0.0,
        }
    }

    /// Its irradiance for this `visible` part.
    pub fn irradiance(&self, visible: &Visible) -> Rgb {
        self.patch.exitance * self.form_factor(visible)
    }
}

/// Whether rays over the hemisphere estimate the visible share of `patch` from `point` better than
/// points on it, one per [`RAYS_PER_SHADOW_RAY`] of at least `min_rays` rays: whether more of them
/// go towards it than the effective number of such points. n points of weights w have the effective
/// number (Σ w)² / Σ w² (Kish 1965, section 11.7).
fn is_wide(patch: &Patch, unoccluded: f64, point: &GatherPoint, min_rays: u32) -> bool {
    // Of fewer than 8 expected rays there may be none: of independent ones with a probability
    // above e⁻⁸.
    if f64::from(min_rays) * unoccluded < 8.0 {
        return false;
    }
    let count = 32; // plain choice
    let weights = (0..count).map(|i| patch.factor(&patch.point(sobol_02_point(i)), point));
    let (sum, squares) = weights.fold((0.0, 0.0), |(sum, squares), w| (sum + w, squares + w * w));
    let worth = sum * sum / (squares * f64::from(count)).max(f64::MIN_POSITIVE);
    unoccluded * f64::from(RAYS_PER_SHADOW_RAY) > worth
}
