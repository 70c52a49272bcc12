//! The exchange of an occluded pair from shadow rays: segments between points of both polygons.
//!
//! ```text
//! A₁F₁₂ ≈ U · Σ K V / Σ K      K = cos θ cos θ′ / r², V = 1 where nothing is in between
//! ```
//!
//! U, the unoccluded exchange, is known in closed form, so that only the visible share is random.

use super::matrix::Estimate;
use super::pair_visibility::FacingPair;
use super::polygon_points::{PolygonPoints, scrambled_point};
use glam::DVec3;

/// Number of rays for the standard error `tolerance` if half of them are blocked: U √(¼ / n).
pub(super) fn rays_needed(unoccluded: f64, tolerance: f64) -> f64 {
    (0.5 * unoccluded / tolerance).powi(2)
}

/// A₁F₁₂ of `pair` from `rays` shadow rays; `unoccluded` is the value without blockers.
pub(super) fn shadowed_exchange(
    pair: &FacingPair,
    unoccluded: f64,
    rays: u32,
    seed: u64,
    is_hidden: impl Fn(DVec3, DVec3) -> bool,
) -> Estimate {
    let (a, b) = (PolygonPoints::new(&pair.a), PolygonPoints::new(&pair.b));
    let (mut all, mut squares, mut visible) = (0.0, 0.0, 0.0);
    for k in 0..rays {
        let [u, v, x, y] = scrambled_point(k, seed);
        let (from, to) = (a.at(u, v), b.at(x, y));
        let ray = to - from;
        let cosines = pair.a_normal.dot(ray) * -pair.b_normal.dot(ray);
        let kernel = cosines.max(0.0) / ray.length_squared().powi(2);
        all += kernel;
        squares += kernel * kernel;
        if !is_hidden(from, to) {
            visible += kernel;
        }
    }
    if all == 0.0 {
        return Estimate::default();
    }
    let share = visible / all;
    // Number of rays of equal weight with the same variance (L. Kish 1965). Two more of each kind
    // keep the error estimate valid where nearly all agree: A. Agresti, B. A. Coull, "Approximate
    // is better than 'exact' for interval estimation of binomial proportions", 1998.
    let equal_rays = all * all / squares;
    let likely = (share * equal_rays + 2.0) / (equal_rays + 4.0);
    let error = (likely * (1.0 - likely) / equal_rays).sqrt();
    Estimate { value: unoccluded * share, error: unoccluded * error }
}
