//! Progressive shooting (Cohen, Chen, Wallace and Greenberg 1988) in f64.
//!
//! Repeatedly, the patch with most unshot flux sends it along its row: Southwell's relaxation
//! (Gortler, Cohen and Slusallek 1994). One step here:
//!
//! 1. the [`PatchCut`] selects the next shots, as many as need one batch of new rows;
//! 2. the missing rows are computed, all of a batch at once;
//! 3. each patch whose new row shows that it is too large for its light, or that its viewpoint is
//!    inside a solid, is split or gets another viewpoint instead of shooting;
//! 4. each other patch shoots: its unshot flux is distributed along its row.
//!
//! With overshoot (Feda and Purgathofer 1992) a patch also sends light that it has not received
//! yet.

use std::ops::Range;
use std::sync::Arc;

use super::Solver;
use super::flux_state::FluxState;
use super::patch_cut::{CutSnapshot, PatchCut, Shot};
use super::step::StepContext;
use crate::error::Error;
use crate::form_factor::Row;
use crate::mesh::{Mesh, NodeId};
use crate::progress::StopReason;
use crate::scene::Rgb;

/// The patches that shoot.
#[derive(Clone)]
pub(super) struct Shooting<'m> {
    pub cut: PatchCut<'m>,
    overshoot: bool,
}

impl<'m> Shooting<'m> {
    /// The initial patches of `mesh`.
    pub fn new(solver: &Solver, overshoot: bool, mesh: &'m Mesh) -> Shooting<'m> {
        let Solver { patch_tolerance, min_patch_level, .. } = *solver;
        Shooting { cut: PatchCut::new(mesh, patch_tolerance, min_patch_level), overshoot }
    }

    /// The patches that were saved, if they are a valid cut through `mesh`.
    pub fn from_snapshot(
        solver: &Solver,
        overshoot: bool,
        mesh: &'m Mesh,
        saved: CutSnapshot,
    ) -> Option<Shooting<'m>> {
        let Solver { patch_tolerance, min_patch_level, .. } = *solver;
        let cut = PatchCut::from_snapshot(mesh, patch_tolerance, min_patch_level, saved)?;
        Some(Shooting { cut, overshoot })
    }

    /// Takes the next shots, if there are any.
    pub fn advance(&mut self, step: &mut StepContext) -> Result<Option<StopReason>, Error> {
        if step.refresh_and_check_convergence()? {
            return Ok(Some(StopReason::Converged));
        }
        let max_shots =
            step.max_steps.map_or(u64::MAX, |max| max.saturating_sub(step.counters.shots));
        if max_shots == 0 {
            return Ok(Some(StopReason::Shots));
        }
        let ambient_overshoot = if self.overshoot {
            step.state.ledger.ambient(step.state.mesh).max(Rgb::ZERO)
        } else {
            Rgb::ZERO
        };
        let shots = self.cut.next_shots(
            &step.state.flux,
            step.row_source.preferred_batch_len().max(1),
            max_shots,
            |patch| !step.rows.contains(patch),
        );
        let Some(new_rows) = NewRows::make(step, &shots)? else {
            return Ok(Some(StopReason::Cancelled));
        };
        self.shoot(step, shots, new_rows, ambient_overshoot)
    }

    /// Takes `shots` in order, each along its cached row or the next of `new_rows`.
    fn shoot(
        &mut self,
        step: &mut StepContext,
        shots: Vec<Shot>,
        new_rows: NewRows,
        ambient_overshoot: Rgb,
    ) -> Result<Option<StopReason>, Error> {
        let NewRows { rows, importance } = new_rows;
        let mut rows = rows.into_iter();
        for shot in shots {
            let row = match step.rows.get(shot.patch) {
                Some(row) => Some(row.clone()),
                None => {
                    let Some(row) = rows.next() else { break };
                    self.cut.accept_or_split(&shot, &row, &step.state.flux).then(|| {
                        let row = Arc::new(row);
                        step.rows.insert(shot.patch, row.clone(), importance);
                        row
                    })
                }
            };
            if let Some(row) = row {
                let taken = step.state.take(&shot.elements, ambient_overshoot);
                step.distribute(taken.flux, shot.patch, &row);
                step.state.record_overshoot(taken.overshot);
                step.counters.shots += 1;
                self.cut.mark_shot(&shot);
            }
            step.counters.steps = step.counters.shots;
            let unshot_share = step.state.ledger.unshot_share();
            if step.report(unshot_share).is_break() {
                return Ok(Some(StopReason::Cancelled));
            }
        }
        Ok(None)
    }
}

/// Rows of a batch of shots that were not cached, in the order of the shots.
struct NewRows {
    rows: Vec<Row>,
    /// Importance with which they were computed: the largest unshot share of a patch among them.
    importance: f64,
}

impl NewRows {
    /// `None` when the callback stops the solver: all rows of a batch may take long.
    fn make(step: &mut StepContext, shots: &[Shot]) -> Result<Option<NewRows>, Error> {
        let mesh = step.state.mesh;
        let missing: Vec<&Shot> =
            shots.iter().filter(|shot| !step.rows.contains(shot.patch)).collect();
        let importance = missing
            .iter()
            .map(|shot| step.state.flux.unshot_share(&shot.elements))
            .fold(0.0, f64::max)
            .min(1.0);
        let patches: Vec<NodeId> = missing.iter().map(|shot| shot.patch).collect();
        step.rows.rebuild_missing(mesh, step.row_source, shots.iter().map(|shot| shot.patch))?;
        let (mut rows, mut remaining) = (vec![], &patches[..]);
        while !remaining.is_empty() {
            let some = step.rows.make_some(mesh, step.row_source, &mut remaining, importance)?;
            rows.extend(some);
            let unshot_share = step.state.ledger.unshot_share();
            if !remaining.is_empty() && step.report(unshot_share).is_break() {
                return Ok(None);
            }
        }
        Ok(Some(NewRows { rows, importance }))
    }
}

/// Flux that a patch sends, W per channel.
struct TakenFlux {
    flux: Rgb,
    /// The part of it that was passed on before it was received, less the compensation of earlier
    /// overshoot.
    overshot: Rgb,
}

impl FluxState<'_> {
    /// Takes the unshot flux of `elements`, plus the flux due to `ambient_overshoot` (W/m² per unit
    /// of albedo), at most 0.8 of the unshot flux of each: relaxation by ω < 2 converges in any
    /// order, since exchange areas are symmetric (Ostrowski 1954).
    fn take(&mut self, elements: &[Range<usize>], ambient_overshoot: Rgb) -> TakenFlux {
        let mut flux = Rgb::ZERO;
        let mut overshot = Rgb::ZERO;
        for e in elements.iter().cloned().flatten() {
            let unshot = std::mem::take(&mut self.flux.unshot[e]);
            flux += unshot;
            overshot += unshot.min(Rgb::ZERO);
            if ambient_overshoot != Rgb::ZERO {
                let area = self.mesh.solid_area(self.mesh.element(e));
                let limit = 0.8 * unshot.max(Rgb::ZERO);
                let over = (self.flux.albedo(e) * area * ambient_overshoot).min(limit);
                self.flux.unshot[e] -= over;
                flux += over;
                overshot += over;
            }
        }
        TakenFlux { flux, overshot }
    }

    /// Adds overshot flux to the ledger.
    fn record_overshoot(&mut self, overshot: Rgb) {
        self.ledger.unshot += overshot;
        self.ledger.overshot += overshot;
    }
}
