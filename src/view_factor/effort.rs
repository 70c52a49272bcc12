//! Predicts the time for an exact matrix from the blockers between random pairs.

use super::pair_visibility::FacingPair;
use super::partial_matrix::Method;
use super::scene_polygons::ScenePolygons;
use super::shaft::fully_occludes;
use crate::sampling::hash::split_mix64_nth;

/// The method for the matrix of `polygons`: exact unless that would take minutes or more.
pub(super) fn method(polygons: &ScenePolygons) -> Method {
    let ScenePolygons { fronts, blockers, .. } = polygons;
    let fronts = &fronts.polygons;
    // A property of one pair in a hundred is sampled 41 times, with a standard deviation of a
    // sixth. An unoccluded pair takes 2 µs, others some 100 µs a blocker, at most as many as are
    // counted here: 1e6 blockers take one to eight minutes of one core (measured).
    let (pairs, max_blockers, pair_cost, max_work) = (4096, 64, 0.02, 1e6);
    let count = fronts.len() as f64;
    let all_pairs = 0.5 * count * (count - 1.0);
    // Known before any pair is sampled.
    if all_pairs * max_blockers as f64 <= max_work {
        return Method::Exact;
    }
    let end = |bits: u64| &fronts[(bits % fronts.len() as u64) as usize];
    let work = |k: u64| {
        let bits = split_mix64_nth(k);
        let Some(pair) = FacingPair::new(end(bits >> 32), end(bits & u64::from(u32::MAX))) else {
            return 0.0;
        };
        let Some(between) = blockers.few_within(&pair.shaft(), max_blockers) else {
            return max_blockers as f64;
        };
        if between.iter().any(|blocker| fully_occludes(blocker, &pair.a, &pair.b)) {
            return pair_cost;
        }
        pair_cost + between.len() as f64
    };
    let work = (0..pairs).map(work).sum::<f64>() / pairs as f64 * all_pairs;
    if work > max_work { Method::Sparse } else { Method::Exact }
}
