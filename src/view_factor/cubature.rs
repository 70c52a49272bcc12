//! Adaptive cubature of an occluded pair: integrates over one polygon the form factor to the
//! visible part of the other.
//!
//! ```text
//!        target            A₁F₁₂ = ∫ over the domain of F(point → visible part of the target)
//!      ───────────
//!          ▬▬  blockers    F at a point is exact (see `point_visibility`); it is smooth except
//!      ╱╲  ╱╲  ╱╲  ╱╲      where the point crosses a visual event (see `visual_events`)
//!        domain: cells
//! ```
//!
//! The domain is cut into triangular cells. A cell without blockers between it and the target has a
//! closed form; one hidden entirely by a single blocker is zero; Radon's seven-point rule is
//! applied to the others. The cell with the largest error bound is cut again, along an event plane
//! if one crosses it, else in two, until the bounds and estimates of all cells of a sum are small
//! enough.
//!
//! Every cell has two errors. The *bound* decides which cell is cut: the difference of two rules of
//! different degree, plus the error that seven points may miss. The *estimate* is reported: the
//! change due to the last cut. Errors of cells are independent (cuts are jittered), so their
//! squares add up.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use super::matrix::Estimate;
use super::point_visibility::{PointFactors, PointVisibility};
use super::shaft::{Blocker, Shaft, fully_occludes};
use super::unoccluded::unoccluded_exchange;
use super::visual_events::{most_balanced_split, split_triangle};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::plane::Plane;
use crate::geometry::quadrature::radon_nodes;
use crate::sampling::hash::{split_mix64, unit_interval};

/// An occluded pair of polygons: one of the two, the domain, in cells.
pub(super) struct OccludedPair {
    /// Area of the domain.
    pub area: f64,
    /// Unit normal of the domain.
    pub normal: DVec3,
    /// Corners of the other polygon, all before the domain.
    pub target: Vec<DVec3>,
    /// Unit normal of the target.
    pub target_normal: DVec3,
    /// Event planes that cross the domain.
    pub event_planes: Vec<Plane>,
    /// Triangles that make up the domain.
    pub cells: Vec<Cell>,
}

impl OccludedPair {
    /// Blockers of all cells, and the number of cells.
    pub fn blockers_and_cells(&self) -> [usize; 2] {
        [self.cells.iter().map(|cell| cell.blockers.len()).sum(), self.cells.len()]
    }
}

/// A triangle of the domain. Fluxes and errors are A₁F₁₂, in squares of the unit of length.
pub(super) struct Cell {
    corners: [DVec3; 3],
    /// The parts of blockers between this cell and the target; empty if all of the target is
    /// visible from all of the cell, or nothing from anywhere.
    blockers: Vec<Blocker>,
    flux: f64,
    /// Error that decides on cuts.
    error_bound: f64,
    /// Reported error; at most the bound.
    error_estimate: f64,
    /// Seed of the position of its next cut.
    seed: u64,
}

/// Flux of a cell by one rule.
#[derive(Clone, Copy, Default)]
struct CellFlux {
    /// With blockers.
    visible: f64,
    /// Without blockers.
    unoccluded: f64,
}

impl CellFlux {
    /// Adds the form factors of a point with weight `weight` of the cell's area `area`.
    fn add(&mut self, area: f64, weight: f64, factors: PointFactors) {
        self.visible += area * weight * factors.visible;
        self.unoccluded += area * weight * factors.unoccluded;
    }
}

impl Cell {
    /// The cell with these `corners` in the domain of `pair`. Of `candidates`, the parts between
    /// the triangle and the target are kept.
    pub fn new(
        pair: &OccludedPair,
        corners: [DVec3; 3],
        candidates: &[Blocker],
        seed: u64,
        visibility: &mut PointVisibility,
    ) -> Cell {
        let mut cell = Cell {
            corners,
            blockers: Vec::new(),
            flux: 0.0,
            error_bound: 0.0,
            error_estimate: 0.0,
            seed,
        };
        let shaft = Shaft::new(&corners, pair.normal, &pair.target, pair.target_normal);
        let inside =
            |b: &Blocker| Some(Blocker { corners: shaft.clip(&b.corners)?, normal: b.normal });
        let blockers: Vec<Blocker> = candidates.iter().filter_map(inside).collect();
        if blockers.iter().any(|b| fully_occludes(b, &corners, &pair.target)) {
            return cell;
        }
        if blockers.is_empty() {
            let exchange =
                unoccluded_exchange(&corners, pair.normal, &pair.target, pair.target_normal);
            cell.flux = exchange.value;
            cell.error_bound = exchange.error;
            cell.error_estimate = exchange.error;
            return cell;
        }
        cell.blockers = blockers;
        cell.integrate(pair, visibility);
        cell
    }

    /// Sets flux and errors by Radon's rule.
    fn integrate(&mut self, pair: &OccludedPair, visibility: &mut PointVisibility) {
        let [a, b, c] = self.corners;
        let area = 0.5 * (b - a).cross(c - a).length();
        let mut degree_5 = CellFlux::default();
        let mut degree_2 = CellFlux::default();
        for node in radon_nodes(self.corners) {
            let factors = self.factors_from(node.point, pair, visibility);
            degree_5.add(area, node.degree_5, factors);
            degree_2.add(area, node.degree_2, factors);
        }
        let visible_change = degree_5.visible - degree_2.visible;
        let unoccluded_change = degree_5.unoccluded - degree_2.unoccluded;
        let balance = most_balanced_split(&pair.event_planes, &self.corners)
            .map_or(0.0, |(balance, _)| balance);
        let rim = self.largest_corner_deviation(pair, degree_5, visibility);
        // Seven points can agree by chance, many cells cannot. Measured with 0.1: the error of one
        // pair in ten thousand was four times its estimate; with 0.25, of none. A sharp shadow may
        // end undetected in the strip between a side and the nearest points, up to a tenth of the
        // area.
        let unseen = 0.25 * degree_5.unoccluded * balance.max(area / pair.area) + 0.1 * area * rim;
        self.flux = degree_5.visible;
        // Differences of the rules for visible and for hidden flux, plus the error that they may
        // miss.
        self.error_bound = visible_change.abs();
        self.error_bound += (unoccluded_change - visible_change).abs() + unseen;
        self.error_estimate = self.error_bound;
    }

    /// Form factors from a point of the cell to the target.
    fn factors_from(
        &self,
        point: DVec3,
        pair: &OccludedPair,
        visibility: &mut PointVisibility,
    ) -> PointFactors {
        let facing = pair.target_normal;
        visibility.factors(point, pair.normal, &pair.target, facing, &self.blockers)
    }

    /// If, by `flux`, the points of the rule see all of the target or nothing of it: the largest
    /// deviation from that at a corner, as a form factor. A straight shadow that misses all points
    /// covers a corner.
    fn largest_corner_deviation(
        &self,
        pair: &OccludedPair,
        flux: CellFlux,
        visibility: &mut PointVisibility,
    ) -> f64 {
        let nothing = COINCIDENCE_TOLERANCE * flux.unoccluded;
        if flux.visible > nothing && flux.unoccluded - flux.visible > nothing {
            return 0.0;
        }
        let centroid = self.corners.iter().sum::<DVec3>() / 3.0;
        let mut largest = 0.0_f64;
        for corner in &self.corners {
            // Blockers may touch the boundary.
            let point = corner.lerp(centroid, 1e-3);
            let factors = self.factors_from(point, pair, visibility);
            let deviation = if flux.visible > nothing {
                factors.unoccluded - factors.visible
            } else {
                factors.visible
            };
            largest = largest.max(deviation);
        }
        largest
    }

    /// The cell's parts, cut along an event plane if one crosses it, else in two.
    ///
    /// The change due to the cut estimates the error before it, which exceeds that of the parts
    /// together: spread evenly over the parts, in squares, it is their error estimate.
    fn split(&self, pair: &OccludedPair, visibility: &mut PointVisibility) -> Vec<Cell> {
        let triangles = match most_balanced_split(&pair.event_planes, &self.corners) {
            Some((_, plane)) => split_triangle(&self.corners, plane),
            None => self.halves().to_vec(),
        };
        let seeds = (1..).map(|k| split_mix64(self.seed ^ k));
        let mut parts: Vec<Cell> = triangles
            .into_iter()
            .zip(seeds)
            .map(|(corners, seed)| Cell::new(pair, corners, &self.blockers, seed, visibility))
            .collect();
        let change = parts.iter().map(|part| part.flux).sum::<f64>() - self.flux;
        let share = change.abs() / (parts.len() as f64).sqrt();
        for part in &mut parts {
            // A single cut without change proves little. Plain choice.
            let least = 0.03 * part.error_bound;
            part.error_estimate = share.max(least).min(part.error_bound);
        }
        parts
    }

    /// Both parts of a cut from near the middle of the longest side to the opposite corner.
    fn halves(&self) -> [[DVec3; 3]; 2] {
        let [a, b, c] = self.corners;
        let sides = [(a, b, c), (b, c, a), (c, a, b)];
        let square = |side: &(DVec3, DVec3, DVec3)| side.0.distance_squared(side.1);
        let longest = sides.iter().max_by(|x, y| square(x).total_cmp(&square(y)));
        let &(p, q, opposite) = longest.unwrap_or(&sides[0]);
        let share = 0.4 + 0.2 * unit_interval(self.seed);
        let middle = p.lerp(q, share);
        [[p, middle, opposite], [middle, q, opposite]]
    }
}

/// A cell to be cut by its error bound, whose bits have the order of the bound since that is not
/// negative; ties go by pair and cell, so that the order is the same on every run.
type HeapEntry = (u64, Reverse<(usize, usize)>);

impl Cell {
    fn in_heap(&self, pair: usize, cell: usize) -> HeapEntry {
        (self.error_bound.to_bits(), Reverse((pair, cell)))
    }
}

/// Sums over cells of the squares of their errors.
#[derive(Default)]
struct SquaredErrors {
    bound: f64,
    estimate: f64,
}

impl SquaredErrors {
    fn add(&mut self, cell: &Cell) {
        self.bound += cell.error_bound * cell.error_bound;
        self.estimate += cell.error_estimate * cell.error_estimate;
    }

    fn remove(&mut self, cell: &Cell) {
        self.bound -= cell.error_bound * cell.error_bound;
        self.estimate -= cell.error_estimate * cell.error_estimate;
    }

    fn are_within(&self, tolerance: f64) -> bool {
        // Rows of thousands of factors then close to a tenth of the requested error.
        self.bound <= tolerance.powi(2) && self.estimate <= (0.1 * tolerance).powi(2)
    }
}

/// Maximum number of cells of a sum: limits time and memory; the remaining error is reported.
pub(super) const MAX_CELLS: usize = 40_000;

/// Cells of which one is cut at once: so many more than needed are cut in the end, and so many
/// threads share the work on a sum of many cells, by which a ground under a city takes longer than
/// all other polygons.
const CELLS_PER_CUT: usize = 64;

/// The sum of A₁F₁₂ over all `pairs`: cells are cut until the error bound of the sum is at most
/// `tolerance` and its estimate a tenth of that, or `max_cells` are reached.
pub(super) fn integrate_adaptively(
    pairs: &mut [OccludedPair],
    tolerance: f64,
    max_cells: usize,
    visibility: &mut PointVisibility,
) -> Estimate {
    let mut heap = BinaryHeap::new();
    let mut squared_errors = SquaredErrors::default();
    for (pair, occluded) in pairs.iter().enumerate() {
        for (index, cell) in occluded.cells.iter().enumerate() {
            squared_errors.add(cell);
            heap.push(cell.in_heap(pair, index));
        }
    }
    while !squared_errors.are_within(tolerance) && heap.len() < max_cells {
        // Of few cells the worst one; of many as many as threads have work with.
        let count = heap.len().div_ceil(CELLS_PER_CUT);
        let worst: Vec<(usize, usize)> = std::iter::from_fn(|| match heap.pop() {
            Some((1.., Reverse(place))) => Some(place),
            _ => None,
        })
        .take(count)
        .collect();
        let split = |&(pair, cell): &(usize, usize), visibility: &mut PointVisibility| {
            pairs[pair].cells[cell].split(&pairs[pair], visibility)
        };
        let cut: Vec<Vec<Cell>> = match &worst[..] {
            [] => break,
            [only] => vec![split(only, visibility)],
            many => many
                .par_iter()
                .map_init(PointVisibility::default, |visibility, place| split(place, visibility))
                .collect(),
        };
        for (&(pair, cell), parts) in worst.iter().zip(cut) {
            let cells = &mut pairs[pair].cells;
            squared_errors.remove(&cells[cell]);
            for (k, part) in parts.into_iter().enumerate() {
                squared_errors.add(&part);
                let index = if k == 0 { cell } else { cells.len() };
                heap.push(part.in_heap(pair, index));
                if k == 0 {
                    cells[cell] = part;
                } else {
                    cells.push(part);
                }
            }
        }
    }
    let cells = || pairs.iter().flat_map(|pair| &pair.cells);
    let squared: f64 = cells().map(|cell| cell.error_estimate * cell.error_estimate).sum();
    Estimate { value: cells().map(|cell| cell.flux).sum(), error: squared.sqrt() }
}
