//! Predicts the time of an exact matrix from cubature of random pairs.
//!
//! Few pairs may take most of the time, such as those with the ground of a city, and neither their
//! blockers nor their sizes tell which: their cells do. Cells and blockers are counted, since
//! measured time would differ from run to run.

use super::assembler::BOUND_SHARE;
use super::cubature::{MAX_CELLS, integrate_adaptively};
use super::pair_visibility::{FacingPair, PairVisibility};
use super::partial_matrix::Method;
use super::point_visibility::PointVisibility;
use super::scene_polygons::ScenePolygons;
use crate::sampling::hash::split_mix64_nth;

/// Maximum number of random pairs. What one pair in a hundred has is met 41 times, with a standard
/// deviation of a sixth.
const MAX_PAIRS: f64 = 4096.0;

/// Share of all pairs that are sampled at most, so that the prediction takes as little of the time.
const MAX_SHARE: f64 = 1.0 / 64.0;

/// Time of one core that an exact matrix may take, µs. Plain choice.
const MAX_TIME: f64 = 1e8;

/// Time of a shaft and of a closed form, µs. Measured: 6 in a room of plates, 40 in a sphere.
const PAIR_TIME: f64 = 20.0;

/// Time of an occluded pair for each of its blockers, up to 64, µs: measured with the default error
/// in cities of even houses. Cells may predict more, never less: sparse factors take seconds where
/// exact ones of a loose error still take a minute.
const OCCLUDED_TIME: f64 = 100.0;

/// Time of a cell without blockers, µs: seven points of 1 µs and a shaft of 8 µs, and as much for a
/// cell that was cut. Measured.
const CELL_TIME: f64 = 30.0;

/// Time of a blocker before a cell, µs: 0.25 µs for each of seven points and the clipping, and as
/// much for a cell that was cut. Measured.
const BLOCKER_TIME: f64 = 5.0;

/// The method for the matrix of `polygons` to an absolute `error`: exact unless that would take
/// minutes or more.
pub(super) fn method(polygons: &ScenePolygons, error: f64) -> Method {
    let count = polygons.fronts.polygons.len() as f64;
    let all_pairs = 0.5 * count * (count - 1.0);
    let sampled = (MAX_SHARE * all_pairs).min(MAX_PAIRS).floor();
    // What is left of the time for the sample.
    let mut left = MAX_TIME * sampled / all_pairs;
    let mut visibility = PointVisibility::default();
    for k in 0..sampled as u64 {
        left -= pair_time(polygons, error, split_mix64_nth(k), left, &mut visibility);
        if left < 0.0 {
            return Method::Sparse;
        }
    }
    Method::Exact
}

/// Time of the random pair of these `bits`, µs; if it is more than `left`, any number above that.
fn pair_time(
    polygons: &ScenePolygons,
    error: f64,
    bits: u64,
    left: f64,
    visibility: &mut PointVisibility,
) -> f64 {
    let ScenePolygons { fronts, blockers, .. } = polygons;
    let end = |bits: u64| &fronts.polygons[(bits % fronts.polygons.len() as u64) as usize];
    let (s, t) = (end(bits >> 32), end(bits & u64::from(u32::MAX)));
    let Some(pair) = FacingPair::new(s, t) else { return 0.0 };
    let Some(between) = blockers.few_within(&pair.shaft(), (left / BLOCKER_TIME) as usize) else {
        return f64::INFINITY;
    };
    let by_blockers = OCCLUDED_TIME * between.len().min(64) as f64;
    if by_blockers > left {
        return by_blockers;
    }
    let pair = match PairVisibility::between(s, t, blockers, visibility, bits) {
        PairVisibility::Occluded(pair) => *pair,
        _ => return PAIR_TIME,
    };
    let [area_s, area_t] = [s, t].map(|polygon| fronts.areas[polygon.group as usize]);
    // Errors of the pairs of two groups are independent: squares add up.
    let share = (s.area / area_s * t.area / area_t).sqrt();
    let tolerance = BOUND_SHARE * error * area_s.min(area_t) * share;
    let max_cells = MAX_CELLS.min((left / CELL_TIME) as usize + 1);
    let mut pairs = [pair];
    integrate_adaptively(&mut pairs, tolerance, max_cells, visibility);
    let [blockers, cells] = pairs[0].blockers_and_cells().map(|count| count as f64);
    PAIR_TIME + (CELL_TIME * cells + BLOCKER_TIME * blockers).max(by_blockers)
}
