//! A matrix made to keep energy: closure and reciprocity enforced, and what it took.
//!
//! ```text
//! both factors of a pair → their mean, weighted by inverse variances → symmetric G = A_i F_ij
//! repeat: ratio_i = x_i (Σ_j G_ij x_j + lost_i) / A_i;  x_i ← x_i / √ratio_i   until all are 1
//! F_ij = x_i G_ij x_j / A_i
//! ```

use std::collections::BTreeMap;

use super::checks::is_closed;
use super::matrix::{Factor, Missing, ViewFactors};

/// What enforcing closure and reciprocity has changed. Dimensionless, as form factors are.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct EnforcementReport {
    /// Root of the mean square of the changes of factors.
    pub rms_change: f64,
    /// The largest change of a factor.
    pub max_change: f64,
    /// Number of rows taken for closed: their open share, within its error of zero, is now zero.
    pub closed_rows: usize,
    /// The largest closure error of a row that is left: not zero where a row has no factor that
    /// could take up what is missing.
    pub closure_left: f64,
}

/// Steps of the symmetric scaling (a Sinkhorn iteration) at most; each about halves the error, so
/// that a few dozen do unless zeros keep a row from closing. Chosen by hand.
const MAX_SINKHORN_STEPS: usize = 2000;

/// Relative closure error of a row that is good enough: rounding of a sum of a thousand terms.
const CLOSURE_TOLERANCE: f64 = 1e-13;

/// [`ViewFactors::enforced`].
pub(super) fn enforce(matrix: &ViewFactors) -> (ViewFactors, EnforcementReport) {
    let n = matrix.areas.len();
    let closed: Vec<bool> = (0..n).map(|i| is_closed(matrix, i)).collect();
    let mut exchange = symmetric_exchange(matrix);
    let lost: Vec<f64> = (0..n).map(|i| lost_exchange(matrix, i, closed[i])).collect();
    let x = scaling(&exchange, &lost, &matrix.areas);
    for (i, row) in exchange.iter_mut().enumerate() {
        for (&j, area) in row.iter_mut() {
            *area *= x[i] * x[j as usize];
        }
    }
    let row_total =
        |i: usize| (exchange[i].values().sum::<f64>() + x[i] * lost[i]) / matrix.areas[i];
    // Below 1 by the rounding of a sum, so that no order of summation is above it.
    let largest_total = (0..n).map(row_total).fold(1.0, f64::max) * (1.0 + f64::EPSILON * n as f64);
    let closure_left = (0..n).map(|i| (row_total(i) - 1.0).abs()).fold(0.0, f64::max);
    let mut enforced = matrix.clone();
    let mut sum_of_squares = 0.0;
    let mut count = 0.0;
    let mut max_change = 0.0_f64;
    for (i, row) in exchange.iter().enumerate() {
        let area = matrix.areas[i];
        for (&j, &exchange_area) in row {
            let value = exchange_area / area / largest_total;
            let change = value - matrix.factor(i, j as usize).value;
            sum_of_squares += change * change;
            count += 1.0;
            max_change = max_change.max(change.abs());
            set_factor(&mut enforced, i, j, value);
        }
        let scale = x[i] / largest_total;
        enforced.back[i].value = (matrix.back[i].value * scale).max(0.0);
        let open = if closed[i] { 0.0 } else { (matrix.open[i].value * scale).max(0.0) };
        enforced.open[i].value = open;
    }
    let rms_change = if count > 0.0 { f64::sqrt(sum_of_squares / count) } else { 0.0 };
    let closed_rows = closed.iter().filter(|c| **c).count();
    (enforced, EnforcementReport { rms_change, max_change, closed_rows, closure_left })
}

/// What group `i` loses to the open and to backs, as an exchange area.
fn lost_exchange(matrix: &ViewFactors, i: usize, is_closed: bool) -> f64 {
    let open = if is_closed { 0.0 } else { matrix.open[i].value };
    matrix.areas[i] * (open + matrix.back[i].value).max(0.0)
}

/// Exchange areas A_i F_ij, the same both ways: means weighted by inverse variances.
fn symmetric_exchange(matrix: &ViewFactors) -> Vec<BTreeMap<u32, f64>> {
    let mut rows: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); matrix.areas.len()];
    for (i, row) in matrix.factors.iter().enumerate() {
        for there in row {
            let j = there.to as usize;
            let back = matrix.factor(j, i);
            let (a, b) = (matrix.areas[i], matrix.areas[j]);
            let (value_there, error_there) = (a * there.value, a * there.error);
            let (value_back, error_back) = (b * back.value, b * back.error);
            let weight = if error_there * error_back > 0.0 {
                let square = error_back * error_back;
                square / (error_there * error_there + square)
            } else {
                0.5
            };
            let mean = weight * value_there + (1.0 - weight) * value_back;
            let exchange_area = mean.max(0.0);
            rows[i].insert(j as u32, exchange_area);
            rows[j].insert(i as u32, exchange_area);
        }
    }
    rows
}

/// Sets a factor; what it changes by is added to its error, in squares.
fn set_factor(matrix: &mut ViewFactors, i: usize, to: u32, value: f64) {
    let row = &mut matrix.factors[i];
    match row.binary_search_by_key(&to, |f| f.to) {
        Ok(k) => {
            row[k].error = row[k].error.hypot(value - row[k].value);
            row[k].value = value;
        }
        Err(k) => {
            debug_assert_eq!(matrix.absent, Missing::NotSeen);
            row.insert(k, Factor { to, value, error: value });
        }
    }
}

/// The x with x_i (Σ_j G_ij x_j + lost_i) = A_i, as closely as there is one (P. A. Knight, D. Ruiz,
/// B. Uçar 2014, see [`ViewFactors::enforced`]).
fn scaling(exchange: &[BTreeMap<u32, f64>], lost: &[f64], areas: &[f64]) -> Vec<f64> {
    let mut x = vec![1.0; areas.len()];
    for _ in 0..MAX_SINKHORN_STEPS {
        let ratio = |i: usize| {
            let arrives: f64 = exchange[i].iter().map(|(&j, area)| area * x[j as usize]).sum();
            x[i] * (arrives + lost[i]) / areas[i]
        };
        let ratios: Vec<f64> = (0..areas.len()).map(ratio).collect();
        if ratios.iter().all(|r| *r == 0.0 || (r - 1.0).abs() <= CLOSURE_TOLERANCE) {
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
