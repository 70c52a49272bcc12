//! Progressive shooting (Cohen, Chen, Wallace, Greenberg 1988) in f64: the patch with most unshot
//! flux first, which is Southwell's relaxation.

use std::ops::Range;
use std::sync::Arc;

use super::flux_state::FluxState;
use super::patch_cut::{PatchCut, Shot};
use super::session::StepContext;
use crate::error::Error;
use crate::mesh::NodeId;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// Most that is overshot, per flux that is unshot. To relax by ω = 1 + this converges in any order
/// where ω < 2, since exchange areas are symmetric (Ostrowski 1954).
const MOST_OVERSHOOT: f64 = 0.8;

/// Takes the next shots, if there is any to be taken.
pub(super) fn shoot_batch(
    batch: &mut StepContext,
    shooters: &mut PatchCut,
    overshoot: bool,
) -> Result<Option<StopReason>, Error> {
    if batch.has_converged()? {
        return Ok(Some(StopReason::Converged));
    }
    let left = batch.steps.map_or(u64::MAX, |most| most.saturating_sub(batch.done.shots));
    if left == 0 {
        return Ok(Some(StopReason::Shots));
    }
    let mesh = batch.state.mesh;
    let ahead = match overshoot {
        true => batch.state.ledger.ambient(mesh).max(Rgb::ZERO),
        false => Rgb::ZERO,
    };
    let missing = |patch| !batch.rows.keeps(patch);
    let wanted = batch.maker.preferred_batch_len().max(1);
    let shots = shooters.brightest(&batch.state.flux, wanted, left, missing);
    let draws: Vec<&Shot> = shots.iter().filter(|s| missing(s.patch)).collect();
    let share = |s: &&Shot| batch.state.flux.unshot_share(&s.elements);
    let share = draws.iter().map(share).fold(0.0, f64::max).min(1.0);
    let draws: Vec<NodeId> = draws.iter().map(|s| s.patch).collect();
    batch.rows.recall(mesh, batch.maker, shots.iter().map(|s| s.patch))?;
    let mut made = match draws.is_empty() {
        true => vec![],
        false => batch.rows.make(mesh, batch.maker, &draws, share)?,
    }
    .into_iter();
    for shot in shots {
        let row = match batch.rows.get(shot.patch) {
            Some(row) => Some(row.clone()),
            None => {
                let Some(row) = made.next() else { break };
                // Else the patch is too large, and its parts shoot.
                let taken = shooters.confirm(&shot, &row, &batch.state.flux);
                taken.then(|| {
                    let row = Arc::new(row);
                    batch.rows.keep(shot.patch, row.clone(), share);
                    row
                })
            }
        };
        if let Some(row) = row {
            let flux = batch.state.take(&shot.elements, ahead);
            batch.pass_on(flux.0, shot.patch, &row);
            batch.state.book(flux.1);
            batch.done.shots += 1;
            shooters.shot(&shot);
        }
        batch.done.steps = batch.done.shots;
        let unshot_share = batch.state.ledger.unshot_share();
        if batch.tell(unshot_share).is_break() {
            return Ok(Some(StopReason::Cancelled));
        }
    }
    Ok(None)
}

impl FluxState<'_> {
    /// Takes the unshot flux of `from`, and `ahead`, W/m² per unit of reflectance, beyond it: all that
    /// is to be passed on, and what of it is overshot.
    fn take(&mut self, from: &[Range<usize>], ahead: Rgb) -> (Rgb, Rgb) {
        let (mut flux, mut overshot) = (Rgb::ZERO, Rgb::ZERO);
        for e in from.iter().cloned().flatten() {
            let unshot = std::mem::take(&mut self.flux.unshot[e]);
            flux += unshot;
            overshot += unshot.min(Rgb::ZERO);
            if ahead != Rgb::ZERO {
                let area = self.mesh.area(self.mesh.element(e));
                let most = MOST_OVERSHOOT * unshot.max(Rgb::ZERO);
                let over = (self.flux.reflectance[e] * area * ahead).min(most);
                self.flux.unshot[e] -= over;
                flux += over;
                overshot += over;
            }
        }
        (flux, overshot)
    }

    /// Books flux that was passed on and is overshot.
    fn book(&mut self, overshot: Rgb) {
        self.ledger.unshot += overshot;
        self.ledger.overshot += overshot;
    }
}
