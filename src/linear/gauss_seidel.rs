//! Gauss–Seidel within blocks of unknowns, Jacobi between them: one thread sweeps a block. With
//! blocks of one unknown it is Jacobi's iteration, which treats all unknowns alike.

use rayon::prelude::*;

/// Unknowns of a block, for few sweeps. The size is the same on any number of cores, and so are the
/// bits of the result.
///
/// Large blocks take fewer sweeps; small ones give more cores work, of which there are as many as
/// blocks. Sweeps over 40 000 unknowns that depend on 30 others each, with row sums of 0.95:
///
/// ```text
/// unknowns of a block    others anywhere    others within 50 numbers
///              40 000                 77                          88
///               4 096                132                          90
///                   1                138                         155
/// ```
///
/// Plain choice between these: ten blocks for every 40 000 unknowns.
pub const BLOCK: usize = 4096;

/// The equations x_k = f_k(x), where each unknown has several numbers.
pub trait Equations: Sync {
    /// Writes f_k to `value`; `x` is the value of an unknown, by its index.
    fn evaluate<'x>(&self, k: usize, x: impl Fn(usize) -> &'x [f64], value: &mut [f64]);
}

/// The values after one sweep over all unknowns in their order, by blocks of `block`, from the
/// values `before`, each of `width` numbers. Values of earlier unknowns of the same block are those
/// of this sweep.
///
/// If rows of f sum to at most c < 1, a sweep that changes no number by more than δ leaves an error
/// of at most δ c / (1 − c) of any.
pub fn sweep(
    equations: &(impl Equations + ?Sized),
    before: &[f64],
    width: usize,
    block: usize,
) -> Vec<f64> {
    let mut after = before.to_vec();
    let blocks = after.par_chunks_mut(block * width).enumerate();
    blocks.for_each(|(k, values)| sweep_block(equations, before, width, k * block, values));
    after
}

/// The same for the block from the unknown `first` on, whose `values` are those before, and become
/// those after.
pub fn sweep_block(
    equations: &(impl Equations + ?Sized),
    before: &[f64],
    width: usize,
    first: usize,
    values: &mut [f64],
) {
    let mut value = vec![0.0; width];
    for k in 0..values.len() / width {
        let x = |j: usize| {
            let of_block = j.checked_sub(first).map(|j| j * width..(j + 1) * width);
            let of_block = of_block.and_then(|range| values.get(range));
            of_block.unwrap_or_else(|| &before[j * width..][..width])
        };
        equations.evaluate(first + k, x, &mut value);
        values[k * width..][..width].copy_from_slice(&value);
    }
}
