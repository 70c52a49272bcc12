//! Gaussian elimination on the dense matrix: for small scenes, and as a reference for the other
//! methods.
//!
//! The matrix is 1 − M, with M_ji = ρ_j F_ij, plus the transmitted light. Its columns are
//! diagonally dominant, since no element sends out more light than it receives. The solution is
//! distributed along the rows, so that its rounding error shows in the ledger.

use std::sync::Arc;

use super::flux_state::Flux;
use super::step::StepContext;
use crate::error::Error;
use crate::form_factor::Row;
use crate::linear::elimination::DenseSystem;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;

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
    let mut system = linear_system(&rows, &step.state.flux);
    for first in system.panels() {
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
fn linear_system(rows: &[Arc<Row>], flux: &Flux) -> DenseSystem {
    let mut system = DenseSystem::identity(&flux.unshot);
    for (i, row) in rows.iter().enumerate() {
        for (k, entry) in row.entries.iter().enumerate() {
            let j = entry.element as usize;
            let passed = row.passed.get(k).map_or(Rgb::ONE, |&p| Row::transmittance(p));
            let arrives = Row::form_factor(entry.share) * passed;
            *system.entry(j, i) -= flux.reflectance[j] * arrives;
            for passage in flux.behind(j) {
                *system.entry(passage.behind as usize, i) -= passage.passed * arrives;
            }
        }
    }
    system
}
