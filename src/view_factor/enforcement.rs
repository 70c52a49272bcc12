//! A matrix made to keep energy: closure and reciprocity enforced, and what it took.

use std::collections::BTreeMap;

use super::{Missing, ViewFactors};

/// What enforcing closure and reciprocity has changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnforcementReport {
    /// Root of the mean square of the changes of factors.
    pub rms: f64,
    /// The largest change of a factor.
    pub worst: f64,
    /// Rows taken for closed: their open share, within its error of zero, is now zero.
    pub closed: usize,
    /// The largest closure error of a row that is left: not zero where a row has no factor that
    /// could take up what is missing.
    pub left: f64,
}

/// Steps of scaling at most; each about halves the error.
const MOST_STEPS: usize = 2000;

/// Closure that is good enough: rounding of a thousand sums.
const CLOSED: f64 = 1e-13;

impl ViewFactors {
    /// The matrix with reciprocity and closure enforced, and the size of the correction.
    ///
    /// First both factors of a pair are set to their mean, weighted by the inverse of their
    /// variances: A_i F_ij is then a symmetric matrix G. Then G is scaled from both sides, x_i G_ij
    /// x_j, until every row adds up to A_i: symmetric matrix scaling, which keeps symmetry and
    /// zeros, makes nothing negative, and changes the factors least in the sense of relative entropy
    /// (P. A. Knight, D. Ruiz, B. Uçar, "A symmetry preserving algorithm for matrix scaling", SIAM
    /// J. Matrix Anal. Appl. 35, 2014). What a row loses to the open or to backs is scaled with it;
    /// an open share within its error of zero is taken to be zero. No total comes out above 1. What
    /// a factor was changed by is added to its error, in squares.
    pub fn enforced(&self) -> (ViewFactors, EnforcementReport) {
        let n = self.areas.len();
        let closed: Vec<bool> = (0..n).map(|i| self.is_closed(i)).collect();
        let mut rows = self.symmetric();
        let lost = |i: usize| {
            let open = if closed[i] { 0.0 } else { self.open[i].value };
            self.areas[i] * (open + self.back[i].value).max(0.0)
        };
        let lost: Vec<f64> = (0..n).map(lost).collect();
        let x = scaling(&rows, &lost, &self.areas);
        for (i, row) in rows.iter_mut().enumerate() {
            row.iter_mut().for_each(|(&j, flux)| *flux *= x[i] * x[j as usize]);
        }
        let total = |i: usize| (rows[i].values().sum::<f64>() + x[i] * lost[i]) / self.areas[i];
        // Below 1 by the rounding of a sum, so that no order of summation is above it.
        let most = (0..n).map(total).fold(1.0, f64::max) * (1.0 + f64::EPSILON * n as f64);
        let left = (0..n).map(|i| (total(i) - 1.0).abs()).fold(0.0, f64::max);
        let mut out = self.clone();
        let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
        for (i, row) in rows.iter().enumerate() {
            let area = self.areas[i];
            for (&j, &flux) in row {
                let value = flux / area / most;
                let change = value - self.factor(i, j as usize).value;
                (squares, count) = (squares + change * change, count + 1.0);
                worst = worst.max(change.abs());
                out.set(i, j, value);
            }
            let scale = x[i] / most;
            out.back[i].value = (self.back[i].value * scale).max(0.0);
            out.open[i].value = if closed[i] { 0.0 } else { (self.open[i].value * scale).max(0.0) };
        }
        let rms = if count > 0.0 { f64::sqrt(squares / count) } else { 0.0 };
        let closed = closed.iter().filter(|c| **c).count();
        (out, EnforcementReport { rms, worst, closed, left })
    }

    /// A_i F_ij, the same both ways.
    fn symmetric(&self) -> Vec<BTreeMap<u32, f64>> {
        let mut rows: Vec<BTreeMap<u32, f64>> = vec![BTreeMap::new(); self.areas.len()];
        for (i, row) in self.factors.iter().enumerate() {
            for f in row {
                let j = f.to as usize;
                let there = self.factor(j, i);
                let (a, b) = (self.areas[i], self.areas[j]);
                let (here, there, e, d) =
                    (a * f.value, b * there.value, a * f.error, b * there.error);
                let weight = if e * d > 0.0 { d * d / (e * e + d * d) } else { 0.5 };
                let flux = weight * here + (1.0 - weight) * there;
                let flux = flux.max(0.0);
                rows[i].insert(j as u32, flux);
                rows[j].insert(i as u32, flux);
            }
        }
        rows
    }

    fn set(&mut self, i: usize, to: u32, value: f64) {
        let row = &mut self.factors[i];
        match row.binary_search_by_key(&to, |f| f.to) {
            Ok(k) => {
                row[k].error = row[k].error.hypot(value - row[k].value);
                row[k].value = value;
            }
            Err(k) => {
                debug_assert_eq!(self.absent, Missing::NotSeen);
                row.insert(k, super::Factor { to, value, error: value });
            }
        }
    }
}

/// The x with x_i (Σ_j G_ij x_j + lost_i) = A_i, as closely as there is one.
fn scaling(rows: &[BTreeMap<u32, f64>], lost: &[f64], areas: &[f64]) -> Vec<f64> {
    let mut x = vec![1.0; areas.len()];
    for _ in 0..MOST_STEPS {
        let ratio = |i: usize| {
            let seen: f64 = rows[i].iter().map(|(&j, flux)| flux * x[j as usize]).sum();
            x[i] * (seen + lost[i]) / areas[i]
        };
        let ratios: Vec<f64> = (0..areas.len()).map(ratio).collect();
        if ratios.iter().all(|r| *r == 0.0 || (r - 1.0).abs() <= CLOSED) {
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
