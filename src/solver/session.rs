//! A solve in progress: the state between one batch of rows and the next.

use std::fmt;
use std::ops::ControlFlow;

use super::flux_state::{FluxState, ReceivedLight};
use super::method_state::MethodState;
use super::row_cache::RowCache;
use super::shooting::Shooting;
use super::staleness::tightened_unshot;
use super::step::{Counters, StepContext};
use super::{Ledger, Progress, Solution, Solver};
use crate::error::Error;
use crate::form_factor::FormFactors;
use crate::mesh::Mesh;
use crate::progress::{Instant, StopReason};
use crate::scene::Rgb;

/// A solve that advances by batches of rows: [`Solver::begin`] creates it.
///
/// Between batches it can be inspected, [saved](SolveSession::save), given a scene whose
/// [materials](SolveSession::update_materials) or [objects](SolveSession::update_geometry) have
/// changed, or rows from any other source for its mesh. An error leaves it unchanged: after a
/// device failure it is in the state before the batch, and continues with another device.
///
/// ```
/// # use radiosity::backend::cpu::RayRows;
/// # use radiosity::solver::StopReason;
/// # use radiosity::*;
/// # use std::ops::ControlFlow;
/// # fn main() -> Result<(), Error> {
/// # let scene = load_scene("scenes/cornell_box.obj")?;
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
    pub(super) method: MethodState<Shooting<'m>>,
    pub(super) counters: Counters,
    pub(super) stop: Option<StopReason>,
    /// [`FormFactors::fingerprint`] of the source of the last rows.
    pub(super) row_source: String,
}

impl fmt::Debug for SolveSession<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut session = f.debug_struct("SolveSession");
        session.field("solver", &self.solver).field("ledger", self.ledger());
        session.finish_non_exhaustive()
    }
}

impl<'m> SolveSession<'m> {
    /// No flux is shot yet except what was `received`. The settings are checked already.
    pub(super) fn new(
        solver: Solver,
        mesh: &'m Mesh,
        received: &ReceivedLight,
    ) -> Result<SolveSession<'m>, Error> {
        Ok(SolveSession {
            state: FluxState::new(mesh, received)?,
            rows: RowCache::new(solver.row_memory),
            method: MethodState::new(&solver, mesh),
            counters: Counters::default(),
            stop: None,
            row_source: String::new(),
            solver,
        })
    }

    /// Advances by one batch of rows, or as far as cached rows go; returns the reason if it stops.
    /// A direct solve is one batch.
    ///
    /// `progress` is called for every row that is computed or that light is sent along, and may
    /// stop the solver, which can be resumed.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`](crate::ErrorKind::FormFactor) when a row breaks its contract; all
    /// errors of `form_factors`.
    pub fn advance(
        &mut self,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Option<StopReason>, Error> {
        self.step(form_factors, &mut progress, Instant::now())
    }

    /// Advances until there is a reason to stop.
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
        row_source: &mut dyn FormFactors,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
        start: Instant,
    ) -> Result<Option<StopReason>, Error> {
        self.row_source = row_source.fingerprint();
        let unshot = tightened_unshot(self.solver.unshot, self.stale_flux_bound());
        let mut step = StepContext {
            state: &mut self.state,
            rows: &mut self.rows,
            row_source,
            counters: &mut self.counters,
            progress,
            start,
            // Even where 0 is requested: less cannot change a radiosity in f64, not even in a room
            // whose lamps emit 1e-12 of the light of others.
            unshot: unshot.max(1e-28),
            max_steps: self.solver.max_steps,
        };
        self.stop = self.method.advance(&mut step)?;
        Ok(self.stop)
    }

    /// Takes back flux held by the method, so that all light is accounted for.
    pub(super) fn finish(&mut self) -> Result<(), Error> {
        self.method.finish(&mut self.state, &mut self.rows);
        self.state.recompute_and_verify_energy()
    }

    /// The solution reached.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`](crate::ErrorKind::FormFactor) when the ledger does not close.
    pub fn into_solution(mut self) -> Result<Solution, Error> {
        self.finish()?;
        Ok(Solution {
            radiosity: self.state.radiosity(),
            ledger: self.state.ledger,
            method: self.solver.method,
            steps: self.counters.steps,
            shots: self.counters.shots,
            rows_made: self.rows.rows_made,
            stop: self.stop.unwrap_or(StopReason::Cancelled),
        })
    }

    /// The solution reached so far; the solve can continue.
    ///
    /// # Errors
    /// Those of [`SolveSession::into_solution`].
    pub fn solution(&self) -> Result<Solution, Error> {
        self.clone().into_solution()
    }

    /// Radiosity of the elements so far, what is unshot fallen evenly on all, W/m² per channel.
    pub(crate) fn light_so_far(&self) -> Vec<Rgb> {
        let mut radiosity = self.state.radiosity();
        self.state.ledger.add_ambient(self.state.mesh, &mut radiosity);
        radiosity
    }

    /// The energy balance so far; flux held by GMRES is counted as unshot.
    pub fn ledger(&self) -> &Ledger {
        &self.state.ledger
    }

    /// The mesh that light is spread on.
    pub fn mesh(&self) -> &'m Mesh {
        self.state.mesh
    }

    /// The settings; [`SolveSession::set_limits`] changes those that may change between batches.
    pub fn solver(&self) -> &Solver {
        &self.solver
    }

    /// Maximum flux that may have been misplaced since objects were moved, along rows computed
    /// before: a share of the emitted flux, of the worst channel.
    pub fn stale_flux_bound(&self) -> f64 {
        self.rows.stale_flux_bound(self.state.ledger.emitted)
    }

    /// Sets the unshot share and the total number of steps at which to stop.
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
