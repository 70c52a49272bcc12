//! A solve under way: what there is between one batch of rows and the next.

use std::ops::ControlFlow;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::direct::direct;
use super::flux_state::FluxState;
use super::gmres::Gmres;
use super::patch_cut::PatchCut;
use super::relaxation::Relaxation;
use super::row_cache::RowCache;
use super::shooting::shoot_batch;
use super::{Ledger, Method, Progress, Solution, Solver};
use crate::error::Error;
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::progress::StopReason;
use crate::scene::Rgb;

/// A solve that goes on by batches of rows: [`Solver::begin`] makes it.
///
/// Between batches it can be looked at, [saved](SolveSession::save), given a scene that has
/// [changed](SolveSession::relight), or other rows; it does not matter who makes them, as long as they are
/// rows of its mesh. An error takes nothing from it: after a device failed it is where it was before
/// the batch, and goes on with another.
///
/// ```
/// # use radiosity::*;
/// # use std::ops::ControlFlow;
/// # fn main() -> Result<(), Error> {
/// # let scene = load_obj("scenes/cornell_box.obj")?;
/// let mesh = Mesh::new(scene, 300.0)?;
/// let mut rows = RayRows::new(&mesh, 256)?;
/// let mut solve = Solver::for_mesh(&mesh).begin(&mesh)?;
/// let stop = loop {
///     if let Some(stop) = solve.advance(&mut rows, |_| ControlFlow::Continue(()))? {
///         break stop;
///     }
///     // Between batches: look at solve.ledger(), or solve.save("light.state")?.
/// };
/// assert_eq!(stop, StopReason::Converged);
/// let radiosity = solve.into_solution()?.radiosity;
/// # assert_eq!(radiosity.len(), mesh.element_count());
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct SolveSession<'m> {
    pub(super) solver: Solver,
    pub(super) state: FluxState<'m>,
    pub(super) rows: RowCache,
    pub(super) course: MethodState<'m>,
    pub(super) done: Counters,
    pub(super) stop: Option<StopReason>,
    /// Settings of whoever made the last rows.
    pub(super) made_by: String,
}

/// What a method has in hand between batches.
#[derive(Clone)]
pub(super) enum MethodState<'m> {
    Shooting(PatchCut<'m>),
    Relaxation(Relaxation),
    Gmres(Gmres),
    Direct,
}

/// What was done.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Counters {
    pub steps: u64,
    /// RowCache sent along.
    pub shots: u64,
}

impl Counters {
    /// What there is to be told, of a solve that was set going at `start`.
    pub fn progress(self, rows_made: u64, unshot_share: f64, start: Instant) -> Progress {
        let Counters { steps, shots } = self;
        Progress { steps, shots, rows_made, unshot_share, elapsed: start.elapsed() }
    }
}

impl<'m> MethodState<'m> {
    pub fn new(solver: &Solver, mesh: &'m Mesh) -> MethodState<'m> {
        match solver.method {
            Method::Shooting { .. } => MethodState::Shooting(PatchCut::new(
                mesh,
                solver.patch_tolerance,
                solver.min_patch_level,
            )),
            Method::Jacobi => MethodState::Relaxation(Relaxation::jacobi(mesh.element_count())),
            Method::GaussSeidel => MethodState::Relaxation(Relaxation::gauss_seidel()),
            Method::Gmres { restart } => MethodState::Gmres(Gmres::new(restart)),
            Method::Direct => MethodState::Direct,
        }
    }
}

impl<'m> SolveSession<'m> {
    /// Nothing is shot yet.
    pub(super) fn new(solver: Solver, mesh: &'m Mesh) -> Result<SolveSession<'m>, Error> {
        Ok(SolveSession {
            state: FluxState::new(mesh)?,
            rows: RowCache::new(solver.row_memory),
            course: MethodState::new(&solver, mesh),
            done: Counters::default(),
            stop: None,
            made_by: String::new(),
            solver,
        })
    }

    /// Goes on by one batch of rows, or as far as kept rows go; answers why it stops, if it does. A
    /// direct solve is one batch.
    ///
    /// `progress` is told of every row that light is sent along, or that is made in vain, and may
    /// stop the solver, which can go on all the same.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`](crate::ErrorKind::FormFactor) when a row breaks its contract; whatever
    /// `form_factors` fails with.
    pub fn advance(
        &mut self,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Option<StopReason>, Error> {
        self.step(form_factors, &mut progress, Instant::now())
    }

    /// Goes on until there is a reason to stop.
    ///
    /// # Errors
    /// Those of [`SolveSession::advance`].
    pub fn run(
        &mut self,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        let start = Instant::now();
        loop {
            if let Some(stop) = self.step(form_factors, &mut progress, start)? {
                return Ok(stop);
            }
        }
    }

    fn step(
        &mut self,
        maker: &mut dyn FormFactors,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        start: Instant,
    ) -> Result<Option<StopReason>, Error> {
        self.made_by = maker.fingerprint();
        let SolveSession { solver, state, rows, course, done, .. } = self;
        // The rest is for rows that may be wrong since objects were moved, and are by a part of that.
        let doubt = rows.doubt(state.ledger.emitted) / 4.0;
        let unshot = (solver.unshot - doubt).max(solver.unshot / 2.0);
        let unshot = unshot.max(LEAST_UNSHOT);
        let steps = solver.max_steps;
        let mut batch = StepContext { state, rows, maker, done, progress, start, unshot, steps };
        self.stop = match course {
            MethodState::Shooting(shooters) => {
                let overshoot = matches!(solver.method, Method::Shooting { overshoot: true });
                shoot_batch(&mut batch, shooters, overshoot)?
            }
            MethodState::Relaxation(relaxation) => relaxation.advance(&mut batch)?,
            MethodState::Gmres(gmres) => gmres.advance(&mut batch)?,
            MethodState::Direct => Some(direct(&mut batch)?),
        };
        Ok(self.stop)
    }

    /// Ends what the method has in hand, so that all light is accounted for.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        match &mut self.course {
            MethodState::Relaxation(relaxation) => relaxation.finish(&mut self.state),
            MethodState::Gmres(gmres) => gmres.finish(&mut self.state, &mut self.rows),
            MethodState::Shooting(_) | MethodState::Direct => {}
        }
        self.state.settle()
    }

    /// What was reached.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`](crate::ErrorKind::FormFactor) when the ledger does not close.
    pub fn into_solution(mut self) -> Result<Solution, Error> {
        self.finish()?;
        Ok(Solution {
            radiosity: self.state.radiosity(),
            ledger: self.state.ledger,
            method: self.solver.method,
            steps: self.done.steps,
            shots: self.done.shots,
            rows_made: self.rows.made,
            stop: self.stop.unwrap_or(StopReason::Cancelled),
        })
    }

    /// What was reached so far; the solve can go on.
    ///
    /// # Errors
    /// Those of [`SolveSession::into_solution`].
    pub fn solution(&self) -> Result<Solution, Error> {
        self.clone().into_solution()
    }

    /// Where the light is by now; what GMRES has in hand is counted as unshot.
    pub fn ledger(&self) -> &Ledger {
        &self.state.ledger
    }

    /// The mesh that light is spread on.
    pub fn mesh(&self) -> &'m Mesh {
        self.state.mesh
    }

    /// Method and stop rules; the rules can be changed between batches by [`SolveSession::set_limits`].
    pub fn solver(&self) -> &Solver {
        &self.solver
    }

    /// From now on stops at this unshot share, and after this many steps in all.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`](crate::ErrorKind::Setting) when `unshot` is not in [0, 1].
    pub fn set_limits(&mut self, unshot: f64, max_steps: Option<u64>) -> Result<(), Error> {
        let solver = Solver { unshot, max_steps, ..self.solver };
        solver.check()?;
        self.solver = solver;
        Ok(())
    }
}

/// What a method works on, in one batch.
pub(super) struct StepContext<'a, 'm> {
    pub state: &'a mut FluxState<'m>,
    pub rows: &'a mut RowCache,
    pub maker: &'a mut dyn FormFactors,
    pub done: &'a mut Counters,
    progress: &'a mut dyn FnMut(&Progress) -> ControlFlow<()>,
    start: Instant,
    /// Converged when no channel has more than this share of its emitted flux unshot.
    pub unshot: f64,
    pub steps: Option<u64>,
}

/// Less than this share unshot cannot change a radiosity in f64, not even in a room whose lamps emit
/// 1e-12 of what others do: asking for 0 ends here.
const LEAST_UNSHOT: f64 = 1e-28;

impl StepContext<'_, '_> {
    /// Counts and checks what there is; whether that is enough.
    pub fn has_converged(&mut self) -> Result<bool, Error> {
        self.state.settle()?;
        Ok(self.state.ledger.unshot_share() <= self.unshot)
    }

    /// Whether no further step was asked for.
    pub fn is_last_step(&self) -> bool {
        self.steps.is_some_and(|most| self.done.steps >= most)
    }

    /// Sends `flux`, which is no longer unshot anywhere, along the row of `patch`.
    pub fn pass_on(&mut self, flux: Rgb, patch: NodeId, row: &Row) {
        self.state.pass_on(flux, row);
        self.rows.sent(patch, flux);
    }

    /// Tells where the solve is; whether to go on.
    pub fn tell(&mut self, unshot_share: f64) -> ControlFlow<()> {
        (self.progress)(&self.done.progress(self.rows.made, unshot_share, self.start))
    }
}
