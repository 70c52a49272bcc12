//! The exchange of an occluded pair as a mean over points of one polygon.
//!
//! ```text
//!     target            from each point: the visible part of the target, exactly
//!    ────────           (see `point_visibility`)
//!      ▬▬   blockers
//!   •  •  •  •          points: low-discrepancy sets, each scrambled by itself; how far their
//!    domain             means differ is the error
//! ```
//!
//! The mean is taken of the visible share, and the whole is known in closed form: what varies from
//! point to point because the target is nearer to some costs nothing.
//!
//! Much cheaper than adaptive cubature where the error asked for is not far below what a few
//! hundred points give.

use glam::DVec3;

use super::matrix::Estimate;
use super::pair_visibility::FacingPair;
use super::point_visibility::{PointFactors, PointVisibility};
use super::polygon_points::{PolygonPoints, scrambled_point};
use super::shaft::Blocker;
use crate::sampling::hash::split_mix64;

/// Sets of points, each scrambled by itself.
const SETS: usize = 8;

/// Two standard errors of a mean of eight hold the truth 19 of 20 times if they are this much
/// larger than those of many: Student's t for 7 degrees of freedom and 95 %, over 2.
const STUDENT_FACTOR: f64 = 2.365 / 2.0;

/// Points of a set at first, and at most: limits time, and the error that is left is told. Chosen
/// by hand.
const FIRST_POINTS: u32 = 4;
const MAX_POINTS: u32 = 512;

/// Visible shares this near to one another, to nothing, or to all, are the same: above rounding.
const NOTHING_SHARE: f64 = 1e-9;

/// Points that a pair takes at least.
pub(super) const MIN_POINTS: u32 = SETS as u32 * FIRST_POINTS;

/// A₁F₁₂ of `pair` past all that is `between`, from points of its first polygon, with a standard
/// error of `tolerance` if [`MAX_POINTS`] do; `unoccluded` with nothing between.
pub(super) fn visible_mean(
    pair: &FacingPair,
    between: &[Blocker],
    unoccluded: f64,
    tolerance: f64,
    seed: u64,
    visibility: &mut PointVisibility,
) -> Estimate {
    let between = nearest_first(between, &pair.a);
    let points = PolygonPoints::new(&pair.a);
    let mut sums = Sums::default();
    let (mut done, mut count) = (0, FIRST_POINTS);
    loop {
        for set in 0..SETS {
            for k in done..count {
                let [u, v, ..] = scrambled_point(k, split_mix64(seed ^ set as u64));
                let point = points.at(u, v);
                let factors =
                    visibility.factors(point, pair.a_normal, &pair.b, pair.b_normal, &between);
                sums.add(set, factors);
            }
        }
        let share = sums.share(count);
        let mean = Estimate { value: unoccluded * share.value, error: unoccluded * share.error };
        if mean.error <= tolerance || count >= MAX_POINTS {
            return mean;
        }
        (done, count) = (count, 2 * count);
    }
}

/// Sums over the points of each set.
#[derive(Default)]
struct Sums {
    visible: [f64; SETS],
    unoccluded: [f64; SETS],
    /// Of all points, the one that sees the smallest share, and the largest.
    shares: Option<[f64; 2]>,
}

impl Sums {
    fn add(&mut self, set: usize, factors: PointFactors) {
        self.visible[set] += factors.visible;
        self.unoccluded[set] += factors.unoccluded;
        if factors.unoccluded > 0.0 {
            let share = factors.visible / factors.unoccluded;
            let [low, high] = self.shares.unwrap_or([share; 2]);
            self.shares = Some([low.min(share), high.max(share)]);
        }
    }

    /// The visible share, `count` points a set, and its standard error.
    fn share(&self, count: u32) -> Estimate {
        let whole = self.unoccluded.iter().sum::<f64>();
        let Some([low, high]) = self.shares else { return Estimate::default() };
        let value = self.visible.iter().sum::<f64>() / whole;
        let deviation =
            |set: usize| (self.visible[set] - value * self.unoccluded[set]) / (whole / SETS as f64);
        let squares: f64 = (0..SETS).map(|set| deviation(set).powi(2)).sum();
        let of_sets = STUDENT_FACTOR * (squares / (SETS * (SETS - 1)) as f64).sqrt();
        // A spot that no point has met is likely no larger than what one point stands for, and sees
        // what others see; or the contrary, where all see all or nothing.
        let points = f64::from(count) * SETS as f64;
        let range = high - low;
        let unmet =
            match range < NOTHING_SHARE && (low < NOTHING_SHARE || high > 1.0 - NOTHING_SHARE) {
                true => 2.0 / points,
                false => 0.5 * range / points,
            };
        Estimate { value, error: of_sets.hypot(unmet) }
    }
}

/// Blockers in the order of their distances from the middle of a polygon: near ones hide the most,
/// and what is gone is not cut again.
fn nearest_first(blockers: &[Blocker], polygon: &[DVec3]) -> Vec<Blocker> {
    let middle = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let square = |blocker: &Blocker| {
        let squares = blocker.corners.iter().map(|p| p.distance_squared(middle));
        squares.fold(f64::INFINITY, f64::min)
    };
    let mut order: Vec<(f64, &Blocker)> = blockers.iter().map(|b| (square(b), b)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    order.into_iter().map(|(_, blocker)| blocker.clone()).collect()
}
