//! Progressive shooting (Cohen, Chen, Wallace, Greenberg 1988) in f64: the patch with most unshot
//! flux first, which is Southwell's relaxation.

use std::ops::ControlFlow;
use std::ops::Range;
use std::sync::Arc;

use super::flux_state::FluxState;
use super::patch_cut::{PatchCut, Shot};
use super::session::StepContext;
use super::{Method, Progress, Solution, Solver, StopReason};
use crate::error::Error;
use crate::form_factor::FormFactors;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Settings of progressive shooting; [`Shooting::default`] is usable as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Shooting {
    /// StopReason when no channel has more than this share of its emitted flux unshot, in [0, 1].
    pub unshot: f64,
    /// StopReason after this many shots.
    pub shots: Option<u64>,
    /// Bytes that kept rows may take.
    pub row_memory: usize,
    /// How much of its light a patch may send wrong because it shoots from one place: the share of
    /// the emitted light that it carries, under a square root, times the share of this that goes
    /// wrong, as far as can be told from its size, from how near its receivers are and from how
    /// uneven it is. Patches are as large as this lets them be, from clusters of many triangles down
    /// to elements. 0 makes every patch as small as `level` allows. Elements of emitters shoot by
    /// themselves where they are few. RowCache are taken to be right for near receivers: see
    /// [`ProximityCorrection`](crate::ProximityCorrection).
    pub tolerance: f64,
    /// The smallest patches are this many quadtree levels above the elements: 4ᵏ elements, or a
    /// triangle.
    pub level: u32,
    /// Whether patches shoot ahead of the light (Feda and Purgathofer 1992): beside what they have
    /// unshot, what they would yet receive and reflect if all that is unshot fell evenly. Saves shots
    /// where reflectance is high; what was shot too much is made up for by what comes in, or shot as
    /// negative light. Until then the ledger has it as `overshot`.
    pub overshoot: bool,
}

impl Default for Shooting {
    fn default() -> Self {
        Shooting {
            unshot: 1e-3,
            shots: None,
            row_memory: 1 << 30,
            tolerance: Shooting::TOLERANCE,
            level: 0,
            overshoot: false,
        }
    }
}

/// Most that is overshot, per flux that is unshot. To relax by ω = 1 + this converges in any order
/// where ω < 2, since exchange areas are symmetric (Ostrowski 1954).
const MOST_OVERSHOOT: f64 = 0.8;

impl Shooting {
    /// The tolerance, unless set.
    pub const TOLERANCE: f64 = 4e-3;

    /// Spreads the light that `mesh` emits, with rows from `form_factors`, brightest patch first.
    ///
    /// `progress` is told of every shot, and of every row that was made in vain, and may stop the
    /// solver; what was reached is returned.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] when `unshot` is not in [0, 1] or `tolerance` not at least 0;
    /// [`crate::ErrorKind::Scene`] when the emitted flux is not finite; [`crate::ErrorKind::FormFactor`] when a row
    /// breaks its contract; whatever `form_factors` fails with.
    pub fn solve(
        &self,
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Solution, Error> {
        self.solver().solve(mesh, form_factors, &mut progress)
    }

    /// The same as a [`Solver`].
    pub fn solver(&self) -> Solver {
        let &Shooting { unshot, shots, row_memory, tolerance, level, overshoot } = self;
        let method = Method::Shooting { tolerance, level, overshoot };
        Solver { method, unshot, steps: shots, row_memory }
    }
}

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
