//! Sweeps over all elements: Jacobi and Gauss–Seidel.
//!
//! To relax an element is to pass on what it has unshot, so that its residual is 0. Gauss–Seidel
//! relaxes one element after another; Jacobi all at once, which makes a sweep a bounce of light;
//! always the one with most to pass on, Southwell's way, is shooting (Gortler, Cohen and Slusallek
//! 1994).

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::flux_state::FluxState;
use super::session::StepContext;
use crate::error::Error;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// Sweeps until done; a step is a sweep. After k sweeps of Jacobi what leaves is e + Me + … + Mᵏe.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Relaxation {
    /// What the elements had when the sweep began and have not passed on yet, if that is what they are
    /// to pass on: Jacobi's way. With none they pass on what they have when their turn comes.
    held: Option<Vec<Rgb>>,
    /// Whose turn it is: elements that emit have theirs first.
    turn: Turn,
}

/// A place in a sweep.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct Turn {
    sources: bool,
    element: usize,
}

/// Where a sweep begins.
const FIRST: Turn = Turn { sources: true, element: 0 };

impl Relaxation {
    /// Jacobi's way.
    pub fn jacobi(count: usize) -> Relaxation {
        Relaxation { held: Some(vec![Rgb::ZERO; count]), turn: FIRST }
    }

    /// Gauss–Seidel's.
    pub fn gauss_seidel() -> Relaxation {
        Relaxation { held: None, turn: FIRST }
    }

    /// Whether it fits `count` elements and that way, as one from a file may not.
    pub fn fits(&self, count: usize, jacobi: bool) -> bool {
        let all = |h: &Vec<Rgb>| h.len() == count && h.iter().all(|w| w.is_finite());
        self.turn.element <= count && self.held.as_ref().map_or(!jacobi, |h| jacobi && all(h))
    }

    /// Goes on by as many elements as one batch of rows reaches.
    pub fn advance(&mut self, batch: &mut StepContext) -> Result<Option<StopReason>, Error> {
        let count = batch.state.flux.unshot.len();
        let begins = self.turn.sources && self.turn.element == 0;
        if begins {
            if batch.has_converged()? {
                return Ok(Some(StopReason::Converged));
            }
            if batch.is_last_step() {
                return Ok(Some(StopReason::Steps));
            }
            if let Some(held) = &mut self.held {
                std::mem::swap(held, &mut batch.state.flux.unshot);
            }
        }
        let sources = self.turn.sources;
        let flux = &batch.state.flux;
        let due = |e: &usize| match &self.held {
            Some(held) => held[*e] != Rgb::ZERO,
            // What is black never has anything to pass on, unless it emits less than it did.
            None => flux.reflectance[*e] != Rgb::ZERO || flux.unshot[*e] != Rgb::ZERO,
        };
        let emits = |e: &usize| flux.emitted[*e] != Rgb::ZERO;
        let these = (self.turn.element..count).filter(|e| emits(e) == sources).filter(due);
        let rows = batch.rows.next(batch.state.mesh, batch.maker, these)?;
        if rows.is_empty() {
            self.turn = Turn { sources: !sources, element: 0 };
            batch.done.steps += u64::from(!sources);
        }
        for (e, row) in rows {
            let from = self.held.as_mut().unwrap_or(&mut batch.state.flux.unshot);
            let flux = std::mem::take(&mut from[e]);
            self.turn.element = e + 1;
            if flux != Rgb::ZERO {
                batch.pass_on(flux, batch.state.mesh.element(e), &row);
                batch.done.shots += 1;
            }
            let unshot_share = batch.state.ledger.unshot_share();
            if batch.tell(unshot_share) == ControlFlow::Break(()) {
                return Ok(Some(StopReason::Cancelled));
            }
        }
        Ok(None)
    }

    /// Hands back what is held, and begins anew.
    pub fn finish(&mut self, state: &mut FluxState) {
        let held = self.held.iter_mut().flatten();
        state.flux.unshot.iter_mut().zip(held).for_each(|(u, h)| *u += std::mem::take(h));
        self.turn = FIRST;
    }
}
