//! Assembles an exact matrix: all pairs of convex polygons, each met once, summed over groups.
//!
//! ```text
//! scene ─→ fronts: polygons that give and receive, in the order of groups
//!      ├─→ backs: what of the backs of polygons can be met
//!      └─→ blockers: polygons of any group, in a tree
//!
//! for each front s:   for each group of later fronts, and for all backs:
//!                         sum of pairs in full view + adaptive cubature of occluded pairs
//! ```
//!
//! Later fronts only: A_i F_ij = A_j F_ji gives the other half. The tolerance of a group's error is
//! shared between the polygons of the giving group by area, in squares.

use std::collections::BTreeMap;
use std::ops::ControlFlow;

use rayon::prelude::*;

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::cubature::integrate_adaptively;
use super::matrix::{Estimate, Factor, Missing, ViewFactors};
use super::pair_visibility::PairVisibility;
use super::point_visibility::PointVisibility;
use super::scene_polygons::ScenePolygons;
use crate::sampling::hash::split_mix64;
use crate::scene::Scene;

/// Share of the error asked for to which the error bound of every sum is brought. Its estimate is
/// brought to a tenth of that again: rows of thousands of factors then close to a tenth of what was
/// asked.
const BOUND_SHARE: f64 = 0.1;

/// Times that progress is told of a large scene. Chosen by hand.
const PROGRESS_CALLS: usize = 100;

/// Fewest polygons between two tellings of progress, so that all cores have work. Chosen by hand.
const MIN_BATCH: usize = 4;

/// Most polygons between two tellings of progress, so that cancelling is heard. Chosen by hand.
const MAX_BATCH: usize = 64;

/// The exact matrix of `scene`, whose `polygons` these are; none if `progress` breaks.
pub(super) fn assemble(
    scene: &Scene,
    polygons: ScenePolygons,
    error: f64,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Option<ViewFactors> {
    let unit = polygons.unit;
    let assembler = Assembler::new(polygons, error);
    let mut sums = GroupSums::new(scene.groups().len());
    let count = assembler.fronts.len();
    let batch = (count / PROGRESS_CALLS).clamp(MIN_BATCH, MAX_BATCH);
    for start in (0..count).step_by(batch) {
        let end = (start + batch).min(count);
        let rows: Vec<_> = (start..end).into_par_iter().map(|s| assembler.row(s)).collect();
        for (s, row) in (start..end).zip(rows) {
            sums.add(assembler.fronts[s].group as usize, row);
        }
        if progress(end, count).is_break() {
            return None;
        }
    }
    Some(sums.into_matrix(scene, &assembler.areas, unit))
}

/// All that it takes to find what one polygon gives to others.
pub(super) struct Assembler {
    /// Polygons that give and receive, by group.
    fronts: Vec<ConvexPolygon>,
    /// What of the backs of polygons can be met.
    backs: Vec<ConvexPolygon>,
    blockers: BlockerTree,
    /// Radiating area of each group, in squares of the scene's unit.
    areas: Vec<f64>,
    /// Absolute error asked of every factor.
    error: f64,
}

/// A₁F₁₂ from one polygon to later polygons of its own group and to later groups.
struct PolygonRow {
    /// By ascending group, no zeros.
    fronts: Vec<(u32, Estimate)>,
    /// To the backs of all groups together.
    back: Estimate,
}

impl Assembler {
    /// Of `polygons`, with an absolute error of every factor well below `error`.
    pub fn new(polygons: ScenePolygons, error: f64) -> Assembler {
        let ScenePolygons { fronts, blockers, .. } = polygons;
        let backs = blockers.backs(&BlockerTree::new(fronts.polygons.clone()));
        Assembler { fronts: fronts.polygons, backs, blockers, areas: fronts.areas, error }
    }

    /// What polygon `s` gives to later ones and to backs.
    fn row(&self, s: usize) -> PolygonRow {
        let mut visibility = PointVisibility::default();
        let from = &self.fronts[s];
        let mut fronts: Vec<(u32, Estimate)> = Vec::new();
        let group_area = self.areas[from.group as usize];
        // Errors of the polygons of a group are independent: squares add up.
        let share = BOUND_SHARE * self.error * (from.area / group_area).sqrt();
        let mut t = s + 1;
        for group in self.fronts[s + 1..].chunk_by(|a, b| a.group == b.group) {
            let to = group[0].group;
            let receivers = group.iter().zip(t..);
            t += group.len();
            let tolerance = share * group_area.min(self.areas[to as usize]);
            let flux = self.flux(s, receivers, tolerance, &mut visibility);
            if flux.value > 0.0 || flux.error > 0.0 {
                fronts.push((to, flux));
            }
        }
        let receivers = self.backs.iter().zip(self.fronts.len()..);
        let back = self.flux(s, receivers, share * group_area, &mut visibility);
        PolygonRow { fronts, back }
    }

    /// The factors of `group` to all groups, by ascending index, no zeros.
    pub fn whole_row(&self, group: usize) -> Vec<Factor> {
        let polygons = |group| {
            let start = self.fronts.partition_point(|p| (p.group as usize) < group);
            let count = self.fronts[start..].partition_point(|p| p.group as usize == group);
            start..start + count
        };
        let to_group = |to: usize| {
            let mut sum = EstimateSum::default();
            let mut visibility = PointVisibility::default();
            for s in polygons(group) {
                let from = &self.fronts[s];
                let share = BOUND_SHARE * self.error * (from.area / self.areas[group]).sqrt();
                let tolerance = share * self.areas[group].min(self.areas[to]);
                let receivers = polygons(to).filter(|t| *t != s);
                let receivers = receivers.map(|t| (&self.fronts[t], t));
                sum.add(self.flux(s, receivers, tolerance, &mut visibility), 1.0);
            }
            let Estimate { value, error } = sum.over(self.areas[group]);
            Factor { to: to as u32, value, error }
        };
        let all = (0..self.areas.len()).into_par_iter().map(to_group);
        all.filter(|factor| factor.value > 0.0 || factor.error > 0.0).collect()
    }

    /// A₁F₁₂ from polygon `s` to all of `receivers`, numbered.
    fn flux<'b>(
        &self,
        s: usize,
        receivers: impl Iterator<Item = (&'b ConvexPolygon, usize)>,
        tolerance: f64,
        visibility: &mut PointVisibility,
    ) -> Estimate {
        let from = &self.fronts[s];
        let mut unoccluded = Estimate::default();
        let mut occluded_pairs = Vec::new();
        for (to, t) in receivers {
            let seed = split_mix64(split_mix64(s as u64) ^ t as u64);
            match PairVisibility::between(from, to, &self.blockers, visibility, seed) {
                PairVisibility::Hidden => {}
                PairVisibility::Unoccluded(flux) => {
                    unoccluded.value += flux.value;
                    unoccluded.error += flux.error;
                }
                PairVisibility::Occluded(pair) => occluded_pairs.push(*pair),
            }
        }
        let occluded = integrate_adaptively(&mut occluded_pairs, tolerance, visibility);
        Estimate {
            value: unoccluded.value + occluded.value,
            error: unoccluded.error.hypot(occluded.error),
        }
    }
}

/// A sum of independent estimates.
#[derive(Clone, Copy, Default)]
struct EstimateSum {
    value: f64,
    squared_error: f64,
}

impl EstimateSum {
    fn add(&mut self, term: Estimate, factor: f64) {
        self.value += factor * term.value;
        self.squared_error += (factor * term.error).powi(2);
    }

    /// The sum divided by `area`.
    fn over(self, area: f64) -> Estimate {
        Estimate { value: self.value, error: self.squared_error.sqrt() }.over(area)
    }
}

/// Sums of A_i F_ij over the polygons of groups, in squares of the scene's unit.
struct GroupSums {
    /// Per group, to itself and to later groups.
    fronts: Vec<BTreeMap<u32, EstimateSum>>,
    /// Per group, to all backs.
    backs: Vec<EstimateSum>,
}

impl GroupSums {
    /// Sums of nothing for so many groups.
    fn new(groups: usize) -> GroupSums {
        GroupSums {
            fronts: vec![BTreeMap::new(); groups],
            backs: vec![EstimateSum::default(); groups],
        }
    }

    /// Adds what a polygon of group `from` gives.
    fn add(&mut self, from: usize, row: PolygonRow) {
        for (to, flux) in row.fronts {
            // Pairs within a group are met once and count both ways.
            let factor = if to as usize == from { 2.0 } else { 1.0 };
            self.fronts[from].entry(to).or_default().add(flux, factor);
        }
        self.backs[from].add(row.back, 1.0);
    }

    /// The matrix, of `areas` in squares of `unit`.
    fn into_matrix(self, scene: &Scene, areas: &[f64], unit: f64) -> ViewFactors {
        let mut factors: Vec<Vec<Factor>> = vec![Vec::new(); areas.len()];
        for (i, row) in self.fronts.iter().enumerate() {
            for (&to, &sum) in row {
                let Estimate { value, error } = sum.over(areas[i]);
                factors[i].push(Factor { to, value, error });
                if to as usize != i {
                    let Estimate { value, error } = sum.over(areas[to as usize]);
                    factors[to as usize].push(Factor { to: i as u32, value, error });
                }
            }
        }
        for row in &mut factors {
            row.sort_by_key(|factor| factor.to);
        }
        let backs = self.backs.iter().zip(areas);
        let back: Vec<Estimate> = backs.map(|(&sum, &area)| sum.over(area)).collect();
        let areas: Vec<f64> = areas.iter().map(|area| area * unit * unit).collect();
        let open = open_shares(&factors, &back, &areas);
        let names = scene.groups().to_vec();
        ViewFactors { names, areas, factors, open, back, absent: Missing::Zero }
    }
}

/// What is left of each row when all that arrives anywhere is taken off.
pub(super) fn open_shares(
    factors: &[Vec<Factor>],
    back: &[Estimate],
    areas: &[f64],
) -> Vec<Estimate> {
    let mut open = Vec::with_capacity(areas.len());
    for ((row, back), &area) in factors.iter().zip(back).zip(areas) {
        if area == 0.0 {
            open.push(Estimate::default());
            continue;
        }
        let sum: f64 = row.iter().map(|f| f.value).sum();
        let squares: f64 = row.iter().map(|f| f.error.powi(2)).sum();
        let error = (squares + back.error.powi(2)).sqrt();
        open.push(Estimate { value: 1.0 - sum - back.value, error });
    }
    open
}
