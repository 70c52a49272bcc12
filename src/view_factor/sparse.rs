//! Assembles a sparse matrix of many polygons: rays find the pairs that matter, and each of these
//! is estimated by the cheapest method that its error allows.
//!
//! ```text
//! each front:   first half of its rays ─→ blockers known around it
//!               second half            ─→ row: counts of the fronts hit
//! each pair that a ray from either end has hit:  see `pair_estimate`
//! ```
//!
//! Time grows with the number of polygons and of pairs that see one another, memory with the
//! latter.

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::fronts::Fronts;
use super::known_blockers::KnownBlockers;
use super::matrix::{Estimate, MatrixSize};
use super::pair_estimate::{PairEstimator, PairOfSets};
use super::partial_matrix::{Exchange, Making, PolygonRow};
use super::point_visibility::PointVisibility;
use super::ray_rows::{Count, FirstHalf, RayCaster, RayRow, sum_of_counts};
use super::scene_polygons::ScenePolygons;
use crate::scene::Scene;
use crate::work::Batches;

/// Polygons of the first batch. Plain choice.
const BATCH: usize = 32;

/// Pairs of a row that are estimated by one thread, one after the other. Plain choice.
const PAIRS_OF_PIECE: usize = 64;

/// Approximate size of a matrix, by the rays of some polygons: an overestimate where groups have
/// many polygons.
pub(super) fn predicted_size(scene: &Scene, polygons: ScenePolygons, error: f64) -> MatrixSize {
    let ScenePolygons { unit, fronts, blocker_of_triangle, .. } = polygons;
    let caster = RayCaster::new(scene, unit, &fronts, blocker_of_triangle);
    let count = fronts.polygons.len();
    // A pair exists if rays of either hit the other: equivalent to twice the rays from one.
    let first_half = 4 * rays_a_polygon(error);
    // Some seconds of rays.
    let drawn = ((1 << 24) / first_half as usize).clamp(16, 256).min(count);
    let met = |k: usize| {
        let s = k * count / drawn;
        caster.first_half(s as u32, first_half).fronts.len()
    };
    let met: usize = (0..drawn).into_par_iter().map(met).sum();
    let factors = (met as f64 / drawn.max(1) as f64 * count as f64).ceil() as usize;
    // Rows and matrix. Measured: 45 and 50 bytes with 2 and 15 million factors.
    MatrixSize { factors, bytes: 55 * factors }
}

fn rays_a_polygon(error: f64) -> u32 {
    // A factor equal to the error is hit by a few rays. Fewer leave more to shadow rays, more take
    // longer themselves. Half of 64 are significant; 2²⁴ limit the time. Plain choice.
    let rays = (1.6 / error).clamp(64.0, f64::from(1 << 24)) as u32;
    rays.next_power_of_two()
}

/// Computes the rows of the polygons `wanted` of `scene`; `None` if stopped.
pub(super) fn make(
    scene: &Scene,
    polygons: ScenePolygons,
    error: f64,
    wanted: &[u32],
    making: &mut Making,
) -> Option<()> {
    let ScenePolygons { unit, fronts, blockers, blocker_of_triangle } = polygons;
    let caster = RayCaster::new(scene, unit, &fronts, blocker_of_triangle);
    let count = fronts.polygons.len();
    let rays = rays_a_polygon(error);
    let all: Vec<u32> = (0..count as u32).collect();
    // Two passes of rays over all polygons, and one of pairs.
    let of = 2 * count + wanted.len();
    let halves: Vec<FirstHalf> = in_batches(&all, making, 0..of, |&s| caster.first_half(s, rays))?;
    let of_fronts = caster.blockers_of_fronts();
    let known = KnownBlockers::new(&fronts, &blockers, &of_fronts, &halves);
    let mut rows: Vec<RayRow> = in_batches(&all, making, count..of, |&s| {
        caster.row(s, rays, &halves[s as usize], known.around(s as usize))
    })?;
    drop(halves);
    let known: Vec<&[u32]> = (0..count).map(|s| known.around(s)).collect();
    let (blockers, caster) = (&blockers, &caster);
    let later = met_either_way(&mut rows);
    let (fronts, rows, known) = (&fronts, &rows, &known);
    let estimator = PairEstimator { fronts, blockers, caster, rows, known };
    // The number of pairs of polygons varies by a factor of a thousand.
    let pieces_of = |&s: &u32| later[s as usize].chunks(PAIRS_OF_PIECE).map(move |c| (s, c));
    let pieces: Vec<(u32, &[Count])> = wanted.iter().flat_map(pieces_of).collect();
    making.rows_of_pieces(
        wanted,
        &pieces,
        |done| ((2 * count + done) * count / of, count),
        |s, later| exchanges_of(&estimator, s, later, error),
        |s, pieces| {
            let exchanges = pieces.into_iter().flat_map(|piece| completed(&estimator, piece));
            PolygonRow {
                fronts: sums_by_group(exchanges.collect()),
                back: to_backs(fronts, &rows[s as usize], s),
            }
        },
    )
}

/// Exchanges of a polygon with others, those by sets of rays as `None`, and these in their order:
/// with the group, and the pair.
type Piece = (Vec<Option<Exchange>>, Vec<(u32, PairOfSets)>);

/// The exchanges of a piece. All processes call it.
fn completed(estimator: &PairEstimator, (exchanges, by_sets): Piece) -> Vec<Exchange> {
    let mut by_sets = by_sets.into_iter();
    let exchange = |done: Option<Exchange>| match done {
        Some(exchange) => Some(exchange),
        None => {
            let (group, pair) = by_sets.next()?;
            nonzero(group, estimator.by_sets(&pair))
        }
    };
    exchanges.into_iter().filter_map(exchange).collect()
}

/// An exchange with a group, unless it is certainly zero.
fn nonzero(group: u32, area: Estimate) -> Option<Exchange> {
    (area.value > 0.0 || area.error > 0.0).then(|| Exchange::new(group, area))
}

/// The results of `work` for all `items`, in parallel; `None` if stopped. `told` is the range of
/// progress: items done before, and the total.
fn in_batches<R: Send + Sync + Serialize + DeserializeOwned>(
    items: &[u32],
    making: &mut Making,
    told: Range<usize>,
    work: impl Fn(&u32) -> R + Sync,
) -> Option<Vec<R>> {
    let mut results = Vec::with_capacity(items.len());
    let mut remaining = items;
    // A polygon is done by one thread.
    let mut batches = Batches::new(BATCH).at_least(2 * rayon::current_num_threads());
    while !remaining.is_empty() {
        let (_, made) =
            batches.next(&mut remaining, |batch| batch.par_iter().map(&work).collect::<Vec<R>>());
        results.extend(made);
        let count = items.len();
        making.report((told.start + results.len()) * count / told.end, count)?;
    }
    Some(results)
}

/// Sums exchanges with polygons, in ascending order of their groups, to one exchange per group.
fn sums_by_group(exchanges: Vec<Exchange>) -> Vec<Exchange> {
    let groups = exchanges.chunk_by(|a, b| a.to == b.to);
    let sum = |of_group: &[Exchange]| {
        let exchanges = of_group.iter().map(Exchange::estimate);
        Exchange::new(of_group[0].to, Estimate::sum(exchanges))
    };
    let mut sums: Vec<Exchange> = groups.map(sum).collect();
    sums.shrink_to_fit();
    sums
}

/// Per polygon the later ones that its rays have hit, or whose rays have hit it, with the sum of
/// the rays of both. Takes the fronts out of `rows`.
fn met_either_way(rows: &mut [RayRow]) -> Vec<Vec<Count>> {
    let mut met_by: Vec<Vec<Count>> = rows.iter().map(|_| vec![]).collect();
    for (t, row) in (0..).zip(rows.iter()) {
        for count in row.fronts.iter().take_while(|count| count.polygon < t) {
            met_by[count.polygon as usize].push(Count { polygon: t, halves: count.halves });
        }
    }
    let union = |((s, met_by), row): ((u32, Vec<Count>), &mut RayRow)| {
        let own = std::mem::take(&mut row.fronts);
        let later = own.partition_point(|count| count.polygon <= s);
        sum_of_counts(&own[later..], &met_by)
    };
    (0..).zip(met_by).zip(rows).map(union).collect()
}

/// The exchanges of polygon `s` with `later` ones, each labelled with the other's group.
fn exchanges_of(estimator: &PairEstimator, s: u32, later: &[Count], error: f64) -> Piece {
    let fronts = estimator.fronts;
    let area_share = |s: u32| {
        let group_area = fronts.areas[fronts.group(s)];
        (fronts.polygons[s as usize].area / group_area, group_area)
    };
    let mut visibility = PointVisibility::default();
    let (mut exchanges, mut by_sets) = (Vec::with_capacity(later.len()), vec![]);
    for &Count { polygon: t, halves } in later {
        let ((share_s, area_s), (share_t, area_t)) = (area_share(s), area_share(t));
        // Errors of the pairs of two groups are independent: squares add up.
        let tolerance = 0.5 * error * area_s.min(area_t) * (share_s * share_t).sqrt();
        let group = fronts.group(t) as u32;
        match estimator.exchange([s, t], halves, tolerance, &mut visibility) {
            Ok(area) => exchanges.extend(nonzero(group, area).map(Some)),
            Err(pair) => {
                exchanges.push(None);
                by_sets.push((group, pair));
            }
        }
    }
    (exchanges, by_sets)
}

/// The exchange of polygon `s` with backs, by counts of its rays.
fn to_backs(fronts: &Fronts, row: &RayRow, s: u32) -> Exchange {
    let per_ray = fronts.polygons[s as usize].area / f64::from(row.rays);
    let value = per_ray * f64::from(row.back);
    Exchange::new(0, Estimate { value, error: per_ray * f64::from(row.back + 1).sqrt() })
}
