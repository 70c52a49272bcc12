//! Enforces closure and reciprocity of a matrix, and reports the change.
//!
//! ```text
//! both factors of a pair → their mean, weighted by inverse variances → symmetric G = A_i F_ij
//! repeat: ratio_i = x_i (Σ_j G_ij x_j + lost_i) / A_i;  x_i ← x_i / √ratio_i   until all are 1
//! F_ij = x_i G_ij x_j / A_i
//! ```

use rayon::prelude::*;

use super::checks::is_closed;
use super::matrix::{Factor, ViewFactors};

/// Exchange areas A_i F_ij from one group, by ascending index of the other.
type ExchangeRow = Vec<(u32, f64)>;

/// Changes due to enforced closure and reciprocity. Dimensionless, as form factors are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct EnforcementReport {
    /// Root of the mean square of the changes of factors.
    pub rms_change: f64,
    /// The largest change of a factor.
    pub max_change: f64,
    /// Number of rows treated as closed: their open share, within its error of zero, is now zero.
    pub closed_rows: usize,
    /// The largest remaining closure error of a row: not zero where a row has no factor that could
    /// make up for the deficit.
    pub closure_left: f64,
}

impl ViewFactors {
    /// The matrix with reciprocity and closure enforced, and the size of the correction.
    ///
    /// First both factors of a pair are set to their mean, weighted by the inverse of their
    /// variances: A_i F_ij is then a symmetric matrix G. Then G is scaled from both sides, x_i G_ij
    /// x_j, until every row adds up to A_i: symmetric matrix scaling, which keeps symmetry and
    /// zeros, makes nothing negative, and minimizes the change of the factors in relative entropy
    /// (P. A. Knight, D. Ruiz, B. Uçar, "A symmetry preserving algorithm for matrix scaling", SIAM
    /// J. Matrix Anal. Appl. 35, 2014). The shares of a row that are open or hit backs are scaled
    /// with it; an open share within its error of zero is set to zero. No total exceeds 1. The
    /// change of a factor is added to its error, in squares.
    pub fn enforced(&self) -> (ViewFactors, EnforcementReport) {
        let matrix = self;
        let n = matrix.areas.len();
        let closed: Vec<bool> = (0..n).map(|i| is_closed(matrix, i)).collect();
        let mut exchange = symmetric_exchange(matrix);
        let lost: Vec<f64> = (0..n).map(|i| lost_exchange(matrix, i, closed[i])).collect();
        let x = scaling(&exchange, &lost, &matrix.areas);
        exchange.par_iter_mut().enumerate().for_each(|(i, row)| {
            row.iter_mut().for_each(|(j, area)| *area *= x[i] * x[*j as usize]);
        });
        let row_total =
            |i: usize| (row_sum(&exchange[i], |_| 1.0) + x[i] * lost[i]) / matrix.areas[i];
        let totals: Vec<f64> = (0..n).into_par_iter().map(row_total).collect();
        // Below 1 by the rounding of a sum, so that it is not above 1 in any order of summation.
        let largest_total =
            totals.iter().copied().fold(1.0, f64::max) * (1.0 + f64::EPSILON * n as f64);
        let closure_left = totals.iter().map(|total| (total - 1.0).abs()).fold(0.0, f64::max);
        let scaled_row = |(i, row): (usize, &ExchangeRow)| {
            let of_area = |&(j, area): &(u32, f64)| (j, area / matrix.areas[i] / largest_total);
            changed_row(&matrix.factors[i], row.iter().map(of_area))
        };
        let rows: Vec<ChangedRow> = exchange.par_iter().enumerate().map(scaled_row).collect();
        let count = rows.iter().map(|row| row.factors.len()).sum::<usize>() as f64;
        let sum_of_squares: f64 = rows.iter().map(|row| row.sum_of_squares).sum();
        let rms_change = if count > 0.0 { f64::sqrt(sum_of_squares / count) } else { 0.0 };
        let max_change = rows.iter().map(|row| row.max_change).fold(0.0, f64::max);
        let mut enforced = ViewFactors {
            names: matrix.names.clone(),
            back_of: matrix.back_of.clone(),
            areas: matrix.areas.clone(),
            factors: rows.into_iter().map(|row| row.factors).collect(),
            open: matrix.open.clone(),
            back: matrix.back.clone(),
            absent: matrix.absent,
        };
        for i in 0..n {
            let scale = x[i] / largest_total;
            enforced.back[i].value = (matrix.back[i].value * scale).max(0.0);
            let open = if closed[i] { 0.0 } else { (matrix.open[i].value * scale).max(0.0) };
            enforced.open[i].value = open;
        }
        let closed_rows = closed.iter().filter(|c| **c).count();
        (enforced, EnforcementReport { rms_change, max_change, closed_rows, closure_left })
    }
}

/// The exchange area of group `i` with the open and with backs.
fn lost_exchange(matrix: &ViewFactors, i: usize, is_closed: bool) -> f64 {
    let open = if is_closed { 0.0 } else { matrix.open[i].value };
    matrix.areas[i] * (open + matrix.back[i].value).max(0.0)
}

/// Exchange areas A_i F_ij, the same both ways: means weighted by inverse variances.
fn symmetric_exchange(matrix: &ViewFactors) -> Vec<ExchangeRow> {
    let n = matrix.areas.len();
    let is_known = |i: usize, j: u32| matrix.factors[i].binary_search_by_key(&j, |f| f.to).is_ok();
    let one_way = |i: usize| -> Vec<u32> {
        let others = matrix.factors[i].iter().map(|f| f.to);
        others.filter(|&j| !is_known(j as usize, i as u32)).collect()
    };
    let one_way: Vec<Vec<u32>> = (0..n).into_par_iter().map(one_way).collect();
    // Per group, those that see it but that it does not see.
    let mut unseen: Vec<Vec<u32>> = vec![Vec::new(); n];
    for (i, to) in one_way.iter().enumerate() {
        to.iter().for_each(|&j| unseen[j as usize].push(i as u32));
    }
    let row = |(i, unseen): (usize, Vec<u32>)| -> ExchangeRow {
        let mut columns: Vec<u32> = matrix.factors[i].iter().map(|f| f.to).collect();
        columns.extend(unseen);
        columns.sort_unstable();
        columns.into_iter().map(|j| (j, mean_exchange(matrix, i, j as usize))).collect()
    };
    unseen.into_par_iter().enumerate().map(row).collect()
}

/// The exchange area of two groups, from the factors both ways; the same bits either way.
fn mean_exchange(matrix: &ViewFactors, i: usize, j: usize) -> f64 {
    let (i, j) = (i.max(j), i.min(j));
    let (there, back) = (matrix.factor(i, j), matrix.factor(j, i));
    let (a, b) = (matrix.areas[i], matrix.areas[j]);
    let (value_there, error_there) = (a * there.value, a * there.error);
    let (value_back, error_back) = (b * back.value, b * back.error);
    let weight = if error_there * error_back > 0.0 {
        let square = error_back * error_back;
        square / (error_there * error_there + square)
    } else {
        0.5
    };
    (weight * value_there + (1.0 - weight) * value_back).max(0.0)
}

/// A row with new values.
struct ChangedRow {
    factors: Vec<Factor>,
    /// Sum of the squared changes of factors.
    sum_of_squares: f64,
    max_change: f64,
}

/// The row `before` with these `values`; the change of a factor is added to its error, in squares.
/// The whole value of a new factor counts as error.
fn changed_row(before: &[Factor], values: impl Iterator<Item = (u32, f64)>) -> ChangedRow {
    let mut before = before.iter().peekable();
    let mut row = ChangedRow { factors: vec![], sum_of_squares: 0.0, max_change: 0.0 };
    for (to, value) in values {
        let known = before.next_if(|f| f.to == to);
        let change = value - known.map_or(0.0, |f| f.value);
        let error = known.map_or(value, |f| libm::hypot(f.error, change));
        row.sum_of_squares += change * change;
        row.max_change = row.max_change.max(change.abs());
        row.factors.push(Factor { to, value, error });
    }
    row
}

/// Σ_j G_ij x_j over a row of exchange areas.
fn row_sum(row: &ExchangeRow, x: impl Fn(usize) -> f64) -> f64 {
    row.iter().map(|&(j, area)| area * x(j as usize)).sum()
}

/// The best approximation of the x with x_i (Σ_j G_ij x_j + lost_i) = A_i (P. A. Knight, D. Ruiz,
/// B. Uçar 2014, see [`ViewFactors::enforced`]).
fn scaling(exchange: &[ExchangeRow], lost: &[f64], areas: &[f64]) -> Vec<f64> {
    let mut x = vec![1.0; areas.len()];
    // Each about halves the error, so that a few dozen suffice unless zeros keep a row from
    // closing.
    for _ in 0..2000 {
        // A group without area emits nothing.
        let ratio = |i: usize| match areas[i] > 0.0 {
            true => x[i] * (row_sum(&exchange[i], |j| x[j]) + lost[i]) / areas[i],
            false => 0.0,
        };
        let ratios: Vec<f64> = (0..areas.len()).into_par_iter().map(ratio).collect();
        // Rounding of a sum of a thousand terms.
        if ratios.iter().all(|r| *r == 0.0 || (r - 1.0).abs() <= 1e-13) {
            break;
        }
        for (x, ratio) in x.iter_mut().zip(ratios) {
            if ratio > 0.0 {
                *x /= ratio.sqrt();
            }
        }
    }
    x
}
