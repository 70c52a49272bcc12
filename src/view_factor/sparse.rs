//! Assembles a sparse matrix of many polygons: rays find the pairs that matter, and each of these
//! is estimated as cheaply as its error allows.
//!
//! ```text
//! each front:   first half of its rays ─→ blockers known around it
//!               second half            ─→ row: counts of the fronts met
//! each pair that a ray from either end has met:  see `pair_estimate`
//! ```
//!
//! Time grows with the number of polygons and of pairs that see one another, memory with the
//! latter.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::assembler::open_shares;
use super::fronts::Fronts;
use super::known_blockers::KnownBlockers;
use super::matrix::{Estimate, Factor, Missing, ViewFactors};
use super::pair_estimate::PairEstimator;
use super::point_visibility::PointVisibility;
use super::ray_rows::{Count, FirstHalf, RayCaster, RayRow, sum_of_counts};
use super::scene_polygons::ScenePolygons;
use crate::scene::Scene;

/// Standard errors are this share of the error asked for, so that 19 of 20 factors are within it.
const ERROR_SHARE: f64 = 0.5;

/// Rays of a polygon, times the error asked for: a factor as large as that is met by a few. Chosen
/// by hand; fewer leave more to shadow rays, more take longer themselves.
const RAYS_TIMES_ERROR: f64 = 1.6;

/// Rays of a polygon: at least, so that its half tells something; at most, to limit time.
const MIN_RAYS: f64 = 64.0;
const MAX_RAYS: f64 = (1 << 24) as f64;

/// Polygons between two tellings of progress. Chosen by hand.
const BATCH: usize = 256;

/// Pairs that one thread takes at a time. Chosen by hand.
const PAIRS_AT_A_TIME: usize = 64;

/// Rounds over all polygons: two of rays, one of pairs.
const ROUNDS: usize = 3;

/// What a polygon exchanges with a later one: A₁F₁₂, in squares of the scene's unit.
struct Exchange {
    to: u32,
    area: Estimate,
}

/// The matrix of `scene`, whose `polygons` these are; none if `progress` breaks.
pub(super) fn assemble(
    scene: &Scene,
    polygons: ScenePolygons,
    error: f64,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Option<ViewFactors> {
    let ScenePolygons { unit, fronts, blockers, blocker_of_triangle } = polygons;
    let caster = RayCaster::new(scene, unit, &fronts, blocker_of_triangle);
    let count = fronts.polygons.len();
    let rays = (RAYS_TIMES_ERROR / error).clamp(MIN_RAYS, MAX_RAYS) as u32;
    let rays = rays.next_power_of_two();
    let mut round = 0;
    let mut tell = |done: usize| {
        let flow = progress((round * count + done) / ROUNDS, count);
        round += usize::from(done == count);
        flow
    };
    let halves: Vec<FirstHalf> =
        in_batches((0..count).collect(), &mut tell, |s| caster.first_half(s as u32, rays))?;
    let of_fronts = caster.blockers_of_fronts();
    let known = KnownBlockers::new(&fronts, &blockers, &of_fronts, &halves);
    let halves = halves.into_iter().enumerate().collect();
    let rows: Vec<RayRow> = in_batches(halves, &mut tell, |(s, half)| {
        caster.row(s as u32, rays, half, known.around(s))
    })?;
    let known: Vec<&[u32]> = (0..count).map(|s| known.around(s)).collect();
    let (blockers, caster) = (&blockers, &caster);
    let (fronts, rows, known) = (&fronts, &rows, &known);
    let estimator = PairEstimator { fronts, blockers, caster, rows, known };
    let later = met_either_way(rows).into_iter().enumerate().collect();
    let exchanges = in_batches(later, &mut tell, |(s, later)| {
        exchanges_of(&estimator, s as u32, &later, error)
    })?;
    let backs = back_shares(fronts, rows);
    Some(into_matrix(scene, unit, fronts, exchanges, backs))
}

/// What `work` makes of all `items`, in parallel; none if `tell`, which is told how many are done,
/// breaks.
fn in_batches<T: Send, R: Send>(
    items: Vec<T>,
    tell: &mut impl FnMut(usize) -> ControlFlow<()>,
    work: impl Fn(T) -> R + Sync,
) -> Option<Vec<R>> {
    let mut results = Vec::with_capacity(items.len());
    let mut items = items.into_iter();
    while items.len() > 0 {
        let batch: Vec<T> = items.by_ref().take(BATCH).collect();
        results.par_extend(batch.into_par_iter().map(&work));
        if tell(results.len()).is_break() {
            return None;
        }
    }
    Some(results)
}

/// Per polygon the later ones that its rays have met, or whose rays have met it, with the rays of
/// both.
fn met_either_way(rows: &[RayRow]) -> Vec<Vec<Count>> {
    let mut met_by: Vec<Vec<Count>> = rows.iter().map(|_| vec![]).collect();
    for (t, row) in (0..).zip(rows) {
        for count in row.fronts.iter().take_while(|count| count.polygon < t) {
            met_by[count.polygon as usize].push(Count { polygon: t, rays: count.rays });
        }
    }
    let union = |(s, met_by): (u32, Vec<Count>)| {
        let own = &rows[s as usize].fronts;
        let later = own.partition_point(|count| count.polygon <= s);
        sum_of_counts(&own[later..], &met_by)
    };
    (0..).zip(met_by).map(union).collect()
}

/// What polygon `s` exchanges with `later` ones.
fn exchanges_of(estimator: &PairEstimator, s: u32, later: &[Count], error: f64) -> Vec<Exchange> {
    let fronts = estimator.fronts;
    let area_share = |s: u32| {
        let group_area = fronts.areas[fronts.group(s)];
        (fronts.polygons[s as usize].area / group_area, group_area)
    };
    let of_pairs = |counts: &[Count]| {
        let mut visibility = PointVisibility::default();
        let mut exchanges = Vec::with_capacity(counts.len());
        for &Count { polygon: t, rays } in counts {
            let ((share_s, area_s), (share_t, area_t)) = (area_share(s), area_share(t));
            // Errors of the pairs of two groups are independent: squares add up.
            let tolerance = ERROR_SHARE * error * area_s.min(area_t) * (share_s * share_t).sqrt();
            let area = estimator.exchange([s, t], rays, tolerance, &mut visibility);
            if area.value > 0.0 || area.error > 0.0 {
                exchanges.push(Exchange { to: t, area });
            }
        }
        exchanges
    };
    later.par_chunks(PAIRS_AT_A_TIME).flat_map_iter(of_pairs).collect()
}

/// Per group, the share of its flux that meets backs, by counts of rays.
fn back_shares(fronts: &Fronts, rows: &[RayRow]) -> Vec<Estimate> {
    let mut backs = vec![Estimate::default(); fronts.areas.len()];
    for (s, row) in (0..).zip(rows) {
        let group = fronts.group(s);
        let per_ray = fronts.polygons[s as usize].area / fronts.areas[group] / f64::from(row.rays);
        let error = per_ray * f64::from(row.back + 1).sqrt();
        backs[group].value += per_ray * f64::from(row.back);
        backs[group].error = backs[group].error.hypot(error);
    }
    backs
}

/// Sums over groups, both ways.
fn into_matrix(
    scene: &Scene,
    unit: f64,
    fronts: &Fronts,
    exchanges: Vec<Vec<Exchange>>,
    back: Vec<Estimate>,
) -> ViewFactors {
    let areas = &fronts.areas;
    let mut factors: Vec<Vec<Factor>> = areas.iter().map(|_| vec![]).collect();
    let mut exchanges = exchanges.into_iter().enumerate().peekable();
    for i in 0..areas.len() {
        // Of all polygons of group i: by group, value and squared error.
        let mut sums: Vec<(u32, f64, f64)> = vec![];
        while let Some((_, of_polygon)) = exchanges.next_if(|(s, _)| fronts.group(*s as u32) == i) {
            for Exchange { to, area } in of_polygon {
                let j = fronts.group(to);
                // Pairs within a group are met once and count both ways.
                let ways = if i == j { 2.0 } else { 1.0 };
                sums.push((j as u32, ways * area.value, (ways * area.error).powi(2)));
            }
        }
        sums.sort_by_key(|(j, ..)| *j);
        for of_group in sums.chunk_by(|a, b| a.0 == b.0) {
            let to = of_group[0].0;
            let value = of_group.iter().map(|(_, value, _)| value).sum();
            let error = of_group.iter().map(|(.., square)| square).sum::<f64>().sqrt();
            let mut push = |from: usize, to: u32| {
                let Estimate { value, error } = Estimate { value, error }.over(areas[from]);
                factors[from].push(Factor { to, value, error });
            };
            push(i, to);
            if to as usize != i {
                push(to as usize, i as u32);
            }
        }
    }
    let open = open_shares(&factors, &back, areas);
    let names = scene.groups().to_vec();
    let areas = areas.iter().map(|area| area * unit * unit).collect();
    ViewFactors { names, areas, factors, open, back, absent: Missing::Unmet }
}
