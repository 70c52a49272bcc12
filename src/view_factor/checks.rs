//! Laws that a matrix of view factors must satisfy, measured on raw numbers.
//!
//! | law | formula | measured by |
//! |---|---|---|
//! | closure | Σ_j F_ij + open_i + back_i = 1 | [`MatrixChecks::closure`] |
//! | reciprocity | A_i F_ij = A_j F_ji | [`MatrixChecks::reciprocity`] |
//! | bounds | 0 ≤ F_ij ≤ min(1, A_j / A_i) | [`MatrixChecks::bounds`] |
//! | | Σ_j F_ij + back_i ≤ 1 | [`MatrixChecks::row_sums`] |
//!
//! The open share of a row indicates faults of the scene: if above its error, the enclosure has a
//! gap; if below minus its error, surfaces coincide.

use super::matrix::{Estimate, ViewFactors};
use crate::geometry::COINCIDENCE_TOLERANCE;

/// Deviations of a matrix from the laws. A correct row sum does not prove correct entries: that of
/// a hemicube is exact while its entries have errors. Dimensionless, as form factors are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct MatrixChecks {
    /// Row sum + open + back − 1, over rows. The `open` of an exact or sparse matrix is the
    /// remainder, not measured: there it is row sum + back − 1, over the closed rows.
    pub closure: ErrorStats,
    /// (A_i F_ij − A_j F_ji) / min(A_i, A_j), over pairs: an error of the smaller group's factor.
    pub reciprocity: ErrorStats,
    /// Amount by which a value is below 0 or above 1, or A_i F_ij above A_j, as a share of A_i;
    /// over all factors.
    pub bounds: ErrorStats,
    /// Amount by which the sum of a row and its back share is above 1; over all rows.
    pub row_sums: ErrorStats,
}

/// Size of an error over many values.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorStats {
    /// Root of the mean square.
    pub rms: f64,
    /// The largest magnitude.
    pub max: f64,
    /// Row and column of the largest; for a whole row, twice the row.
    pub at: (usize, usize),
}

impl ErrorStats {
    fn of(errors: impl Iterator<Item = ((usize, usize), f64)>) -> ErrorStats {
        let mut stats = ErrorStats::default();
        let mut count = 0.0;
        for (at, error) in errors {
            stats.rms += error * error;
            count += 1.0;
            if error.abs() > stats.max {
                stats.max = error.abs();
                stats.at = at;
            }
        }
        if count > 0.0 {
            stats.rms = (stats.rms / count).sqrt();
        }
        stats
    }
}

impl ViewFactors {
    /// Measures closure, reciprocity and bounds.
    pub fn checks(&self) -> MatrixChecks {
        MatrixChecks {
            closure: ErrorStats::of(closure_errors(self)),
            reciprocity: ErrorStats::of(reciprocity_errors(self)),
            bounds: ErrorStats::of(bound_errors(self)),
            row_sums: ErrorStats::of(row_excesses(self)),
        }
    }

    /// The groups whose enclosure leaks: the share of their flux that hits nothing exceeds three
    /// standard errors. The most open come first.
    pub fn open_rows(&self) -> Vec<usize> {
        let mut rows: Vec<usize> = (0..self.open.len()).filter(|&i| !is_closed(self, i)).collect();
        rows.sort_by(|&i, &j| self.open[j].value.total_cmp(&self.open[i].value).then(i.cmp(&j)));
        rows
    }

    /// The groups of whose flux some arrives at backs, where it is lost: more than three standard
    /// errors. The largest share comes first.
    pub fn rows_that_meet_backs(&self) -> Vec<usize> {
        let share = |i: usize| self.back[i].value;
        let meets = |i: &usize| share(*i) > tolerance(self.back[*i]);
        let mut rows: Vec<usize> = (0..self.back.len()).filter(meets).collect();
        rows.sort_by(|&i, &j| share(j).total_cmp(&share(i)).then(i.cmp(&j)));
        rows
    }

    /// Row and column of the factor that is furthest out of its bounds, of those that are by more
    /// than three standard errors and rounding.
    pub fn worst_out_of_bounds(&self) -> Option<(usize, usize)> {
        // A factor and its bound are quotients of sums, which round by ε of a term each. Of pairs
        // of polygons within a group the error allows for as much: 1e-13 of the smaller one each.
        let terms = self.areas.len() as f64;
        let beyond = |&((i, j), excess): &((usize, usize), f64)| {
            let rounding = terms * f64::EPSILON * largest_factor(self, i, j);
            excess > 3.0 * self.factor(i, j).error + rounding
        };
        let worst = bound_errors(self).filter(beyond).max_by(|a, b| a.1.total_cmp(&b.1));
        worst.map(|(at, _)| at)
    }

    /// The groups whose rows sum to more than one by over three standard errors: they see
    /// coinciding surfaces, such as a poster in the plane of its wall. The largest sum comes first.
    pub fn rows_over_unity(&self) -> Vec<usize> {
        let excess = |i: usize| -self.open[i].value;
        let is_over = |i: &usize| excess(*i) > tolerance(self.open[*i]);
        let mut rows: Vec<usize> = (0..self.open.len()).filter(is_over).collect();
        rows.sort_by(|&i, &j| excess(j).total_cmp(&excess(i)).then(i.cmp(&j)));
        rows
    }
}

fn closure_errors(m: &ViewFactors) -> impl Iterator<Item = ((usize, usize), f64)> {
    let rows = (0..m.areas.len()).filter(|&i| is_closed(m, i));
    rows.map(|i| ((i, i), row_sum(m, i) - 1.0))
}

/// Share of the flux of group `i` that arrives at fronts and backs.
fn row_sum(m: &ViewFactors, i: usize) -> f64 {
    m.factors[i].iter().map(|f| f.value).sum::<f64>() + m.back[i].value
}

fn row_excesses(m: &ViewFactors) -> impl Iterator<Item = ((usize, usize), f64)> {
    (0..m.areas.len()).map(|i| ((i, i), (row_sum(m, i) - 1.0).max(0.0)))
}

/// All factors with their rows and columns.
fn entries(m: &ViewFactors) -> impl Iterator<Item = (usize, usize, f64)> {
    let row = |i: usize| m.factors[i].iter().map(move |f| (i, f.to as usize, f.value));
    (0..m.areas.len()).flat_map(row)
}

fn reciprocity_errors(m: &ViewFactors) -> impl Iterator<Item = ((usize, usize), f64)> {
    entries(m).filter(|(i, j, _)| i != j).map(|(i, j, value)| {
        let (a, b) = (m.areas[i], m.areas[j]);
        ((i, j), (a * value - b * m.factor(j, i).value) / a.min(b))
    })
}

fn bound_errors(m: &ViewFactors) -> impl Iterator<Item = ((usize, usize), f64)> {
    entries(m).map(|(i, j, value)| ((i, j), (value - largest_factor(m, i, j)).max(-value).max(0.0)))
}

/// The upper bound of a factor.
fn largest_factor(m: &ViewFactors, i: usize, j: usize) -> f64 {
    (m.areas[j] / m.areas[i]).min(1.0)
}

/// Maximum deviation of a share of a row from zero that still counts as zero.
fn tolerance(share: Estimate) -> f64 {
    // Three standard errors, and the rounding of a row of thousands of factors.
    3.0 * share.error + COINCIDENCE_TOLERANCE
}

/// Whether the open share of group `i` is zero within its error, or below.
pub(super) fn is_closed(m: &ViewFactors, i: usize) -> bool {
    m.open[i].value <= tolerance(m.open[i])
}
