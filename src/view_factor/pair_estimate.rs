//! The exchange of two polygons that rays have hit, by the cheapest method that is accurate enough.
//!
//! With U the unoccluded exchange in closed form, τ the requested standard error, and D the rays of
//! both polygons over their areas, the first line that applies:
//!
//! ```text
//! √(U / D) ≤ τ                     the count of rays over D
//! (U / 2τ)² is small               shadow rays
//! no blocker in the shaft          U
//! few blockers in it               points of one polygon: the visible part of the other, exactly
//! many, but rays have hit few      the same past these, less the hits hidden by other blockers
//! rays have hit many               sets of rays, until they agree
//! ```
//!
//! The choice depends on U, not on the count, so that it is not random. The other methods know a
//! pair only if a ray has hit it. So each half of the rays makes an estimate: the result of the
//! method if that half has hit the pair, else the count of the other half, which is unbiased for
//! any set of pairs that does not depend on it. Their mean is the exchange, and sums are unbiased:
//! nothing is assumed of the probability of a hit, which is larger for even sets of rays than for
//! independent ones.

use serde::{Deserialize, Serialize};

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::fronts::Fronts;
use super::matrix::Estimate;
use super::pair_visibility::FacingPair;
use super::point_visibility::PointVisibility;
use super::ray_rows::{Count, RayCaster, RayRow};
use super::shadow_rays::{rays_needed, shadowed_exchange};
use super::shaft::fully_occludes;
use super::visible_mean::{MIN_POINTS, visible_mean};
use crate::sampling::hash::split_mix64;
use crate::work;

/// Minimum number of shadow rays, tried before a shaft is built; with fewer their error would be
/// uncertain. Measured: 13 µs, where a shaft takes 8 µs.
const MIN_SHADOW_RAYS: u32 = 32;

/// Data for estimating the exchange of pairs.
pub(super) struct PairEstimator<'a> {
    pub fronts: &'a Fronts,
    pub blockers: &'a BlockerTree,
    pub caster: &'a RayCaster<'a>,
    /// One per front.
    pub rows: &'a [RayRow],
    /// Per front, the blockers known around it, ascending.
    pub known: &'a [&'a [u32]],
}

/// A pair whose exchange takes sets of rays: seconds, which all threads and processes share.
#[derive(Serialize, Deserialize)]
pub(super) struct PairOfSets {
    /// The smaller polygon, and the larger one.
    polygons: [u32; 2],
    hits: [u32; 2],
    density: f64,
    tolerance: f64,
}

impl PairEstimator<'_> {
    /// A₁F₁₂ of polygons `s` and `t`, of whose rays `hits` hit the other, by halves, with a
    /// standard error of about `tolerance`, in squares of the scene's unit; or what
    /// [`PairEstimator::by_sets`] needs for it.
    pub fn exchange(
        &self,
        [s, t]: [u32; 2],
        hits: [u32; 2],
        tolerance: f64,
        visibility: &mut PointVisibility,
    ) -> Result<Estimate, PairOfSets> {
        let Some(pair) = FacingPair::new(self.polygon(s), self.polygon(t)) else {
            return Ok(Estimate::default());
        };
        let unoccluded = pair.unoccluded();
        let density = self.ray_density(s) + self.ray_density(t);
        if unoccluded.value <= density * tolerance * tolerance {
            // For small counts, the root of the count itself covers the true value less than 19 of
            // 20 times.
            let hits = hits[0] + hits[1];
            let error = f64::from(hits + 1).sqrt() / density;
            return Ok(Estimate { value: f64::from(hits) / density, error });
        }
        match self.refined([s, t], pair, unoccluded, tolerance, visibility) {
            Some(refined) => Ok(with_missed(refined, hits, 0.5 * density)),
            None => {
                let polygons = if self.is_smaller(s, t) { [s, t] } else { [t, s] };
                Err(PairOfSets { polygons, hits, density, tolerance })
            }
        }
    }

    /// The same by sets of rays. All processes call it.
    pub fn by_sets(&self, pair: &PairOfSets) -> Estimate {
        let estimate = self.sets_of_rays(pair.polygons, pair.tolerance);
        with_missed(estimate, pair.hits, 0.5 * pair.density)
    }

    /// Whether polygon `s` is no larger than polygon `t`.
    fn is_smaller(&self, s: u32, t: u32) -> bool {
        self.polygon(s).area <= self.polygon(t).area
    }

    /// Rays of polygon `s` over its area.
    fn ray_density(&self, s: u32) -> f64 {
        f64::from(self.rows[s as usize].rays) / self.polygon(s).area
    }

    fn polygon(&self, s: u32) -> &ConvexPolygon {
        &self.fronts.polygons[s as usize]
    }

    /// The exchange of a pair for which counts are not accurate enough; none if it takes sets of
    /// rays.
    fn refined(
        &self,
        [s, t]: [u32; 2],
        pair: FacingPair,
        unoccluded: Estimate,
        tolerance: f64,
        visibility: &mut PointVisibility,
    ) -> Option<Estimate> {
        let seed = split_mix64(split_mix64(u64::from(s)) ^ u64::from(t));
        let shadow_rays = rays_needed(unoccluded.value, tolerance);
        let from_shadow_rays = |pair: &FacingPair| {
            let rays = (shadow_rays.ceil() as u32).max(MIN_SHADOW_RAYS);
            let is_hidden = |from, to| self.caster.is_hidden([s, t], from, to);
            shadowed_exchange(pair, unoccluded.value, rays, seed, is_hidden)
        };
        if shadow_rays <= f64::from(MIN_SHADOW_RAYS) {
            return Some(from_shadow_rays(&pair));
        }
        // Of more, those that rays hit are likely fewer. Plain choice, as is the number of rays.
        let Some(between) = self.blockers.few_within(&pair.shaft(), 64) else {
            return match shadow_rays <= 1000.0 {
                true => Some(from_shadow_rays(&pair)),
                false => self.past_known([s, t], pair, unoccluded, tolerance, seed, visibility),
            };
        };
        if between.is_empty() {
            return Some(unoccluded);
        }
        if between.iter().any(|blocker| fully_occludes(blocker, &pair.a, &pair.b)) {
            return Some(Estimate::default());
        }
        // In shadow rays of 0.4 µs: a point's view takes some 1 µs, and 0.25 µs a blocker, from
        // measured 10 to 16 µs with 40 to 70 blockers.
        let points_cost = 2.5 + 0.6 * between.len() as f64;
        if shadow_rays <= 2.0 * f64::from(MIN_POINTS) * points_cost {
            return Some(from_shadow_rays(&pair));
        }
        let pair = if pair.is_better_from_a(&between) { pair } else { pair.swapped() };
        Some(visible_mean(&pair, &between, unoccluded.value, tolerance, seed, visibility))
    }

    /// The exchange from the smaller polygon with the blockers that are known around it; none if
    /// these are many.
    fn past_known(
        &self,
        [s, t]: [u32; 2],
        pair: FacingPair,
        unoccluded: Estimate,
        tolerance: f64,
        seed: u64,
        visibility: &mut PointVisibility,
    ) -> Option<Estimate> {
        let is_first = self.is_smaller(s, t);
        let (small, large) = if is_first { (s, t) } else { (t, s) };
        let known = self.known[small as usize];
        let between = self.blockers.of_these_within(known, &pair.shaft());
        // With more, points cost more than rays. Plain choice.
        if between.len() > 256 {
            return None;
        }
        let past_known = if between.is_empty() {
            unoccluded
        } else {
            let pair = if is_first { pair } else { pair.swapped() };
            visible_mean(&pair, &between, unoccluded.value, tolerance, seed, visibility)
        };
        let row = &self.rows[small as usize];
        let hidden = rays_that_met(&row.hidden, large);
        // If the second half of the rays hit unknown blockers, assume one more hit.
        let likely = hidden + row.unknown.min(1);
        let per_ray = 2.0 / self.ray_density(small);
        Some(Estimate {
            value: (past_known.value - per_ray * f64::from(hidden)).max(0.0),
            error: libm::hypot(past_known.error, per_ray * f64::from(likely).sqrt()),
        })
    }

    /// The exchange from sets of rays, until their means agree.
    fn sets_of_rays(&self, [s, t]: [u32; 2], tolerance: f64) -> Estimate {
        let area = self.polygon(s).area;
        let mut means: Vec<f64> = vec![];
        loop {
            let more = means.len().max(16);
            let first = means.len();
            let seed = |k: usize| split_mix64((first + k) as u64);
            means.extend(work::map(more, |k| area * self.caster.share(s, t, 1 << 16, seed(k))));
            let count = means.len() as f64;
            let value = means.iter().sum::<f64>() / count;
            let squares: f64 = means.iter().map(|mean| (mean - value).powi(2)).sum();
            let error = (squares / (count * (count - 1.0))).sqrt();
            // Limits time, and the remaining error is reported.
            if error <= tolerance || means.len() >= 1 << 12 {
                return Estimate { value, error };
            }
        }
    }
}

/// The mean of the estimates of both halves of the rays, `density` per unit of area each, of which
/// `hits` hit the pair: `exchange` for a half with a hit, the count of the other for one without.
fn with_missed(exchange: Estimate, hits: [u32; 2], density: f64) -> Estimate {
    let by_half = |own: u32, other: u32| match own {
        0 => f64::from(other) / density,
        _ => exchange.value,
    };
    let value = 0.5 * (by_half(hits[0], hits[1]) + by_half(hits[1], hits[0]));
    // With V the exchange, and μ = density · V hits a half, a half misses with exp(−μ) if rays are
    // independent, more rarely if they are even. Then the mean is 0 if both miss, and half of V and
    // a count if one does: a variance of V² exp(−μ) (exp(−μ) + 1/μ) / 2.
    let missed = libm::exp(-density * exchange.value);
    let square = exchange.value * exchange.value;
    let of_chance = 0.5 * missed * (square * missed + exchange.value / density);
    Estimate { value, error: libm::hypot(exchange.error, of_chance.max(0.0).sqrt()) }
}

/// Number of rays of both halves that hit polygon `s`, by an ascending list.
fn rays_that_met(counts: &[Count], s: u32) -> u32 {
    let found = counts.binary_search_by_key(&s, |count| count.polygon);
    found.map_or(0, |k| counts[k].halves[0] + counts[k].halves[1])
}
