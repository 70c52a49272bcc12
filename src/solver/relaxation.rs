//! Sweeps over all elements: Jacobi and Gauss–Seidel.
//!
//! To relax an element is to pass on its unshot flux, so that its residual is 0. A sweep relaxes
//! every element once, emitters first, then all others, each by ascending index:
//!
//! - **Jacobi** sets all unshot flux aside when a sweep begins and passes on that: flux that
//!   arrives meanwhile waits for the next sweep, so that a sweep is a bounce of light. After k
//!   sweeps the leaving flux is e + Me + … + Mᵏe.
//! - **Gauss–Seidel** passes on the flux that an element has when the sweep reaches it.
//!
//! Always relaxing the element with most unshot flux, Southwell's method, is shooting (Gortler,
//! Cohen and Slusallek 1994).

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::flux_state::FluxState;
use super::step::StepContext;
use crate::error::Error;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// A sweep in progress; a step is a sweep.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Relaxation {
    /// With Jacobi, the flux that each element had when the sweep began and has not passed on yet,
    /// W.
    jacobi_snapshot: Option<Vec<Rgb>>,
    cursor: SweepCursor,
}

/// A position in a sweep.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct SweepCursor {
    /// Whether in the first half, that of emitters.
    emitters: bool,
    /// Elements below this index are done in that half.
    element: usize,
}

impl SweepCursor {
    /// Start of a sweep.
    const START: SweepCursor = SweepCursor { emitters: true, element: 0 };
}

impl Relaxation {
    /// The state before the first sweep of Jacobi over `count` elements.
    pub fn jacobi(count: usize) -> Relaxation {
        Relaxation { jacobi_snapshot: Some(vec![Rgb::ZERO; count]), cursor: SweepCursor::START }
    }

    /// The state before the first sweep of Gauss–Seidel.
    pub fn gauss_seidel() -> Relaxation {
        Relaxation { jacobi_snapshot: None, cursor: SweepCursor::START }
    }

    /// Whether this is a valid state over `count` elements of Jacobi or else Gauss–Seidel; one that
    /// was read from a file may not be.
    pub fn is_consistent(&self, count: usize, jacobi: bool) -> bool {
        let snapshot_fits = match &self.jacobi_snapshot {
            Some(flux) => jacobi && flux.len() == count && flux.iter().all(|w| w.is_finite()),
            None => !jacobi,
        };
        self.cursor.element <= count && snapshot_fits
    }

    /// Advances by as many elements as one batch of rows covers.
    pub fn advance(&mut self, step: &mut StepContext) -> Result<Option<StopReason>, Error> {
        let at_start = self.cursor.emitters && self.cursor.element == 0;
        if at_start {
            if step.refresh_and_check_convergence()? {
                return Ok(Some(StopReason::Converged));
            }
            if step.has_done_all_steps() {
                return Ok(Some(StopReason::Steps));
            }
            if let Some(snapshot) = &mut self.jacobi_snapshot {
                std::mem::swap(snapshot, &mut step.state.flux.unshot);
            }
        }
        let SweepCursor { emitters, element } = self.cursor;
        let flux = &step.state.flux;
        let emits = |e: &usize| flux.emitted[*e] != Rgb::ZERO;
        let may_have_light = |e: &usize| match &self.jacobi_snapshot {
            Some(snapshot) => snapshot[*e] != Rgb::ZERO,
            // A black element has nothing to pass on, unless its emission was reduced.
            None => flux.reflectance[*e] != Rgb::ZERO || flux.unshot[*e] != Rgb::ZERO,
        };
        let elements =
            (element..flux.unshot.len()).filter(|e| emits(e) == emitters).filter(may_have_light);
        let rows = step.rows.next_element_rows(step.state.mesh, step.row_source, elements)?;
        if rows.is_empty() {
            self.cursor = SweepCursor { emitters: !emitters, element: 0 };
            step.counters.steps += u64::from(!emitters);
        }
        for (e, row) in rows {
            let unshot = self.jacobi_snapshot.as_mut().unwrap_or(&mut step.state.flux.unshot);
            let flux = std::mem::take(&mut unshot[e]);
            self.cursor.element = e + 1;
            if flux != Rgb::ZERO {
                step.distribute(flux, step.state.mesh.element(e), &row);
                step.counters.shots += 1;
            }
            let unshot_share = step.state.ledger.unshot_share();
            if step.report(unshot_share) == ControlFlow::Break(()) {
                return Ok(Some(StopReason::Cancelled));
            }
        }
        Ok(None)
    }

    /// Returns the flux set aside to `state`, and begins a new sweep.
    pub fn finish(&mut self, state: &mut FluxState) {
        let snapshot = self.jacobi_snapshot.iter_mut().flatten();
        for (unshot, flux) in state.flux.unshot.iter_mut().zip(snapshot) {
            *unshot += std::mem::take(flux);
        }
        self.cursor = SweepCursor::START;
    }
}
