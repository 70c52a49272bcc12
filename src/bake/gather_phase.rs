//! The second phase of a bake: vertices gather, their error is estimated, and what is most of it is
//! refined.
//!
//! ```text
//! pilot ─► gather ─► estimate ─► error met, nothing left to refine, or stopped ─► result
//!            ▲           │
//!            └── step ◄──┘   AllVertices: more rays, so every vertex gathers again
//!                            Bounce:      the result lights the vertices, which gather the
//!                                         difference; then elements are split
//!                            Split:       elements are split, and new vertices gather
//! ```
//!
//! Without a target there is no pilot, and the first estimate is the last.

use std::ops::ControlFlow;

use crate::bake::controller::{self, ErrorTarget, Step};
use crate::bake::error_estimate::ErrorEstimate;
use crate::bake::estimator::ErrorEstimator;
use crate::bake::fallback::ResilientBackend;
use crate::bake::model;
use crate::bake::progress::{BakeProgress, Reporter, StageClock};
use crate::bake::result::BakedLight;
use crate::bake::settings::{BakeSettings, GatherSettings, SolveSettings};
use crate::bake::shooting_phase::ShotLight;
use crate::error::Error;
use crate::gather::Gather;
use crate::gather::adaptive::AdaptiveGather;
use crate::gather::{GatheredMesh, Progress as GatherProgress};
use crate::mesh::Mesh;
use crate::progress::StopReason;

/// Vertices that gather what was shot.
pub(super) struct GatherPhase<'a> {
    /// What was used to shoot; shown to the target's overrides only.
    solve: SolveSettings,
    gather: GatherSettings,
    target: Option<ErrorTarget<'a>>,
    state: AdaptiveGather<'a>,
    gatherer: Box<dyn Gather + 'a>,
    backend: &'a ResilientBackend<'a>,
    shot: &'a ShotLight,
}

/// A gathered mesh whose error was estimated.
struct Estimated {
    light: GatheredMesh,
    estimate: ErrorEstimate,
    /// Whether the callback stopped the bake.
    cancelled: bool,
}

impl<'a> GatherPhase<'a> {
    /// Vertices of `mesh` that are to gather `light`, as `settings` say. Given a `target`, a pilot
    /// chooses how many rays a vertex casts.
    pub fn new(
        settings: (SolveSettings, GatherSettings),
        target: Option<ErrorTarget<'a>>,
        mesh: Mesh,
        light: &'a GatheredMesh,
        shot: &'a ShotLight,
        backend: &'a ResilientBackend<'a>,
    ) -> Result<GatherPhase<'a>, Error> {
        let (solve, gather) = settings;
        let state = AdaptiveGather::new(mesh, light);
        let gatherer = backend.gather(
            &shot.mesh,
            gather.rays,
            gather.noise_tolerance,
            state.radiosity_floor(),
        )?;
        let mut phase = GatherPhase { solve, gather, target, state, gatherer, backend, shot };
        if let Some(target) = target {
            phase.choose_rays(target)?;
        }
        Ok(phase)
    }

    /// Gathers as the settings say and, given a target, refines until the estimated error meets it
    /// or nothing is left to be refined.
    pub fn run(
        mut self,
        reporter: &mut Reporter,
        clock: &mut StageClock,
    ) -> Result<BakedLight, Error> {
        let mut step = Step::AllPasses;
        let mut rounds = 0;
        loop {
            let stop = self.gather(step, reporter)?;
            let estimated = self.estimate(stop, reporter, clock)?;
            let refinable =
                stop == StopReason::Converged && !estimated.cancelled && rounds < model::MAX_ROUNDS;
            let next = if refinable { self.refine_settings(&estimated.estimate)? } else { None };
            let Some(next) = next else { return Ok(self.into_result(estimated)) };
            step = next;
            rounds += 1;
        }
    }

    /// The gatherer of the settings, with rays divided by `divisor`.
    fn gatherer(&self, divisor: u32) -> Result<Box<dyn Gather + 'a>, Error> {
        let rays = self.gather.rays.div_ceil(divisor);
        let noise = self.gather.noise_tolerance * f64::from(divisor);
        self.backend.gather(&self.shot.mesh, rays, noise, self.state.radiosity_floor())
    }

    /// Takes `step`, and says why it ended.
    fn gather(&mut self, step: Step, reporter: &mut Reporter) -> Result<StopReason, Error> {
        let refinement = self.gather.refinement.clone();
        let mut progress = |p: &GatherProgress| reporter.report(BakeProgress::Gathering(*p));
        match step {
            Step::AllPasses => {
                let mut coarse = match refinement.gather_passes {
                    0 | 1 => None,
                    _ => Some(self.gatherer(model::COARSE_RAY_DIVISOR)?),
                };
                self.state.run_passes(
                    &refinement,
                    &mut *self.gatherer,
                    coarse.as_mut().map(|coarse| &mut **coarse as &mut dyn Gather),
                    &mut progress,
                )
            }
            Step::AllVertices { bounce } => {
                if bounce {
                    self.state.promote_to_source();
                }
                self.state.gather_pass(&refinement, &mut *self.gatherer, &mut progress)
            }
            Step::Bounce => {
                let mut coarse = self.gatherer(model::COARSE_RAY_DIVISOR)?;
                match self.state.gather_difference(&mut *coarse, &mut progress)? {
                    StopReason::Converged => {
                        self.state.refine(&refinement, &mut *self.gatherer, &mut progress)
                    }
                    stop => Ok(stop),
                }
            }
            Step::Split => self.state.refine(&refinement, &mut *self.gatherer, &mut progress),
        }
    }

    /// What was gathered as a mesh, with its estimated error.
    fn estimate(
        &mut self,
        stop: StopReason,
        reporter: &mut Reporter,
        clock: &mut StageClock,
    ) -> Result<Estimated, Error> {
        let (mut light, element_residual) = self.state.interpolated(&self.gather.refinement)?;
        clock.timings.vertices += clock.lap();
        let estimator = ErrorEstimator {
            light: &light,
            lit_by: Some(self.state.source()),
            element_residual: &element_residual,
            ledger: &self.shot.solution.ledger,
            gather_passes: self.gather.refinement.gather_passes,
        };
        let of = model::sample_count(light.gather_count);
        let mut cancelled = stop == StopReason::Cancelled;
        let (estimate, vertex_error) =
            estimator.estimate(of, &mut *self.gatherer, &mut |samples| {
                cancelled = cancelled
                    || reporter.report(BakeProgress::Estimating { samples, of }).is_break();
                if cancelled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            })?;
        light.surface.error = vertex_error;
        light.stop = stop;
        clock.timings.estimate += clock.lap();
        cancelled |= reporter.report(BakeProgress::Estimated(estimate)).is_break();
        Ok(Estimated { light, estimate, cancelled })
    }

    /// Chooses how many rays a vertex casts, by how much two gathers disagree at a few points.
    fn choose_rays(&mut self, target: ErrorTarget) -> Result<(), Error> {
        let pilot = ErrorEstimator {
            light: self.state.source(),
            lit_by: None,
            element_residual: &[],
            ledger: &self.shot.solution.ledger,
            gather_passes: 0,
        };
        // Rays are not doubled where they disagree: that is for what these few points do not show.
        let rays = self.gather.rays;
        let mut gatherer = self.backend.gather(&self.shot.mesh, rays, f64::INFINITY, 0.0)?;
        let sampling = pilot.sampling_error(model::PILOT_POINTS, &mut *gatherer)?;
        let chosen = controller::with_rays_for(&self.gather, sampling, target.error);
        let settings = BakeSettings { solve: self.solve.clone(), gather: Some(chosen) };
        if let (solve, Some(gather)) = target.overridden(settings) {
            self.solve = solve;
            self.gather = gather;
            self.gatherer = self.gatherer(1)?;
        }
        Ok(())
    }

    /// Refines the settings where `estimate` is too large for the target, and says what is to be
    /// done again; nothing if there is no target, it is met, or overrides keep all settings as they
    /// are.
    fn refine_settings(&mut self, estimate: &ErrorEstimate) -> Result<Option<Step>, Error> {
        let Some(target) = self.target.filter(|target| !target.is_met(estimate)) else {
            return Ok(None);
        };
        let refined = controller::refined(&self.gather, estimate, target.error);
        let settings = BakeSettings { solve: self.solve.clone(), gather: Some(refined) };
        let (solve, Some(gather)) = target.overridden(settings) else { return Ok(None) };
        if (&solve, &gather) == (&self.solve, &self.gather) {
            return Ok(None);
        }
        let step = Step::between(&self.gather, &gather);
        self.solve = solve;
        self.gather = gather;
        self.gatherer = self.gatherer(1)?;
        Ok(Some(step))
    }

    fn into_result(self, estimated: Estimated) -> BakedLight {
        let Estimated { light, estimate, .. } = estimated;
        let settings = BakeSettings { solve: self.solve, gather: Some(self.gather) };
        BakedLight { light, estimate, settings }
    }
}
