//! The data that a method works on during one step of a session: flux, rows, counters, stop rules
//! and progress callback.
//!
//! A method takes rows from the cache, sends flux along them with [`StepContext::distribute`],
//! updates the counters and calls [`StepContext::report`] after each row. It does not depend on the
//! session that called it.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::Progress;
use super::flux_state::FluxState;
use super::row_cache::RowCache;
use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::mesh::NodeId;
use crate::progress::Instant;
use crate::scene::Rgb;

/// Counters of a solve.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Counters {
    /// In the unit of the method.
    pub steps: u64,
    /// Rows that light was sent along.
    pub shots: u64,
}

impl Counters {
    /// Progress of a solve that was started at `start`.
    pub fn progress(self, rows_made: u64, unshot_share: f64, start: Instant) -> Progress {
        let Counters { steps, shots } = self;
        Progress { steps, shots, rows_made, unshot_share, elapsed: start.elapsed() }
    }
}

/// Data of one step of a method.
pub(super) struct StepContext<'a, 'm> {
    pub state: &'a mut FluxState<'m>,
    pub rows: &'a mut RowCache,
    /// Source of the rows that are not cached.
    pub row_source: &'a mut dyn FormFactors,
    pub counters: &'a mut Counters,
    pub progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    pub start: Instant,
    /// Converged when no channel has more than this share of its emitted flux unshot.
    pub unshot: f64,
    /// See [`Solver::max_steps`](super::Solver::max_steps).
    pub max_steps: Option<u64>,
}

impl StepContext<'_, '_> {
    /// Recomputes the unshot flux, verifies the ledger, and returns whether the unshot share is as
    /// low as requested.
    ///
    /// # Errors
    /// Those of [`FluxState::recompute_and_verify_energy`].
    pub fn refresh_and_check_convergence(&mut self) -> Result<bool, Error> {
        self.state.recompute_and_verify_energy()?;
        Ok(self.state.ledger.unshot_share() <= self.unshot)
    }

    /// Whether the maximum number of steps is reached.
    pub fn has_done_all_steps(&self) -> bool {
        self.max_steps.is_some_and(|max| self.counters.steps >= max)
    }

    /// Sends `flux` (W), already removed from the unshot flux, along the row of `patch`.
    pub fn distribute(&mut self, flux: Rgb, patch: NodeId, row: &Row) {
        self.state.distribute(flux, row);
        self.rows.record_sent(patch, flux);
    }

    /// Reports progress; returns whether to continue.
    pub fn report(&mut self, unshot_share: f64) -> ControlFlow<()> {
        (self.progress)(&self.counters.progress(self.rows.rows_made, unshot_share, self.start))
    }
}
