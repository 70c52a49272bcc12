//! Gaussian elimination on the dense matrix: for small scenes, and as a reference for the other
//! methods.
//!
//! The matrix is 1 − M, with M_ji = ρ_j F_ij, plus the transmitted light. Its columns are
//! diagonally dominant, since no element sends out more light than it receives. So elimination
//! needs no pivoting, and no entry grows to more than twice the largest (Higham 2002, Theorem 9.9).
//! Each entry is a channel triple: one elimination solves all three. Elimination is by panels: the
//! rows of a panel one by one, then all rows below in parallel. The solution is then distributed
//! along the rows, so that its rounding error shows in the ledger.

use std::sync::Arc;

use rayon::prelude::*;

use super::flux_state::Flux;
use super::step::StepContext;
use crate::error::Error;
use crate::form_factor::Row;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// Rows of the matrix in a panel: a cache holds these and the row that they are subtracted from. At
/// [`DIRECT_MAX_ELEMENTS`](super::Solver::DIRECT_MAX_ELEMENTS) they take 1.6 MB.
const PANEL_ROWS: usize = 16;

/// Solves in one step. Keeps all rows regardless of the budget; they take less memory than the
/// matrix.
pub(super) fn solve_directly(step: &mut StepContext) -> Result<StopReason, Error> {
    if step.refresh_and_check_convergence()? {
        return Ok(StopReason::Converged);
    }
    if step.has_done_all_steps() {
        return Ok(StopReason::Steps);
    }
    let mesh = step.state.mesh;
    let Some(rows) = all_rows(step, mesh)? else { return Ok(StopReason::Cancelled) };
    let mut system = LinearSystem::new(&rows, &step.state.flux);
    for first in (0..system.count).step_by(PANEL_ROWS) {
        system.eliminate_panel(first);
        if step.report(1.0).is_break() {
            return Ok(StopReason::Cancelled);
        }
    }
    let sent = system.substitute_back();
    for (e, (flux, row)) in sent.into_iter().zip(rows).enumerate() {
        step.state.flux.unshot[e] -= flux;
        step.distribute(flux, mesh.element(e), &row);
        step.counters.shots += 1;
    }
    step.counters.steps += 1;
    Ok(StopReason::Converged)
}

/// The rows of all elements, or `None` when the callback stops the solver.
fn all_rows(step: &mut StepContext, mesh: &Mesh) -> Result<Option<Vec<Arc<Row>>>, Error> {
    let count = mesh.element_count();
    let mut rows: Vec<Arc<Row>> = vec![];
    while rows.len() < count {
        let elements = rows.len()..count;
        for (_, row) in step.rows.next_element_rows(mesh, step.row_source, elements)? {
            rows.push(row);
            if step.report(1.0).is_break() {
                return Ok(None);
            }
        }
    }
    Ok(Some(rows))
}

/// Equation j: x_j − ρ_j Σ_i F_ij x_i = r_j, with x the flux that each element sends and r the
/// unshot.
struct LinearSystem {
    count: usize,
    /// Row-major, `count` + 1 columns; the right-hand side is the last.
    matrix: Vec<Rgb>,
}

impl LinearSystem {
    fn new(rows: &[Arc<Row>], flux: &Flux) -> LinearSystem {
        let count = rows.len();
        let stride = count + 1;
        let mut matrix = vec![Rgb::ZERO; count * stride];
        for (i, row) in rows.iter().enumerate() {
            matrix[i * stride + i] = Rgb::ONE;
            matrix[i * stride + count] = flux.unshot[i];
            for (k, entry) in row.entries.iter().enumerate() {
                let j = entry.element as usize;
                let passed = row.passed.get(k).map_or(Rgb::ONE, |&p| Row::transmittance(p));
                let arrives = Row::form_factor(entry.share) * passed;
                matrix[j * stride + i] -= flux.reflectance[j] * arrives;
                for passage in flux.behind(j) {
                    let behind = passage.behind as usize;
                    matrix[behind * stride + i] -= passage.passed * arrives;
                }
            }
        }
        LinearSystem { count, matrix }
    }

    /// Eliminates the unknowns of one panel, from number `first` on, from all equations below.
    fn eliminate_panel(&mut self, first: usize) {
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
    fn substitute_back(&self) -> Vec<Rgb> {
        let mut x = vec![Rgb::ZERO; self.count];
        for (i, row) in self.matrix.chunks_exact(self.count + 1).enumerate().rev() {
            let known: Rgb = (i + 1..self.count).map(|j| row[j] * x[j]).sum();
            x[i] = (row[self.count] - known) / row[i];
        }
        x
    }
}

/// Eliminates the unknowns of `pivots`, the equations from number `first` on, from the equation
/// `row`.
fn eliminate(row: &mut [Rgb], pivots: &[Rgb], first: usize) {
    for (k, pivot) in (first..).zip(pivots.chunks_exact(row.len())) {
        let factor = row[k] / pivot[k];
        if factor != Rgb::ZERO {
            row[k..].iter_mut().zip(&pivot[k..]).for_each(|(a, p)| *a -= factor * *p);
        }
    }
}
