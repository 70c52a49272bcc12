//! Progressive shooting (Cohen, Chen, Wallace, Greenberg 1988) in f64: the patch with most unshot
//! flux first, which is Southwell's relaxation.

use std::ops::Range;

use super::run::Run;
use super::shooters::{Shooters, Shot};
use super::state::State;
use super::{Go, Method, Progress, Solution, Stop};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Settings of progressive shooting; [`Shooting::default`] is usable as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Shooting {
    /// Stop when no channel has more than this share of its emitted flux unshot, in [0, 1].
    pub unshot: f64,
    /// Stop after this many shots.
    pub shots: Option<u64>,
    /// Bytes that kept rows may take.
    pub row_memory: usize,
    /// How much of its light a patch may send wrong because it shoots from one place: the share of
    /// the emitted light that it carries, under a square root, times the share of this that goes
    /// wrong, as far as can be told from its size, from how near its receivers are and from how
    /// uneven it is. Patches are as large as this lets them be, from clusters of many triangles down
    /// to elements. 0 makes every patch as small as `level` allows. Elements of emitters shoot by
    /// themselves where they are few. Rows are taken to be right for near receivers: see
    /// [`NearRepair`](crate::NearRepair).
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
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1] or `tolerance` not at least 0;
    /// [`ErrorKind::Scene`] when the emitted flux is not finite; [`ErrorKind::FormFactor`] when a row
    /// breaks its contract; whatever `form_factors` fails with.
    pub fn solve(
        &self,
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> Go,
    ) -> Result<Solution, Error> {
        let &Shooting { unshot, shots, row_memory, tolerance, level, overshoot } = self;
        if tolerance.is_nan() || tolerance < 0.0 {
            let place = format!("tolerance {tolerance}");
            return Err(Error::new(ErrorKind::Setting, place, "below 0", "use 0 or more"));
        }
        let mut run = Run::new(mesh, form_factors, &mut progress, unshot, row_memory)?;
        let mut shooters = Shooters::new(mesh, tolerance, level);
        let stop = loop {
            if run.has_converged()? {
                break Stop::Converged;
            }
            let left = shots.map_or(u64::MAX, |most| most - run.shots);
            if left == 0 {
                break Stop::Shots;
            }
            let ahead = match overshoot {
                true => run.state.ledger.ambient(mesh).max(Rgb::ZERO),
                false => Rgb::ZERO,
            };
            if shoot_batch(&mut run, &mut shooters, left, ahead)?.is_break() {
                break Stop::Cancelled;
            }
        };
        run.solution(Method::Shooting { tolerance, level, overshoot }, stop)
    }
}

/// Takes the next shots, at most `left`, each running `ahead` by so much radiosity per unit of
/// reflectance.
fn shoot_batch(run: &mut Run, shooters: &mut Shooters, left: u64, ahead: Rgb) -> Result<Go, Error> {
    let missing = |patch| run.rows.get(patch).is_none();
    let batch = shooters.brightest(&run.state.flux, run.rows.batch(), left, missing);
    let draws: Vec<&Shot> = batch.iter().filter(|s| missing(s.patch)).collect();
    let share = |s: &&Shot| run.state.flux.unshot_share(&s.elements);
    let unshot_share = draws.iter().map(share).fold(0.0, f64::max);
    let missing: Vec<NodeId> = draws.iter().map(|s| s.patch).collect();
    let mut made = run.rows.make(&missing, unshot_share)?.into_iter();
    for shot in batch {
        match run.rows.get(shot.patch) {
            Some(row) => {
                run.state.shoot(&shot.elements, row, ahead);
                run.shots += 1;
            }
            None => {
                let Some(row) = made.next() else { break };
                // Else the patch is too large, and its parts shoot.
                if shooters.confirm(&shot, &row, &run.state.flux) {
                    run.state.shoot(&shot.elements, &row, ahead);
                    run.rows.keep(shot.patch, row);
                    run.shots += 1;
                }
            }
        }
        run.steps = run.shots;
        let unshot_share = run.state.ledger.unshot_share();
        if run.tell(unshot_share).is_break() {
            return Ok(Go::Break(()));
        }
    }
    Ok(Go::Continue(()))
}

impl State<'_> {
    /// Passes the unshot flux of `from` on along `row`, and `ahead`, W/m² per unit of reflectance,
    /// beyond it.
    fn shoot(&mut self, from: &[Range<usize>], row: &Row, ahead: Rgb) {
        let (mut flux, mut overshot) = (Rgb::ZERO, Rgb::ZERO);
        for e in from.iter().cloned().flatten() {
            let unshot = std::mem::take(&mut self.flux.unshot[e]);
            flux += unshot;
            overshot += unshot.min(Rgb::ZERO);
            if ahead != Rgb::ZERO {
                let area = self.mesh.area(self.mesh.element(e));
                let most = MOST_OVERSHOOT * unshot.max(Rgb::ZERO);
                let over = (self.reflectance[e] * area * ahead).min(most);
                self.flux.unshot[e] -= over;
                flux += over;
                overshot += over;
            }
        }
        self.pass_on(flux, row);
        self.ledger.unshot += overshot;
        self.ledger.overshot += overshot;
    }
}
