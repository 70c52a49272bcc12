//! Restarted GMRES (Saad and Schultz 1986).
//!
//! A cycle searches the Krylov space of the residual r, Ar, A²r … for the step that minimizes the
//! remaining residual:
//!
//! 1. v₀ = r/|r|; product: w = A v_k, made by the caller;
//! 2. modified Gram–Schmidt: w = Σ h_ik v_i + h_{k+1,k} v_{k+1}, a column of the Hessenberg matrix;
//! 3. Givens rotations bring the Hessenberg matrix to the triangle R, and r to the vector g, whose
//!    last component is the norm of the residual;
//! 4. after the last product: R y = g, and the step is Σ y_k v_k.

use std::ops::ControlFlow;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Value;

/// Default number of products in a cycle, and of stored vectors. Plain choice, on which results
/// hardly depend: solves typically take some 10.
pub const RESTART: usize = 50;

/// Numbers summed sequentially in one chunk: the order does not depend on the number of threads.
const CHUNK: usize = 4096;

/// One cycle of all channels at once: a linear system per channel. A channel that has converged
/// continues with vectors of 0.
///
/// The order of the fields is that of the file format of saved solves.
#[derive(Clone, Serialize, Deserialize)]
pub struct Cycle<T, R> {
    /// Weight of each unknown in the inner product.
    weights: Vec<f64>,
    /// v: orthonormal vectors, the first along the residual; one more than there are products.
    basis: Vec<Vec<T>>,
    /// What the caller stores of each product.
    pub records: R,
    /// Columns of the Hessenberg matrix: A times each basis vector but the last, in the basis.
    hessenberg: Vec<Vec<T>>,
    /// Columns of R: the Hessenberg matrix after the rotations.
    r_factor: Vec<Vec<T>>,
    /// Cosine and sine of each Givens rotation.
    rotations: Vec<[T; 2]>,
    /// Norm of the residual when the cycle began.
    pub initial_norm: T,
    /// g: the initial residual in the basis, after the rotations. The last is the norm of the
    /// residual.
    rotated_residual: Vec<T>,
}

impl<T: Value, R> Cycle<T, R> {
    /// Before the first product, with this `residual`.
    pub fn new(mut residual: Vec<T>, weights: Vec<f64>, records: R) -> Cycle<T, R> {
        // Scaled by the largest, so that squares neither overflow nor underflow.
        let abs_max = |max: T, r: &T| max.zip(*r, |max, r| max.max(r.abs()));
        let largest = residual.iter().fold(T::default(), abs_max);
        residual.iter_mut().for_each(|r| *r = r.ratio(largest));
        let norm = norm(&weights, &residual);
        residual.iter_mut().for_each(|r| *r = r.ratio(norm));
        let initial_norm = norm * largest;
        Cycle {
            weights,
            basis: vec![residual],
            records,
            hessenberg: vec![],
            r_factor: vec![],
            rotations: vec![],
            initial_norm,
            rotated_residual: vec![initial_norm],
        }
    }

    /// Products done so far.
    pub fn products(&self) -> usize {
        self.r_factor.len()
    }

    /// The basis vector whose product is next.
    pub fn newest(&self) -> &[T] {
        &self.basis[self.products()]
    }

    /// Norm of the residual after the products so far.
    pub fn residual_norm(&self) -> T {
        self.rotated_residual[self.products()].each(f64::abs)
    }

    /// Appends the `product` of the newest basis vector: its component orthogonal to the basis is
    /// the next basis vector.
    pub fn extend(&mut self, mut product: Vec<T>) {
        // One pass of modified Gram–Schmidt is enough for GMRES (Paige, Rozložník and Strakoš
        // 2006).
        let whole = norm(&self.weights, &product);
        let mut column = vec![];
        for v in &self.basis {
            let along = dot(&self.weights, v, &product);
            product.par_iter_mut().zip(v).for_each(|(w, &v)| *w -= along * v);
            column.push(along);
        }
        // Where the product is in the basis, only rounding is left, less than 8 steps of each
        // vector; as a direction it would make R singular.
        let rounding = 8.0 * column.len() as f64 * f64::EPSILON;
        let norm = norm(&self.weights, &product);
        let norm = norm.zip(whole, |norm, whole| if norm <= rounding * whole { 0.0 } else { norm });
        column.push(norm);
        product.iter_mut().for_each(|w| *w = w.ratio(norm));
        self.basis.push(product);
        self.hessenberg.push(column.clone());
        self.rotate(column);
    }

    /// Applies the rotations so far to the newest `column` of the Hessenberg matrix, and a new one
    /// that makes its last entry 0.
    fn rotate(&mut self, mut column: Vec<T>) {
        let k = self.products();
        for (i, &[c, s]) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let norm = column[k + 1];
        let radius = (column[k] * column[k] + norm * norm).each(f64::sqrt);
        let [c, s] = [column[k].ratio(radius), norm.ratio(radius)];
        let residual = self.rotated_residual[k];
        self.rotated_residual[k] = c * residual;
        self.rotated_residual.push(-s * residual);
        column[k] = radius;
        column.pop();
        self.r_factor.push(column);
        self.rotations.push([c, s]);
    }

    /// y: the factors of the basis vectors in the step that minimizes the residual.
    pub fn step(&self) -> Vec<T> {
        let count = self.products();
        let mut y = vec![T::default(); count];
        for i in (0..count).rev() {
            let known: T = (i + 1..count).map(|k| self.r_factor[k][i] * y[k]).sum();
            y[i] = (self.rotated_residual[i] - known).ratio(self.r_factor[i][i]);
        }
        y
    }

    /// Adds the step Σ y_k v_k to `x`.
    pub fn add_step(&self, y: &[T], x: &mut [T]) {
        add_combination(x, y, &self.basis);
    }

    /// Subtracts the product of A and the step from `residual`.
    pub fn subtract_product(&self, y: &[T], residual: &mut [T]) {
        let mut in_basis = vec![T::default(); self.basis.len()];
        for (column, &y) in self.hessenberg.iter().zip(y) {
            in_basis.iter_mut().zip(column).for_each(|(sum, &h)| *sum -= h * y);
        }
        add_combination(residual, &in_basis, &self.basis);
    }

    /// Whether all vectors satisfy `is_vector` and their numbers are right; a cycle that was read
    /// from a file may be wrong.
    pub fn is_consistent(&self, is_vector: impl Fn(&[T]) -> bool) -> bool {
        let count = self.products();
        // Column k has k + 1 entries plus those below the diagonal.
        let are_columns = |columns: &[Vec<T>], below: usize| {
            let lengths = columns.iter().map(Vec::len);
            columns.len() == count && lengths.enumerate().all(|(k, len)| len == k + 1 + below)
        };
        self.basis.len() == count + 1
            && self.rotations.len() == count
            && self.rotated_residual.len() == count + 1
            && are_columns(&self.hessenberg, 1)
            && are_columns(&self.r_factor, 0)
            && self.basis.iter().all(|v| is_vector(v))
            && self.weights.len() == self.basis[0].len()
    }
}

/// Adds Σ factor × vector to `sum`.
pub fn add_combination<T: Value>(sum: &mut [T], factors: &[T], vectors: &[Vec<T>]) {
    for (&factor, vector) in factors.iter().zip(vectors) {
        sum.iter_mut().zip(vector).for_each(|(sum, &v)| *sum += factor * v);
    }
}

/// Σ weight a b by channel, the same bits for any number of threads.
fn dot<T: Value>(weights: &[f64], a: &[T], b: &[T]) -> T {
    let chunks = weights.par_chunks(CHUNK).zip(a.par_chunks(CHUNK)).zip(b.par_chunks(CHUNK));
    let product = |((&w, a), &b): ((&f64, &T), &T)| a.each(|a| w * a) * b;
    let sums: Vec<T> =
        chunks.map(|((w, a), b)| w.iter().zip(a).zip(b).map(product).sum()).collect();
    sums.into_iter().sum()
}

/// √ Σ weight a² by channel.
fn norm<T: Value>(weights: &[f64], a: &[T]) -> T {
    dot(weights, a, a).each(f64::sqrt)
}

/// Statistics of a solve.
pub struct Solved {
    /// Norm of the residual over that of the right-hand side.
    pub residual: f64,
    /// Number of products.
    pub products: usize,
}

/// Improves `x` until A x = `right` to rounding, or until a cycle gains nothing.
///
/// `product` is A. Norms weight each number by `weights`. `progress` is called with the residual,
/// over the norm of `right`, after every product; `None` if it breaks.
pub fn solve(
    mut product: impl FnMut(&[f64]) -> Vec<f64>,
    right: &[f64],
    weights: &[f64],
    x: &mut [f64],
    mut progress: impl FnMut(f64) -> ControlFlow<()>,
) -> Option<Solved> {
    let scale = norm(weights, right);
    if scale == 0.0 {
        x.fill(0.0);
        return Some(Solved { residual: 0.0, products: 0 });
    }
    let (mut products, mut before) = (0, f64::INFINITY);
    loop {
        let mut residual = product(x);
        residual.iter_mut().zip(right).for_each(|(ax, b)| *ax = b - *ax);
        products += 1;
        let length = norm(weights, &residual);
        if progress(length / scale).is_break() {
            return None;
        }
        let is_exact = length <= f64::EPSILON * scale;
        // The last cycle has reached rounding if it gains less than a digit.
        let is_rounding = length > 0.1 * before && length < 1e-10 * scale;
        // A cycle with as many products as unknowns is exact: a cycle without a gain ends the
        // solve. So do numbers that are not finite.
        if is_exact || is_rounding || length >= before || !length.is_finite() {
            return Some(Solved { residual: length / scale, products });
        }
        before = length;
        let mut cycle = Cycle::new(residual, weights.to_vec(), ());
        while cycle.products() < RESTART && cycle.residual_norm() > f64::EPSILON * length {
            cycle.extend(product(cycle.newest()));
            products += 1;
            if progress(cycle.residual_norm() / scale).is_break() {
                return None;
            }
            if cycle.residual_norm() <= f64::EPSILON * scale {
                break;
            }
        }
        cycle.add_step(&cycle.step(), x);
    }
}
