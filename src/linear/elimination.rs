//! Gaussian elimination on a dense matrix whose columns are diagonally dominant.
//!
//! Such a matrix needs no pivoting, and no entry grows to more than twice the largest (Higham 2002,
//! Theorem 9.9). Each entry is a channel triple: one elimination solves all three systems. It is by
//! panels: the rows of a panel one by one, then all rows below in parallel.

use glam::DVec3;
use rayon::prelude::*;

/// Rows of the matrix in a panel: a cache holds these and the row that they are subtracted from.
/// With 4096 unknowns they take 1.6 MB.
const PANEL_ROWS: usize = 16;

/// Equations with as many unknowns.
pub struct DenseSystem {
    count: usize,
    /// Row-major, `count` + 1 columns; the right-hand side is the last.
    matrix: Vec<DVec3>,
}

impl DenseSystem {
    /// x = `right`.
    pub fn identity(right: &[DVec3]) -> DenseSystem {
        let count = right.len();
        let mut system = DenseSystem { count, matrix: vec![DVec3::ZERO; count * (count + 1)] };
        for (i, &right) in right.iter().enumerate() {
            *system.entry(i, i) = DVec3::ONE;
            *system.entry(i, count) = right;
        }
        system
    }

    /// The factor of unknown `column` in equation `row`.
    pub fn entry(&mut self, row: usize, column: usize) -> &mut DVec3 {
        &mut self.matrix[row * (self.count + 1) + column]
    }

    /// The first unknown of every panel, in the order of [`DenseSystem::eliminate_panel`].
    pub fn panels(&self) -> impl Iterator<Item = usize> + use<> {
        (0..self.count).step_by(PANEL_ROWS)
    }

    /// Eliminates the unknowns of one panel, from number `first` on, from all equations below.
    pub fn eliminate_panel(&mut self, first: usize) {
        let stride = self.count + 1;
        let end = (first + PANEL_ROWS).min(self.count);
        let (above, below) = self.matrix.split_at_mut(end * stride);
        let panel = &mut above[first * stride..];
        for k in 1..panel.len() / stride {
            let (pivots, remaining) = panel.split_at_mut(k * stride);
            eliminate(&mut remaining[..stride], pivots, first);
        }
        below.par_chunks_mut(stride).for_each(|row| eliminate(row, panel, first));
    }

    /// Solves for the unknowns, once all panels are eliminated.
    pub fn substitute_back(&self) -> Vec<DVec3> {
        let mut x = vec![DVec3::ZERO; self.count];
        for (i, row) in self.matrix.chunks_exact(self.count + 1).enumerate().rev() {
            let known: DVec3 = (i + 1..self.count).map(|j| row[j] * x[j]).sum();
            x[i] = (row[self.count] - known) / row[i];
        }
        x
    }
}

/// Eliminates the unknowns of `pivots`, the equations from number `first` on, from the equation
/// `row`.
fn eliminate(row: &mut [DVec3], pivots: &[DVec3], first: usize) {
    for (k, pivot) in (first..).zip(pivots.chunks_exact(row.len())) {
        let factor = row[k] / pivot[k];
        if factor != DVec3::ZERO {
            row[k..].iter_mut().zip(&pivot[k..]).for_each(|(a, p)| *a -= factor * *p);
        }
    }
}
