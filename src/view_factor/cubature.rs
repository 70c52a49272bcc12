//! Adaptive cubature over a polygon of what its points see of another, past others.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::Estimate;
use super::exchange::unblocked;
use super::point_visibility::PointVisibility;
use super::shaft::{Blocker, Shaft, covers};
use super::visual_events::{most_even, split_triangle};
use crate::geometry::plane::Plane;
use crate::geometry::quadrature::radon_nodes;
use crate::sampling::hash::{split_mix64, unit_interval};

/// Most cells that a sum is cut into; what error is left then is told.
const MOST_CELLS: usize = 40_000;

/// Cautious error of a cell behind blockers, as a share of what it could exchange with nothing in
/// the way, if it is all of the domain, or a crease halves it. Seven points can agree by chance;
/// only many cells cannot. At 0.1, one pair in ten thousand was off by four estimates; at 0.25,
/// none.
const DOUBT: f64 = 0.25;

/// Cautious error, as a share of the cell, of what its corners see otherwise if its points see all,
/// or nothing: a sharp shadow ends between its sides and the points next to them, in a strip of up
/// to a tenth of its area.
const MARGIN: f64 = 0.1;

/// Corners are looked from a little within, by this share of the way to the middle.
const WITHIN: f64 = 1e-3;

/// Less than this share of what could be seen is nothing.
const NEITHER: f64 = 1e-9;

/// The likely error of a cell is at least this share of its cautious one.
const LEAST: f64 = 0.03;

/// The likely error of a sum that is asked for, as a share of its cautious one.
const LIKELY: f64 = 0.1;

/// A pair of polygons with others between: one of the two, the domain, in cells.
pub(super) struct OccludedPair {
    /// Area of the domain.
    pub area: f64,
    /// Normal of the domain.
    pub normal: DVec3,
    pub target: Vec<DVec3>,
    pub target_normal: DVec3,
    pub creases: Vec<Plane>,
    pub cells: Vec<Cell>,
}

/// A triangle of the domain.
pub(super) struct Cell {
    corners: [DVec3; 3],
    /// What of the blockers is between this cell and the target; empty if all of the target is seen
    /// from all of the cell, or nothing from anywhere.
    blockers: Vec<Blocker>,
    flux: f64,
    /// Error that cuts are decided by: what rules of different degree differ by, for both what is
    /// seen and what is hidden, and doubt.
    cautious: f64,
    /// Error that is told: what the last cut changed, if that is less.
    likely: f64,
    /// Number that the place of its next cut is drawn from.
    seed: u64,
}

impl Cell {
    /// Of `candidates`, those that matter are kept.
    pub fn new(
        pair: &OccludedPair,
        corners: [DVec3; 3],
        candidates: &[Blocker],
        seed: u64,
        eye: &mut PointVisibility,
    ) -> Cell {
        let mut cell =
            Cell { corners, blockers: Vec::new(), flux: 0.0, cautious: 0.0, likely: 0.0, seed };
        let shaft = Shaft::new(&corners, pair.normal, &pair.target, pair.target_normal);
        let inside =
            |b: &Blocker| Some(Blocker { corners: shaft.clip(&b.corners)?, normal: b.normal });
        let blockers: Vec<Blocker> = candidates.iter().filter_map(inside).collect();
        if blockers.iter().any(|b| covers(b, &corners, &pair.target)) {
            return cell;
        }
        if blockers.is_empty() {
            let flux = unblocked(&corners, pair.normal, &pair.target, pair.target_normal);
            (cell.flux, cell.cautious, cell.likely) = (flux.value, flux.error, flux.error);
            return cell;
        }
        cell.blockers = blockers;
        let [a, b, c] = corners;
        let area = 0.5 * (b - a).cross(c - a).length();
        // Visible and whole, by either rule.
        let (mut five, mut two) = ([0.0; 2], [0.0; 2]);
        for node in radon_nodes(corners) {
            let (normal, facing) = (pair.normal, pair.target_normal);
            let seen = eye.look(node.point, normal, &pair.target, facing, &cell.blockers);
            for (k, value) in [seen.visible, seen.whole].into_iter().enumerate() {
                five[k] += area * node.degree_5 * value;
                two[k] += area * node.degree_2 * value;
            }
        }
        let [visible, whole] = [0, 1].map(|k| five[k] - two[k]);
        cell.flux = five[0];
        cell.cautious = visible.abs();
        let crossed = most_even(&pair.creases, &corners).map_or(0.0, |(even, _)| even);
        let margin = cell.margin(pair, five, eye);
        let doubt = DOUBT * five[1] * crossed.max(area / pair.area) + MARGIN * area * margin;
        cell.cautious += (whole - visible).abs() + doubt;
        cell.likely = cell.cautious;
        cell
    }

    /// If its points see all, or nothing, of `visible` and `whole` flux: how far from that is what a
    /// corner sees. A straight shadow that passes by all points takes in a corner.
    fn margin(
        &self,
        pair: &OccludedPair,
        [visible, whole]: [f64; 2],
        eye: &mut PointVisibility,
    ) -> f64 {
        let nothing = NEITHER * whole;
        if visible > nothing && whole - visible > nothing {
            return 0.0;
        }
        let middle = self.corners.iter().sum::<DVec3>() / 3.0;
        let other = |corner: &DVec3| {
            let at = corner.lerp(middle, WITHIN);
            let seen = eye.look(at, pair.normal, &pair.target, pair.target_normal, &self.blockers);
            if visible > nothing { seen.whole - seen.visible } else { seen.visible }
        };
        self.corners.iter().map(other).fold(0.0, f64::max)
    }

    /// Its parts, cut along a crease if there is one, else in two.
    ///
    /// What the cut changes is what was off before, and more than is off in the parts together:
    /// spread evenly over them, it is their likely error.
    fn parts(&self, pair: &OccludedPair, eye: &mut PointVisibility) -> Vec<Cell> {
        let triangles = match most_even(&pair.creases, &self.corners) {
            Some((_, crease)) => split_triangle(&self.corners, crease),
            None => self.halves().to_vec(),
        };
        let seeds = (1..).map(|k| split_mix64(self.seed ^ k));
        let mut parts: Vec<Cell> = triangles
            .into_iter()
            .zip(seeds)
            .map(|(corners, seed)| Cell::new(pair, corners, &self.blockers, seed, eye))
            .collect();
        let change = parts.iter().map(|part| part.flux).sum::<f64>() - self.flux;
        let likely = change.abs() / (parts.len() as f64).sqrt();
        for part in &mut parts {
            part.likely = likely.max(LEAST * part.cautious).min(part.cautious);
        }
        parts
    }

    /// Both parts of a cut from the middle of the longest side, roughly, to the far corner.
    fn halves(&self) -> [[DVec3; 3]; 2] {
        let [a, b, c] = self.corners;
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let square = |side: &(DVec3, DVec3, DVec3)| side.0.distance_squared(side.1);
        let longest = sides.iter().max_by(|x, y| square(x).total_cmp(&square(y)));
        let &(p, q, r) = longest.unwrap_or(&sides[0]);
        // Off the middle by up to a tenth, so that errors along a line of cells are independent.
        let share = 0.4 + 0.2 * unit_interval(self.seed);
        let middle = p.lerp(q, share);
        [[p, middle, r], [middle, q, r]]
    }
}

/// A cell waiting to be cut, the worst first; ties go by number, so that the order is certain.
struct HeapEntry {
    cautious: f64,
    pair: usize,
    cell: usize,
}

impl Ord for HeapEntry {
    fn cmp(&self, other: &Self) -> Ordering {
        let order = self.cautious.total_cmp(&other.cautious);
        order.then_with(|| (other.pair, other.cell).cmp(&(self.pair, self.cell)))
    }
}

impl PartialOrd for HeapEntry {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for HeapEntry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for HeapEntry {}

/// Squares of the errors of all cells.
#[derive(Default)]
struct Squares {
    cautious: f64,
    likely: f64,
}

impl Squares {
    fn add(&mut self, cell: &Cell, sign: f64) {
        self.cautious += sign * cell.cautious * cell.cautious;
        self.likely += sign * cell.likely * cell.likely;
    }
}

/// Flux over all `pairs`: cells are cut until the cautious error of the sum is below `tolerance`,
/// and the likely one a tenth of that.
pub(super) fn total(
    pairs: &mut [OccludedPair],
    tolerance: f64,
    eye: &mut PointVisibility,
) -> Estimate {
    let mut heap = BinaryHeap::new();
    let mut squares = Squares::default();
    for (pair, partial) in pairs.iter().enumerate() {
        for (cell, of) in partial.cells.iter().enumerate() {
            squares.add(of, 1.0);
            heap.push(HeapEntry { cautious: of.cautious, pair, cell });
        }
    }
    let fine =
        |s: &Squares| s.cautious <= tolerance.powi(2) && s.likely <= (LIKELY * tolerance).powi(2);
    while !fine(&squares) && heap.len() < MOST_CELLS {
        let Some(HeapEntry { cautious, pair, cell }) = heap.pop() else { break };
        if cautious == 0.0 {
            break;
        }
        let partial = &mut pairs[pair];
        squares.add(&partial.cells[cell], -1.0);
        let parts = partial.cells[cell].parts(partial, eye);
        for (k, part) in parts.into_iter().enumerate() {
            squares.add(&part, 1.0);
            let at = if k == 0 { cell } else { partial.cells.len() };
            heap.push(HeapEntry { cautious: part.cautious, pair, cell: at });
            if k == 0 {
                partial.cells[cell] = part;
            } else {
                partial.cells.push(part);
            }
        }
    }
    let cells = || pairs.iter().flat_map(|pair| &pair.cells);
    let likely: f64 = cells().map(|cell| cell.likely * cell.likely).sum();
    Estimate { value: cells().map(|cell| cell.flux).sum(), error: likely.sqrt() }
}
