//! Predicts the time for an exact matrix from the blockers between random pairs.

use super::pair_visibility::FacingPair;
use super::scene_polygons::ScenePolygons;
use super::shaft::fully_occludes;
use crate::sampling::hash::split_mix64_nth;

/// Number of sampled pairs. Plain choice: a property of one pair in a hundred is sampled 41 times,
/// with a standard deviation of a sixth.
const PAIRS: u64 = 4096;

/// Maximum number of blockers counted per pair; the cost of a pair is capped there.
const MAX_BLOCKERS: usize = 64;

/// Cost of an unoccluded pair, in blockers of other pairs. Measured: 2 µs against some 100 µs.
const PAIR_COST: f64 = 0.02;

/// Number of blockers between all pairs above which an exact matrix takes too long: measured 45 to
/// 500 µs each, so one to eight minutes of one core. Plain choice.
const MAX_EXACT_WORK: f64 = 1e6;

/// Whether the exact matrix of `polygons` would take minutes or more.
pub(super) fn is_exact_too_long(polygons: &ScenePolygons) -> bool {
    let ScenePolygons { fronts, blockers, .. } = polygons;
    let fronts = &fronts.polygons;
    let count = fronts.len() as f64;
    let all_pairs = 0.5 * count * (count - 1.0);
    // Known before any pair is sampled.
    if all_pairs * MAX_BLOCKERS as f64 <= MAX_EXACT_WORK {
        return false;
    }
    let end = |bits: u64| &fronts[(bits % fronts.len() as u64) as usize];
    let work = |k: u64| {
        let bits = split_mix64_nth(k);
        let Some(pair) = FacingPair::new(end(bits >> 32), end(bits & u64::from(u32::MAX))) else {
            return 0.0;
        };
        let Some(between) = blockers.few_within(&pair.shaft(), MAX_BLOCKERS) else {
            return MAX_BLOCKERS as f64;
        };
        if between.iter().any(|blocker| fully_occludes(blocker, &pair.a, &pair.b)) {
            return PAIR_COST;
        }
        PAIR_COST + between.len() as f64
    };
    (0..PAIRS).map(work).sum::<f64>() / PAIRS as f64 * all_pairs > MAX_EXACT_WORK
}
