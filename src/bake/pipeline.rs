//! The phases of a bake in their order.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::backend::Backend;
use crate::bake::controller::ErrorTarget;
use crate::bake::fallback::ResilientBackend;
use crate::bake::gather_phase::GatherPhase;
use crate::bake::model;
use crate::bake::progress::{BakeProgress, ProgressCallback, Reporter, StageClock};
use crate::bake::result::BakeResult;
use crate::bake::settings::{BakeSettings, GatherSettings, SolveSettings};
use crate::bake::shooting_phase::{self, ShotLight};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::mesh::{Mesh, cut_at_contacts, cut_large_triangles};
use crate::progress::StopReason;
use crate::scene::Scene;
use crate::visibility::lit_sides;

impl BakeSettings {
    /// Bakes `scene` as far as these settings go, without regard to the estimated error.
    ///
    /// `progress` may stop the bake at any time: what was reached is returned.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] for a setting out of range; [`crate::ErrorKind::Device`] and
    /// [`crate::ErrorKind::Memory`] when the device cannot even start. One that fails later is in
    /// [`BakeResult::device_failure`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        backend: &Backend,
        mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        run(self, lit_sides::resolved(scene.into()), backend, None, &mut progress)
    }
}

/// Bakes as far as `settings` go and, given a `target`, on until the estimated error meets it.
pub(super) fn run(
    settings: &BakeSettings,
    scene: Arc<Scene>,
    backend: &Backend,
    target: Option<ErrorTarget>,
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    let backend = &ResilientBackend::new(backend);
    let mut pipeline = Pipeline::new(settings, backend, target, progress)?;
    let shot = pipeline.shoot(scene)?;
    pipeline.finish(shot)
}

/// The same by vertices alone: they gather what is emitted, and exchange what they have. Nothing is
/// shot, and triangles are cut along walls if elements are split there.
pub(super) fn run_without_shooting(
    settings: &BakeSettings,
    scene: Arc<Scene>,
    backend: &Backend,
    target: ErrorTarget,
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    let backend = &ResilientBackend::new(backend);
    let pipeline = Pipeline::new(settings, backend, Some(target), progress)?;
    let splits_at_contacts = |gather: &GatherSettings| gather.contact_levels > 0;
    let scene = match settings.gather.as_ref().is_some_and(splits_at_contacts) {
        true => cut_scene(settings, &scene, Some(target)),
        false => with_creases(&scene, model::crease_degrees(target.finest())),
    };
    let sizing = settings.solve.sizing(&scene, settings.solve.element_size);
    let mesh = Mesh::sized(scene, &sizing, model::MAX_SHOOTING_DEPTH)?;
    pipeline.finish(ShotLight::nothing(mesh))
}

/// The phases of a bake, and what all of them need.
struct Pipeline<'p> {
    settings: &'p BakeSettings,
    backend: &'p ResilientBackend<'p>,
    target: Option<ErrorTarget<'p>>,
    reporter: Reporter<'p>,
    clock: StageClock,
}

impl<'p> Pipeline<'p> {
    fn new(
        settings: &'p BakeSettings,
        backend: &'p ResilientBackend<'p>,
        target: Option<ErrorTarget<'p>>,
        progress: ProgressCallback<'p>,
    ) -> Result<Pipeline<'p>, Error> {
        settings.check()?;
        let reporter = Reporter::new(backend, progress);
        Ok(Pipeline { settings, backend, target, reporter, clock: StageClock::start() })
    }

    /// Cuts `scene` and shoots its light.
    fn shoot(&mut self, scene: Arc<Scene>) -> Result<ShotLight, Error> {
        let Pipeline { settings, backend, target, reporter, clock } = self;
        // The scene as it was is no longer needed, nor is its ray hierarchy.
        let scene = cut_scene(settings, &scene, *target);
        shooting_phase::shoot(&settings.solve, &scene, backend, reporter, clock)
    }

    /// Vertices gather what was `shot`.
    fn finish(self, mut shot: ShotLight) -> Result<BakeResult, Error> {
        let Pipeline { settings, backend, target, mut reporter, mut clock } = self;
        let by_elements = GatheredMesh::from_elements(&shot.mesh, &shot.solution.radiosity)?;
        let by_elements = Arc::new(by_elements);
        // Within a time nothing is shot.
        if settings.gather.is_some() && target.is_none_or(|target| target.within.is_none()) {
            let light = BakeProgress::Light { light: by_elements.clone(), estimate: None };
            if reporter.report(light).is_break() {
                shot.solution.stop = StopReason::Cancelled;
            }
        }
        let baked = match &settings.gather {
            Some(gather) if shot.solution.stop != StopReason::Cancelled => {
                let scene = &shot.mesh.shared_scene();
                let mesh = first_gather_mesh(&settings.solve, gather, scene)?;
                let phase =
                    GatherPhase::new(settings, gather, target, mesh, &by_elements, &shot, backend)?;
                drop(by_elements);
                phase.run(&mut reporter, &mut clock)?
            }
            _ => shooting_phase::estimate_elements(
                &shot,
                settings,
                target,
                Arc::unwrap_or_clone(by_elements),
                backend,
                &mut reporter,
                &mut clock,
            )?,
        };
        Ok(BakeResult {
            mesh: shot.mesh,
            solution: shot.solution,
            light: baked.light,
            estimate: baked.estimate,
            groups: baked.groups,
            outcome: baked.outcome,
            settings: baked.settings,
            hemicubes: shot.hemicubes,
            row_maker: shot.row_maker,
            hemicubes_by_resolution: shot.hemicubes_by_resolution,
            mean_near_correction: shot.mean_near_correction,
            device_failure: backend.failure(),
            timings: clock.timings,
        })
    }
}

/// `scene` as it is meshed: with creases, and cut where a triangle is too large for the region of
/// interest and where surfaces touch.
fn cut_scene(
    settings: &BakeSettings,
    scene: &Arc<Scene>,
    target: Option<ErrorTarget>,
) -> Arc<Scene> {
    let (finest, most) = match &settings.gather {
        Some(gather) => (gather.refinement.min_edge, gather.refinement.max_elements),
        None => (settings.solve.element_size, model::MAX_PREVIEW_ELEMENTS),
    };
    let scene = match target {
        Some(target) => &with_creases(scene, model::crease_degrees(target.finest())),
        None => scene,
    };
    let scene = match &settings.solve.region {
        Some(region) => &cut_large_triangles(scene, region),
        None => scene,
    };
    cut_at_contacts(scene, finest, most)
}

/// `scene`, with creases where it does not say and normals differ by more than this.
fn with_creases(scene: &Arc<Scene>, degrees: f64) -> Arc<Scene> {
    match scene.triangles().iter().any(|t| t.smoothing.is_none()) {
        true => Arc::new(scene.with_crease_degrees(degrees)),
        false => scene.clone(),
    }
}

/// The mesh whose vertices gather first: coarser than asked for where that alone would be more than
/// half of the elements that there may be, and not split at contacts where these would be all.
fn first_gather_mesh(
    solve: &SolveSettings,
    gather: &GatherSettings,
    scene: &Arc<Scene>,
) -> Result<Mesh, Error> {
    let most = gather.refinement.max_elements;
    let sizing = solve.sizing(scene, gather.element_size);
    let sizing = sizing.within(scene, Mesh::MAX_DEPTH, most / 2);
    let mesh = Mesh::sized(scene.clone(), &sizing, Mesh::MAX_DEPTH)?;
    if gather.contact_levels == 0 {
        return Ok(mesh);
    }
    let (levels, finest) = (gather.contact_levels, gather.refinement.min_edge);
    let at_contacts =
        mesh.split_at_contacts_down_to(levels, finest).split_beside_cuts(levels, finest);
    Ok(if at_contacts.element_count() > most { mesh } else { at_contacts })
}
