//! The phases of a bake in their order.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::backend::Backend;
use crate::bake::fallback::ResilientBackend;
use crate::bake::gather_phase::GatherPhase;
use crate::bake::progress::{BakeProgress, ProgressCallback};
use crate::bake::result::BakeResult;
use crate::bake::settings::BakeSettings;
use crate::bake::shooting_phase::ShootingPhase;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Scene;
use crate::vertex::adaptive::AdaptiveGather;
use crate::vertex::gathering::GatheredMesh;

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
        run(self, &scene.into(), backend, None, &mut progress)
    }
}

/// An error to be reached.
#[derive(Clone, Copy)]
pub(super) struct ErrorTarget<'a> {
    /// Root mean square error, relative, in (0, 1).
    pub error: f64,
    /// Sets by hand what was chosen, after every choice.
    pub overrides: &'a dyn Fn(&mut BakeSettings),
}

/// Bakes as far as `settings` go and, given a `target`, on until the estimated error meets it.
pub(super) fn run(
    settings: &BakeSettings,
    scene: &Arc<Scene>,
    backend: &Backend,
    target: Option<ErrorTarget>,
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    let backend = &ResilientBackend::new(backend);
    let shot = ShootingPhase::new(settings, scene, backend, progress)?;
    let light = GatheredMesh::from_elements(&shot.mesh, &shot.solution.radiosity)?;
    let (light, estimate, shot, settings) = match &settings.gather {
        Some(gather) if shot.solution.stop != StopReason::Cancelled => {
            let mesh = Mesh::new(scene.clone(), gather.element_size)?;
            let mesh = mesh.split_at_contacts(gather.contact_levels);
            let state = AdaptiveGather::new(mesh.clone(), &light);
            let looks = backend.gather(&mesh, gather.rays, gather.noise_tolerance, state.dim())?;
            GatherPhase { effort: settings.clone(), state, looks, device: backend, shot }
                .until(target, progress)?
        }
        _ => shot.judge(settings, light, backend, progress)?,
    };
    Ok(BakeResult {
        mesh: shot.mesh,
        solution: shot.solution,
        light,
        estimate,
        settings,
        hemicubes: shot.hemicubes,
        hemicubes_by_resolution: shot.hemicubes_by_resolution,
        mean_near_correction: shot.near_moved,
        device_failure: backend.failure(),
        timings: shot.seconds,
    })
}
