//! Gaussian elimination on the dense matrix: for small scenes, and to judge the other methods.
//!
//! The columns of 1 − M are diagonally dominant, since no element sends out more than its light. So
//! elimination needs no pivots, and no entry grows to more than twice the largest (Higham 2002,
//! Theorem 9.9). Each entry is a channel triple: one elimination solves all three.

use std::rc::Rc;

use rayon::prelude::*;

use super::Stop;
use super::run::Run;
use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::scene::Rgb;

/// Elements that a direct solve takes at most: its matrix has 24 bytes an entry, 400 MB in all.
pub const MAX_DIRECT: usize = 4096;

/// Pivot rows that are taken at once, as many as a cache holds beside the row that they are taken
/// from.
const PANEL: usize = 16;

/// Solves all at once. Keeps its rows whatever the budget; they take less than the matrix.
pub(super) fn direct(run: &mut Run, steps: Option<u64>) -> Result<Stop, Error> {
    let count = run.state.reflectance.len();
    if count > MAX_DIRECT {
        let remedy = format!("at most {MAX_DIRECT}: use another method, such as gmres");
        let found = format!("{count} elements");
        return Err(Error::new(ErrorKind::Setting, "direct solve", found, remedy));
    }
    if run.has_converged()? {
        return Ok(Stop::Converged);
    }
    if steps == Some(0) {
        return Ok(Stop::Steps);
    }
    let elements: Vec<usize> = (0..count).collect();
    let mut rows: Vec<Rc<Row>> = vec![];
    while rows.len() < count {
        for row in run.rows.next(&elements[rows.len()..])? {
            rows.push(row);
            if run.tell(1.0).is_break() {
                return Ok(Stop::Cancelled);
            }
        }
    }
    // Equation j: x_j − ρ_j Σ_i F_ij x_i = e_j, with e_j at its end.
    let stride = count + 1;
    let mut matrix = vec![Rgb::ZERO; count * stride];
    for (i, row) in rows.iter().enumerate() {
        (matrix[i * stride + i], matrix[i * stride + count]) = (Rgb::ONE, run.state.flux.unshot[i]);
        for entry in &row.entries {
            let j = entry.element as usize;
            matrix[j * stride + i] -= run.state.reflectance[j] * Row::form_factor(entry.share);
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
        if run.tell(1.0).is_break() {
            return Ok(Stop::Cancelled);
        }
    }
    let mut flux = vec![Rgb::ZERO; count];
    for (i, row) in matrix.chunks_exact(stride).enumerate().rev() {
        let known: Rgb = (i + 1..count).map(|j| row[j] * flux[j]).sum();
        flux[i] = (row[count] - known) / row[i];
    }
    for (e, (flux, row)) in flux.into_iter().zip(rows).enumerate() {
        run.state.flux.unshot[e] -= flux;
        run.state.pass_on(flux, &row);
        run.shots += 1;
    }
    run.steps = 1;
    Ok(Stop::Converged)
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
