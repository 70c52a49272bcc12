//! Restarted GMRES (Y. Saad, M. H. Schultz 1986) for a system given by its product.

use std::ops::ControlFlow;

use rayon::prelude::*;

/// Products in a cycle, and number of stored vectors.
const RESTART: usize = 60;

/// Numbers summed sequentially in one chunk: the order does not depend on the number of threads.
const CHUNK: usize = 4096;

/// Statistics of a solve.
pub(super) struct Solved {
    /// Norm of the residual over that of the right-hand side.
    pub residual: f64,
    pub products: usize,
}

/// Improves `x` until A x = `right` to rounding, or until a cycle gains nothing.
///
/// `product` is A. Norms weight each number by `weights`. `progress` is called with the residual,
/// over the norm of `right`, after every product; `None` if it breaks.
pub(super) fn solve(
    mut product: impl FnMut(&[f64]) -> Vec<f64>,
    right: &[f64],
    weights: &[f64],
    x: &mut [f64],
    mut progress: impl FnMut(f64) -> ControlFlow<()>,
) -> Option<Solved> {
    let norm = |v: &[f64]| dot(v, v, weights).sqrt();
    let scale = norm(right);
    if scale == 0.0 {
        x.fill(0.0);
        return Some(Solved { residual: 0.0, products: 0 });
    }
    let (mut products, mut before) = (0, f64::INFINITY);
    loop {
        let mut residual = product(x);
        residual.iter_mut().zip(right).for_each(|(ax, b)| *ax = b - *ax);
        products += 1;
        let length = norm(&residual);
        if progress(length / scale).is_break() {
            return None;
        }
        // The last cycle has reached rounding if it gains less than a digit.
        if length <= f64::EPSILON * scale || length > 0.1 * before && length < 1e-10 * scale {
            return Some(Solved { residual: length / scale, products });
        }
        // A cycle with as many products as unknowns is exact: a cycle without a gain ends the
        // solve. So do numbers that are not finite.
        if length >= before || !length.is_finite() {
            return Some(Solved { residual: length / scale, products });
        }
        before = length;
        let mut cycle = Cycle::new(residual, length);
        while cycle.basis.len() <= RESTART && cycle.left() > f64::EPSILON * length {
            let image = product(&cycle.basis[cycle.basis.len() - 1]);
            products += 1;
            let goes_on = cycle.extend(image, weights);
            if progress(cycle.left() / scale).is_break() {
                return None;
            }
            if !goes_on || cycle.left() <= f64::EPSILON * scale {
                break;
            }
        }
        cycle.add_to(x);
    }
}

/// A cycle of products.
struct Cycle {
    /// Orthonormal, the first along the residual; one more than there are columns.
    basis: Vec<Vec<f64>>,
    /// Columns of the triangle R.
    columns: Vec<Vec<f64>>,
    /// Cosine and sine of each Givens rotation.
    rotations: Vec<(f64, f64)>,
    /// The residual in the basis, rotated; the last entry is the norm of the new residual.
    rotated: Vec<f64>,
}

impl Cycle {
    fn new(mut residual: Vec<f64>, length: f64) -> Cycle {
        residual.iter_mut().for_each(|r| *r /= length);
        Cycle { basis: vec![residual], columns: vec![], rotations: vec![], rotated: vec![length] }
    }

    /// Norm of the residual with the vectors so far.
    fn left(&self) -> f64 {
        self.rotated[self.rotated.len() - 1].abs()
    }

    /// Adds the image of the newest vector; false where it is in the basis to rounding.
    fn extend(&mut self, mut image: Vec<f64>, weights: &[f64]) -> bool {
        let before = dot(&image, &image, weights).sqrt();
        let mut column = vec![0.0; self.basis.len()];
        // Twice, so that the basis stays orthogonal to rounding.
        for _ in 0..2 {
            for (h, v) in column.iter_mut().zip(&self.basis) {
                let along = dot(&image, v, weights);
                image.par_iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
                *h += along;
            }
        }
        let beyond = dot(&image, &image, weights).sqrt();
        for (k, &(c, s)) in self.rotations.iter().enumerate() {
            let (a, b) = (column[k], column[k + 1]);
            (column[k], column[k + 1]) = (c * a + s * b, c * b - s * a);
        }
        let k = self.rotations.len();
        let radius = column[k].hypot(beyond);
        if radius == 0.0 {
            return false;
        }
        let (c, s) = (column[k] / radius, beyond / radius);
        column[k] = radius;
        let left = self.rotated[k];
        self.rotated[k] = c * left;
        self.rotated.push(-s * left);
        self.rotations.push((c, s));
        self.columns.push(column);
        let goes_on = beyond > f64::EPSILON * before;
        if goes_on {
            image.iter_mut().for_each(|w| *w /= beyond);
            self.basis.push(image);
        }
        goes_on
    }

    /// Adds to `x` the combination of the vectors that minimizes the residual.
    fn add_to(&self, x: &mut [f64]) {
        let n = self.columns.len();
        let mut factors = self.rotated[..n].to_vec();
        for k in (0..n).rev() {
            factors[k] /= self.columns[k][k];
            let factor = factors[k];
            factors[..k].iter_mut().zip(&self.columns[k]).for_each(|(f, r)| *f -= factor * r);
        }
        for (factor, v) in factors.iter().zip(&self.basis) {
            x.iter_mut().zip(v).for_each(|(x, v)| *x += factor * v);
        }
    }
}

/// Σ w a b, the same bits for any number of threads.
fn dot(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let chunks = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).zip(weights.par_chunks(CHUNK));
    let sums: Vec<f64> = chunks
        .map(|((a, b), w)| a.iter().zip(b).zip(w).map(|((a, b), w)| w * a * b).sum())
        .collect();
    sums.iter().sum()
}
