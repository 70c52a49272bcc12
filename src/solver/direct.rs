//! Gaussian elimination on the dense matrix: for small scenes, and to judge the other methods.
//!
//! The columns of 1 − M are diagonally dominant, since no element sends out more than its light. So
//! elimination needs no pivots, and no entry grows to more than twice the largest (Higham 2002,
//! Theorem 9.9). Each entry is a channel triple: one elimination solves all three.

use std::sync::Arc;

use rayon::prelude::*;

use super::session::StepContext;
use crate::error::Error;
use crate::form_factor::Row;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// Pivot rows that are taken at once, as many as a cache holds beside the row that they are taken
/// from.
const PANEL: usize = 16;

/// Solves all at once. Keeps its rows whatever the budget; they take less than the matrix.
pub(super) fn direct(batch: &mut StepContext) -> Result<StopReason, Error> {
    if batch.has_converged()? {
        return Ok(StopReason::Converged);
    }
    if batch.is_last_step() {
        return Ok(StopReason::Steps);
    }
    let mesh = batch.state.mesh;
    let count = mesh.element_count();
    let mut rows: Vec<Arc<Row>> = vec![];
    while rows.len() < count {
        for (_, row) in batch.rows.next(mesh, batch.maker, rows.len()..count)? {
            rows.push(row);
            if batch.tell(1.0).is_break() {
                return Ok(StopReason::Cancelled);
            }
        }
    }
    // Equation j: x_j − ρ_j Σ_i F_ij x_i = e_j, with e_j at its end.
    let stride = count + 1;
    let flux = &batch.state.flux;
    let mut matrix = vec![Rgb::ZERO; count * stride];
    for (i, row) in rows.iter().enumerate() {
        (matrix[i * stride + i], matrix[i * stride + count]) = (Rgb::ONE, flux.unshot[i]);
        for entry in &row.entries {
            let j = entry.element as usize;
            matrix[j * stride + i] -= flux.reflectance[j] * Row::form_factor(entry.share);
        }
    }
    for first in (0..count).step_by(PANEL) {
        let (done, below) = matrix.split_at_mut((first + PANEL).min(count) * stride);
        let panel = &mut done[first * stride..];
        for k in 1..panel.len() / stride {
            let (above, rest) = panel.split_at_mut(k * stride);
            eliminate(&mut rest[..stride], above, first);
        }
        below.par_chunks_mut(stride).for_each(|row| eliminate(row, panel, first));
        if batch.tell(1.0).is_break() {
            return Ok(StopReason::Cancelled);
        }
    }
    let mut sent = vec![Rgb::ZERO; count];
    for (i, row) in matrix.chunks_exact(stride).enumerate().rev() {
        let known: Rgb = (i + 1..count).map(|j| row[j] * sent[j]).sum();
        sent[i] = (row[count] - known) / row[i];
    }
    for (e, (flux, row)) in sent.into_iter().zip(rows).enumerate() {
        batch.state.flux.unshot[e] -= flux;
        batch.pass_on(flux, mesh.element(e), &row);
        batch.done.shots += 1;
    }
    batch.done.steps += 1;
    Ok(StopReason::Converged)
}

/// Takes the `pivots`, equations from number `first` on, off the equation `row`, so that it has none
/// of their unknowns.
fn eliminate(row: &mut [Rgb], pivots: &[Rgb], first: usize) {
    for (k, pivot) in (first..).zip(pivots.chunks_exact(row.len())) {
        let factor = row[k] / pivot[k];
        if factor != Rgb::ZERO {
            row[k..].iter_mut().zip(&pivot[k..]).for_each(|(a, p)| *a -= factor * *p);
        }
    }
}
