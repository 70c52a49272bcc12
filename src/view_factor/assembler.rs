//! Assembles an exact matrix: all pairs of convex polygons, each computed once, summed over groups.
//!
//! ```text
//! scene ─→ fronts: polygons that emit and receive, in the order of groups
//!      ├─→ backs: visible parts of the backs of polygons
//!      └─→ blockers: polygons of any group, in a tree
//!
//! for each front s:   for each group of later fronts, and for all backs:
//!                         sum of unoccluded pairs + adaptive cubature of occluded pairs
//! ```
//!
//! Later fronts only: A_i F_ij = A_j F_ji gives the other half. The tolerance of a group's error is
//! shared between the polygons of the giving group by area, in squares.

use std::ops::Range;

use rayon::prelude::*;

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::cubature::{MAX_CELLS, integrate_adaptively};
use super::matrix::{Estimate, Factor};
use super::pair_visibility::PairVisibility;
use super::partial_matrix::{Exchange, Making, PolygonRow};
use super::point_visibility::PointVisibility;
use super::scene_polygons::ScenePolygons;
use crate::sampling::hash::split_mix64;

/// Computes the rows of the polygons `wanted`; `None` if stopped.
pub(super) fn make(
    polygons: ScenePolygons,
    error: f64,
    wanted: &[u32],
    making: &mut Making,
) -> Option<()> {
    let assembler = Assembler::new(polygons, error);
    let pieces_of = |&s: &u32| assembler.receivers(s).map(move |piece| (s, piece));
    let pieces: Vec<(u32, Receivers)> = wanted.iter().flat_map(pieces_of).collect();
    making.rows_of_pieces(
        wanted,
        &pieces,
        |done| (done, wanted.len()),
        |s, receivers| assembler.exchanges(s as usize, receivers),
        |_, mut pieces| {
            let back = pieces.pop().and_then(|backs| backs.first().copied()).unwrap_or_default();
            PolygonRow { fronts: pieces.concat(), back }
        },
    )
}

/// Fronts that a piece of a row has, at least: few, since of a row of many pairs that are occluded
/// by much each takes milliseconds. Plain choice.
const FRONTS_OF_PIECE: usize = 16;

/// What a polygon exchanges with in one piece of its row.
enum Receivers {
    /// Fronts of whole groups, but for the polygon's own, by their indices.
    Fronts(Range<usize>),
    /// All backs: the last piece.
    Backs,
}

/// The error bound of a factor, as a share of the requested error. Its estimate is reduced to a
/// tenth of that: rows of thousands of factors then close to a tenth of the requested error.
pub(super) const BOUND_SHARE: f64 = 0.1;

/// Data for computing the exchange of one polygon with others.
pub(super) struct Assembler {
    /// Polygons that emit and receive, by group.
    fronts: Vec<ConvexPolygon>,
    /// Visible parts of the backs of polygons.
    backs: Vec<ConvexPolygon>,
    blockers: BlockerTree,
    /// Radiating area of each group, in squares of the scene's unit.
    areas: Vec<f64>,
    /// Requested absolute error of every factor.
    error: f64,
}

impl Assembler {
    /// An assembler of `polygons`, with an absolute error of every factor well below `error`.
    pub fn new(polygons: ScenePolygons, error: f64) -> Assembler {
        let ScenePolygons { fronts, blockers, .. } = polygons;
        let backs = blockers.backs(&BlockerTree::new(fronts.polygons.clone()));
        Assembler { fronts: fronts.polygons, backs, blockers, areas: fronts.areas, error }
    }

    /// The pieces of the row of polygon `s`: later ones, and backs.
    fn receivers(&self, s: u32) -> impl Iterator<Item = Receivers> {
        let (mut start, count) = (s as usize + 1, self.fronts.len());
        let fronts = std::iter::from_fn(move || {
            let least = start + FRONTS_OF_PIECE;
            let is_inside = |k: &usize| self.fronts[k - 1].group == self.fronts[*k].group;
            let end = (least..count).find(|k| !is_inside(k)).unwrap_or(count);
            let piece = (start < count).then_some(Receivers::Fronts(start..end));
            start = end;
            piece
        });
        fronts.chain([Receivers::Backs])
    }

    /// The exchange of polygon `s` with each group of these `receivers`, or with all backs.
    fn exchanges(&self, s: usize, receivers: &Receivers) -> Vec<Exchange> {
        let mut visibility = PointVisibility::default();
        let from = &self.fronts[s];
        let group_area = self.areas[from.group as usize];
        // Errors of the polygons of a group are independent: squares add up.
        let share = self.bound_share(from);
        let Receivers::Fronts(range) = receivers else {
            let receivers = self.backs.iter().zip(self.fronts.len()..);
            let back = self.flux(s, receivers, share * group_area, &mut visibility);
            return vec![Exchange::new(0, back)];
        };
        let mut exchanges = vec![];
        let mut t = range.start;
        for group in self.fronts[range.clone()].chunk_by(|a, b| a.group == b.group) {
            let to = group[0].group;
            let receivers = group.iter().zip(t..);
            t += group.len();
            let tolerance = share * group_area.min(self.areas[to as usize]);
            let flux = self.flux(s, receivers, tolerance, &mut visibility);
            if flux.value > 0.0 || flux.error > 0.0 {
                exchanges.push(Exchange::new(to, flux));
            }
        }
        exchanges
    }

    /// The error bound of a sum from a polygon, as a share of the area of the smaller group.
    fn bound_share(&self, from: &ConvexPolygon) -> f64 {
        BOUND_SHARE * self.error * self.root_share(from)
    }

    /// The root of a polygon's share of the area of its group.
    fn root_share(&self, polygon: &ConvexPolygon) -> f64 {
        (polygon.area / self.areas[polygon.group as usize]).sqrt()
    }

    /// The factors of `group` to all groups, by ascending index, no zeros.
    pub fn whole_row(&self, group: usize) -> Vec<Factor> {
        let polygons = |group| {
            let start = self.fronts.partition_point(|p| (p.group as usize) < group);
            let count = self.fronts[start..].partition_point(|p| p.group as usize == group);
            start..start + count
        };
        let to_group = |to: usize| {
            let mut visibility = PointVisibility::default();
            let flux = |s: usize| {
                let from = &self.fronts[s];
                let tolerance = self.bound_share(from) * self.areas[group].min(self.areas[to]);
                let receivers = polygons(to).filter(|t| *t != s);
                let receivers = receivers.map(|t| (&self.fronts[t], t));
                self.flux(s, receivers, tolerance, &mut visibility)
            };
            let sum = Estimate::sum(polygons(group).map(flux));
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
        let occluded = integrate_adaptively(&mut occluded_pairs, tolerance, MAX_CELLS, visibility);
        // Errors of closed forms and of their cubature share a sign: over the polygons of a group
        // they add up themselves, not their squares. Each divided by the root of its share of the
        // area, the squares add up to that of the sum or more (Cauchy–Schwarz inequality).
        let of_closed_forms = unoccluded.error / self.root_share(from);
        Estimate {
            value: unoccluded.value + occluded.value,
            error: libm::hypot(of_closed_forms, occluded.error),
        }
    }
}
