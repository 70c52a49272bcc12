//! The second phase of a bake: vertices gather, their error is estimated, and its largest parts are
//! refined.
//!
//! ```text
//! pilot ─► gather ─► estimate ─► error met, nothing left to refine, or stopped ─► result
//!            ▲           │
//!            └── step ◄──┘   AllVertices: more rays, so every vertex gathers again
//!                            Bounces:     all further ones, of what vertices have gathered, by few
//!                                         rays
//!                            Split:       elements are split, and new vertices gather
//! ```
//!
//! Without a target there is no pilot, and the first estimate is the last.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::accuracy::Measure;
use crate::backend::cpu::RayGather;
use crate::bake::controller::{self, ErrorTarget, Step, TargetErrors};
use crate::bake::estimator::{self, ErrorEstimator, EstimatedError, Pilot};
use crate::bake::fallback::ResilientBackend;
use crate::bake::model;
use crate::bake::outcome::{Obstacle, Outcome};
use crate::bake::progress::{BakeProgress, Reporter, StageClock};
use crate::bake::result::BakedLight;
use crate::bake::settings::{BakeSettings, GatherSettings, SolveSettings};
use crate::bake::shooting_phase::ShotLight;
use crate::bake::strata::SampleCounts;
use crate::bake::validator::{self, LinearFit, Validator};
use crate::error::Error;
use crate::gather::Gather;
use crate::gather::adaptive::{AdaptiveGather, Gatherers};
use crate::gather::point_row::PointRows;
use crate::gather::{GatheredMesh, Progress as GatherProgress};
use crate::light::PathTracer;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::sampling::octaves::Octaves;
use crate::scene::Rgb;
use crate::verify::octaves_of;
use crate::work::now;

/// Maximum number of rounds of refinement to one target. Plain choice.
const MAX_ROUNDS: u32 = 12;

/// Measured error above which a bake whose time is over is fitted to the truth. Plain choice.
const NOISY: f64 = 0.3;

/// Vertices that gather what was shot.
pub(super) struct GatherPhase<'a> {
    /// What was used to shoot; shown to the target's overrides only.
    solve: SolveSettings,
    gather: GatherSettings,
    measure: Measure,
    target: Option<ErrorTarget<'a>>,
    state: AdaptiveGather,
    gatherer: Box<dyn Gather + 'a>,
    backend: &'a ResilientBackend<'a>,
    shot: &'a ShotLight,
    validator: Validator<'a>,
    paths: PathTracer<'a>,
    octaves: Arc<Octaves>,
    /// Reflected radiosity of all surfaces that is the least error before any vertex has gathered,
    /// W/m² per channel.
    even: Rgb,
}

/// A gathered mesh whose error was estimated.
struct Estimated {
    light: Arc<GatheredMesh>,
    error: EstimatedError,
    /// Whether the callback stopped the bake.
    cancelled: bool,
}

/// What follows an estimate.
enum Next {
    Step(Step),
    End(Outcome),
}

impl<'a> GatherPhase<'a> {
    /// For vertices of `mesh` that gather `light` by the settings `gather`. Given a `target`, a
    /// pilot chooses the rays per vertex.
    pub fn new(
        settings: &BakeSettings,
        gather: &GatherSettings,
        target: Option<ErrorTarget<'a>>,
        mesh: Mesh,
        light: &GatheredMesh,
        shot: &'a ShotLight,
        backend: &'a ResilientBackend<'a>,
    ) -> Result<GatherPhase<'a>, Error> {
        let (solve, gather, measure) = (settings.solve.clone(), gather.clone(), settings.measure);
        let state =
            AdaptiveGather::new(mesh, &light.radiosity_field(), gather.refinement.region, measure);
        let gatherer = backend.gather(
            &shot.mesh,
            gather.rays,
            gather.noise_tolerance,
            state.radiosity_floor(),
        )?;
        let scene = shot.mesh.scene();
        let each_group = target.is_some_and(|target| target.each_group);
        let validator = Validator::new(scene, measure, each_group);
        let (paths, octaves) = (PathTracer::new(scene), octaves_of(scene));
        let mut phase = GatherPhase {
            solve,
            gather,
            measure,
            target,
            state,
            gatherer,
            backend,
            shot,
            validator,
            paths,
            octaves,
            even: Rgb::ZERO,
        };
        if let Some(target) = target {
            phase.choose_rays(light, target)?;
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
        let mut step = if self.is_within_time() { Step::FirstLight } else { Step::AllPasses };
        let mut rounds = 0;
        let (mut previous_gathers, mut idle_rounds) = (0, 0);
        loop {
            let stop = self.gather(step, reporter)?;
            let mut estimated = self.estimate(stop, reporter, clock)?;
            let (light, estimate) = (estimated.light.clone(), Some(estimated.error.whole));
            let stops = reporter.report(BakeProgress::Light { light, estimate });
            estimated.cancelled |= stops.is_break();
            // A round is idle if it raises the number of gathers by less than 1 %; two idle rounds
            // are the last, as are MAX_ROUNDS of any kind.
            let gathers = estimated.light.gather_count;
            let has_progress = gathers as f64 >= 1.01 * previous_gathers as f64;
            idle_rounds = if has_progress { 0 } else { idle_rounds + 1 };
            let rounds_left = if idle_rounds >= 2 { 0 } else { MAX_ROUNDS - rounds };
            let mut next = self.next_step(&estimated, rounds_left)?;
            if matches!(next, Next::End(_)) {
                // By gathers the bake ends; paths may measure a larger error.
                estimated = self.validate(estimated, reporter, clock);
                next = self.next_step(&estimated, rounds_left)?;
            }
            previous_gathers = gathers;
            rounds += 1;
            if matches!(next, Next::End(Outcome::Reached))
                && let Some(target) = self.target.and_then(|t| t.next(estimated.error.errors()))
                && !estimated.cancelled
            {
                self.target = Some(target);
                (rounds, previous_gathers, idle_rounds) = (0, 0, 0);
                next = self.next_step(&estimated, MAX_ROUNDS)?;
            }
            match next {
                Next::Step(next) => step = next,
                Next::End(outcome) => return Ok(self.into_result(estimated, outcome)),
            }
        }
    }

    /// The next step, with `rounds_left`; or how the bake ends.
    fn next_step(&mut self, estimated: &Estimated, rounds_left: u32) -> Result<Next, Error> {
        let Estimated { light, error, cancelled } = estimated;
        let errors = error.errors();
        let Some(target) = self.target else { return Ok(Next::End(Outcome::Unasked)) };
        let stopped = *cancelled || light.stop == StopReason::Cancelled;
        let (step, obstacle) = if stopped {
            (None, Obstacle::Cancelled)
        } else if target.is_met(errors) {
            (None, Obstacle::Edges)
        } else if light.stop == StopReason::Elements {
            // Bounces take no elements.
            let bounces = controller::with_bounces(&self.gather, errors, &target);
            let step = self.step_to(bounces, target)?.filter(|_| rounds_left > 0);
            (step, Obstacle::Elements)
        } else if rounds_left == 0 {
            (None, Obstacle::largest_part(errors.whole))
        } else {
            (self.refine_settings(target, errors)?, Obstacle::Settings)
        };
        Ok(match step {
            Some(step) => Next::Step(step),
            None if target.is_reached(errors, stopped) => Next::End(Outcome::Reached),
            None => Next::End(Outcome::Missed(obstacle)),
        })
    }

    /// Whether the bake is one within a time, of which nothing was shot: the source is what is
    /// emitted.
    fn is_within_time(&self) -> bool {
        self.target.is_some_and(|target| target.within.is_some())
    }

    /// The gatherer of the settings, with rays divided by `divisor`.
    fn gatherer(&self, divisor: u32) -> Result<Box<dyn Gather + 'a>, Error> {
        let rays =
            self.gather.rays.div_ceil(divisor).max(model::MIN_COARSE_RAYS.min(self.gather.rays));
        let noise = self.gather.noise_tolerance * f64::from(divisor);
        self.backend.gather(&self.shot.mesh, rays, noise, self.state.radiosity_floor())
    }

    /// The gatherer at centroids: half as many rays as a vertex, 64 at most, and more where halves
    /// of them differ by 15 %. With all of the rays, 128 at most, three scenes were split into the
    /// same elements and a city into more, in 3 to 38 % more time.
    fn probe_gatherer(&self) -> Result<Box<dyn Gather + 'a>, Error> {
        let rays = (self.gather.rays / 2).clamp(1, 64);
        self.backend.gather(&self.shot.mesh, rays, 0.15, self.state.radiosity_floor())
    }

    /// What makes the rows by which vertices exchange all further bounces.
    fn bounce_rows(&self) -> Result<RayGather, Error> {
        let rays = model::rays_of_rows(self.gather.rays, self.state.vertices());
        Ok(RayGather::new(&self.shot.mesh, rays)?.with_near_field())
    }

    /// Takes `step`; why it ended.
    fn gather(&mut self, step: Step, reporter: &mut Reporter) -> Result<StopReason, Error> {
        let refinement = self.gather.refinement.clone();
        let mut progress = |p: &GatherProgress| reporter.report(BakeProgress::Gathering(*p));
        match step {
            Step::FirstLight => match self.first_light(&mut progress)? {
                Some(next) => self.gather(next, reporter),
                None => Ok(StopReason::Cancelled),
            },
            Step::AllPasses => {
                let mut probes = self.probe_gatherer()?;
                let is_single = refinement.gather_passes <= 1;
                let bounces = match self.target {
                    Some(_) if is_single => Some(self.bounce_rows()?),
                    _ => None,
                };
                let mut coarse = match is_single {
                    true => None,
                    false => Some(self.gatherer(model::COARSE_RAY_DIVISOR)?),
                };
                let gatherers = Gatherers {
                    last: &mut *self.gatherer,
                    coarse: coarse.as_mut().map(|coarse| &mut **coarse as &mut dyn Gather),
                    probes: Some(&mut *probes),
                    bounces: bounces.as_ref().map(|rows| rows as &dyn PointRows),
                };
                self.state.run_passes(&refinement, gatherers, &mut progress)
            }
            Step::AllVertices { bounce } => {
                if bounce {
                    self.state.promote_to_source();
                }
                let mut probes = self.probe_gatherer()?;
                let probes = Some(&mut *probes);
                self.state.gather_pass(&refinement, &mut *self.gatherer, probes, &mut progress)
            }
            Step::Bounces => {
                let maker = self.bounce_rows()?;
                Ok(self.state.add_further_bounces(&maker, &mut progress))
            }
            Step::Split => {
                let mut probes = self.probe_gatherer()?;
                let probes = Some(&mut *probes);
                self.state.refine(&refinement, &mut *self.gatherer, probes, &mut progress)
            }
        }
    }

    /// All vertices gather what is emitted and exchange it, by few rays, and once more by as many
    /// as the time permits. The step that follows, unless stopped: all passes, where they take less
    /// than half of the time that is left, else elements are split by few rays.
    fn first_light(
        &mut self,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<Option<Step>, Error> {
        let Some(target) = self.target else { return Ok(Some(Step::AllPasses)) };
        let [least, most] = model::RAYS_OF_FIRST_LIGHT;
        let start = now();
        if self.exchange_by(least, progress)? == StopReason::Cancelled {
            // What they would have exchanged, evenly (the ambient term of Cohen et al. 1988).
            let albedo = self.shot.mesh.mean_albedo();
            self.state
                .add_even_light(self.even * albedo / (Rgb::ONE - albedo).max(Rgb::splat(0.05)));
            return Ok(None);
        }
        // A ray of a vertex, and one of its row.
        let mut time_per_ray = (now() - start) / least;
        let rays = target.time_left().div_duration_f64(time_per_ray).min(most.into()) as u32;
        if rays >= 2 * least {
            let start = now();
            if self.exchange_by(rays, progress)? == StopReason::Cancelled {
                return Ok(None);
            }
            time_per_ray = (now() - start) / rays;
        }
        if time_per_ray * self.gather.rays < target.time_left() {
            return Ok(Some(Step::AllPasses));
        }
        let few = GatherSettings { rays: model::RAYS_IN_HASTE, ..self.gather.clone() };
        self.step_to(few, target)?;
        Ok(Some(Step::Split))
    }

    /// All vertices gather, and exchange what they have, by as many `rays` each.
    fn exchange_by(
        &mut self,
        rays: u32,
        progress: &mut dyn FnMut(&GatherProgress) -> ControlFlow<()>,
    ) -> Result<StopReason, Error> {
        // Without near fields: what is near is dark in the source, which is no solution.
        let mut gatherer = self.backend.gather_evenly(&self.shot.mesh, rays)?;
        let rows = RayGather::new(&self.shot.mesh, rays)?;
        let settings = self.gather.refinement.clone();
        match self.state.gather_all(&settings, &mut *gatherer, progress)? {
            StopReason::Cancelled => Ok(StopReason::Cancelled),
            _ => Ok(self.state.add_further_bounces(&rows, progress)),
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
            lit_by: self.state.has_gathered_all().then(|| self.state.source()),
            element_residual: &element_residual,
            ledger: &self.shot.solution.ledger,
            bounces: self.state.bounces(),
            measure: self.measure,
            region: self.solve.lit_region(self.shot.mesh.scene()),
            octaves: &self.octaves,
            expected_floor: self.state.radiosity_floor(),
            paths: Some(&self.paths),
        };
        let each_group = self.target.is_some_and(|target| target.each_group);
        let mut counts = SampleCounts {
            total: model::sample_count(light.gather_count),
            per_group: match each_group {
                true => 48,
                false => model::SAMPLES_PER_GROUP,
            },
        };
        let mut cancelled = stop == StopReason::Cancelled;
        let target = self.target;
        let error = loop {
            let error = estimator.estimate(counts, &mut *self.gatherer, &mut |samples, of| {
                cancelled |= reporter.report(BakeProgress::Estimating { samples, of }).is_break();
                estimator::goes_on(cancelled, target.is_some_and(|t| t.is_late()), samples)
            })?;
            let undecided = |target: ErrorTarget| target.is_undecided(error.errors());
            // Up to 768 points per group and 16 times as many in total: a round that splits
            // elements costs more. Of a furnished room, a castle and a village to 10 %, the first
            // estimates, by 3 700 to 8 400 points, were 0.075 to 0.089, and by twice as many below
            // 0.075; with 4 in place of 16 they took 42, 40 and 80 s, with 16 28, 27 and 38 s.
            let most = counts.per_group.max(counts.total / 16);
            if cancelled || most >= 768 || !self.target.is_some_and(undecided) {
                break error;
            }
            counts = SampleCounts { total: 2 * counts.total, per_group: 2 * counts.per_group };
        };
        light.stop = stop;
        clock.timings.estimate += clock.lap();
        cancelled |= reporter.report(BakeProgress::Estimated(error.whole)).is_break();
        Ok(Estimated { light: Arc::new(light), error, cancelled })
    }

    /// Validates the estimate by paths; where the bake was stopped, by few of them.
    fn validate(
        &mut self,
        estimated: Estimated,
        reporter: &mut Reporter,
        clock: &mut StageClock,
    ) -> Estimated {
        let Estimated { light, error, mut cancelled } = estimated;
        let was_stopped = cancelled;
        if was_stopped && self.is_within_time() {
            // Vertices before and after a bounce make no series of bounces.
            let (error, fit) = self.validator.measured_at_once(error, &light);
            let mut best = Estimated { light, error, cancelled };
            if best.error.whole.total > NOISY
                && let Some(fit) = fit
                && let Some(light) = self.fitted(fit)
            {
                let (mut error, _) = self.validator.measured_at_once(best.error.clone(), &light);
                if error.whole.total < best.error.whole.total {
                    // As other vertices have it, of an error that is the same share everywhere.
                    let of_vertex = |b: &Rgb| 2.0 * error.whole.total * b.length();
                    error.vertices = light.surface.radiosity.iter().map(of_vertex).collect();
                    best = Estimated { light: Arc::new(light), error, ..best };
                }
            }
            clock.timings.estimate += clock.lap();
            return best;
        }
        let paths = match was_stopped {
            true => [validator::MIN_PATHS; 2],
            false => {
                let [paths, in_doubt] = validator::paths(light.gather_count, self.gather.rays);
                // A group of a few points is in doubt more often than the whole.
                let each_group = self.target.is_some_and(|target| target.each_group);
                [if each_group { in_doubt } else { paths }, in_doubt]
            }
        };
        let target = self.target.map(|target| target.error);
        let error = self.validator.validate(error, &light, target, paths, &mut |samples, of| {
            cancelled |= reporter.report(BakeProgress::Estimating { samples, of }).is_break();
            let stop = cancelled && !was_stopped;
            if stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        clock.timings.estimate += clock.lap();
        cancelled |= reporter.report(BakeProgress::Estimated(error.whole)).is_break();
        Estimated { light, error, cancelled }
    }

    /// What was gathered, by a `fit` to the truth: of noise in the dark, which is more than all
    /// light there, little is left, and an even light in its place. None where light comes from
    /// points, as that of the sun, which is reconstructed apart.
    fn fitted(&mut self, LinearFit { share, even }: LinearFit) -> Option<GatheredMesh> {
        self.state.scale_light(share)?;
        self.state.add_even_light(even);
        let (light, _) = self.state.interpolated(&self.gather.refinement).ok()?;
        Some(GatheredMesh { stop: StopReason::Cancelled, ..light })
    }

    /// Chooses the rays per vertex by the difference of two gathers of `light` at 256 points, and
    /// the floor of the radiosity by their mean.
    fn choose_rays(&mut self, light: &GatheredMesh, target: ErrorTarget) -> Result<(), Error> {
        let pilot = ErrorEstimator {
            light,
            lit_by: None,
            element_residual: &[],
            ledger: &self.shot.solution.ledger,
            bounces: 0.0,
            measure: self.measure,
            region: self.solve.lit_region(self.shot.mesh.scene()),
            octaves: &self.octaves,
            expected_floor: self.state.radiosity_floor(),
            paths: None,
        };
        // Rays are doubled where they disagree, as for vertices: a few dim points do not need more
        // of them everywhere.
        let noise = controller::noise_tolerance(target.error);
        let dim = self.state.radiosity_floor();
        let (mesh, rays) = (&self.shot.mesh, self.gather.rays);
        let mut gatherer = match self.is_within_time() {
            true => self.backend.gather_evenly(mesh, rays)?,
            false => self.backend.gather(mesh, rays, noise, dim)?,
        };
        let Pilot { sampling, radiosity_floor, even } = pilot.pilot(256, &mut *gatherer)?;
        self.state.set_radiosity_floor(radiosity_floor);
        if self.is_within_time() {
            self.even = even;
            self.state.add_even_light(even);
        }
        let vertices = self.state.vertices();
        let chosen = controller::with_rays_for(&self.gather, sampling, target.error, vertices);
        let settings = self.settings(chosen);
        if let (solve, Some(gather)) = target.overridden(settings) {
            self.solve = solve;
            self.gather = gather;
            self.gatherer = self.gatherer(1)?;
        }
        Ok(())
    }

    /// Refines the settings where the estimate is above the target; the step that follows, none if
    /// nothing can be refined or overrides keep all settings.
    fn refine_settings(
        &mut self,
        target: ErrorTarget,
        errors: TargetErrors,
    ) -> Result<Option<Step>, Error> {
        let refined = controller::refined(&self.gather, errors, &target);
        self.step_to(refined, target)
    }

    /// Takes the settings `refined` after the overrides; the step that follows, if any changed.
    fn step_to(
        &mut self,
        refined: GatherSettings,
        target: ErrorTarget,
    ) -> Result<Option<Step>, Error> {
        let settings = self.settings(refined);
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

    /// All settings, with these of the gather.
    fn settings(&self, gather: GatherSettings) -> BakeSettings {
        let (solve, measure) = (self.solve.clone(), self.measure);
        BakeSettings { solve, gather: Some(gather), measure }
    }

    fn into_result(self, estimated: Estimated, outcome: Outcome) -> BakedLight {
        let Estimated { light, error, .. } = estimated;
        let mut light = Arc::unwrap_or_clone(light);
        let EstimatedError { whole: estimate, groups, vertices, .. } = error;
        light.surface.error = vertices;
        let (solve, measure) = (self.solve, self.measure);
        let settings = BakeSettings { solve, gather: Some(self.gather), measure };
        BakedLight { light, estimate, groups, outcome, settings }
    }
}
