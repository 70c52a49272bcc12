//! A whole bake: from a scene to radiosity at vertices, as far as an effort goes, or until an
//! accuracy is reached.

use std::ops::ControlFlow;
mod error_estimate;
mod fallback;
mod gather_phase;
mod settings;
mod shooting_phase;
mod target;

use std::sync::Arc;
use std::time::Instant;

use crate::backend::Backend;
use crate::bake::fallback::ResilientBackend;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::solver::{Progress, Solution, StopReason};
use crate::vertex::adaptive::AdaptiveGather;
use crate::vertex::gathering::{GatherProgress, GatheredMesh};
pub use error_estimate::ErrorEstimate;
use gather_phase::GatherPhase;
pub use settings::{BakeSettings, GatherSettings};
use shooting_phase::ShootingPhase;
pub use target::{Accuracy, Budget};

/// What came out of a bake.
#[derive(Clone, Debug)]
pub struct BakeResult {
    /// The mesh that light was shot on.
    pub mesh: Mesh,
    /// The light of its elements.
    pub solution: Solution,
    /// Radiosity at vertices, each with the error it may have.
    pub light: GatheredMesh,
    /// How far off that is.
    pub certificate: ErrorEstimate,
    /// The settings that were used in the end.
    pub effort: BakeSettings,
    /// Rows drawn or cast, those of all rotations and viewpoints counted.
    pub hemicubes: u64,
    /// HemicubeRows drawn at each resolution; none where rays were cast.
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Share of a row that the proximity repair moved, in the mean.
    pub near_moved: f64,
    /// What the graphics device failed of, if it did; from then on rays on the CPU saw.
    pub failure: Option<Error>,
    /// Where the time went.
    pub seconds: Timings,
}

/// Seconds of wall time by stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct Timings {
    /// Cutting the scene into elements, and getting the device ready.
    pub mesh: f64,
    /// Rendering item buffers, or casting rays.
    pub draw: f64,
    /// Adding up pixel weights.
    pub reduce: f64,
    /// Getting rows from the device.
    pub readback: f64,
    /// Shooting along rows, repairs of rows included.
    pub solve: f64,
    /// Elements to vertices, gathering and splitting included.
    pub vertices: f64,
    /// Judging what was found.
    pub certificate: f64,
}

impl Timings {
    /// All of it.
    pub fn total(&self) -> f64 {
        let rows = self.draw + self.reduce + self.readback;
        self.mesh + rows + self.solve + self.vertices + self.certificate
    }
}

/// What a bake is at, told often.
#[derive(Clone, Debug)]
pub enum BakeProgress {
    /// Light is shot.
    Shooting(Progress),
    /// Vertices gather.
    RefinementSettings(GatherProgress),
    /// Random places are looked at, to judge by.
    Judging {
        /// Places looked at so far.
        places: usize,
        /// How many there are.
        of: usize,
    },
    /// The solution was judged.
    ErrorEstimator(ErrorEstimate),
    /// The graphics device failed. Nothing is lost: rays on the CPU go on from here, in more time, or
    /// what was reached is returned.
    Failed(Error),
}

/// Whoever is told of the stages of a bake, and may stop it.
pub(crate) type ProgressCallback<'a> = &'a mut dyn FnMut(&BakeProgress) -> ControlFlow<()>;

impl BakeSettings {
    /// Bakes `scene` as far as these settings go. `progress` may stop it at any time: what was
    /// reached is returned.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] for a setting out of range; [`crate::ErrorKind::Device`] and
    /// [`crate::ErrorKind::Memory`] when the device cannot even start. One that fails later is in
    /// [`BakeResult::failure`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        device: &Backend,
        mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        self.bake_until(&scene.into(), device, &Goal::None, &mut progress)
    }

    /// As [`BakeSettings::bake`], and on until `goal` is reached.
    pub(crate) fn bake_until(
        &self,
        scene: &Arc<Scene>,
        device: &Backend,
        goal: &Goal,
        progress: ProgressCallback,
    ) -> Result<BakeResult, Error> {
        let device = &ResilientBackend::new(device);
        let shot = ShootingPhase::new(self, scene, device, progress)?;
        let light = GatheredMesh::from_elements(&shot.mesh, &shot.solution.radiosity)?;
        let (light, certificate, shot, effort) = match &self.gather {
            Some(gather) if shot.solution.stop != StopReason::Cancelled => {
                let mesh = Mesh::new(scene.clone(), gather.element_size)?;
                let mesh = mesh.split_at_contacts(gather.contacts);
                let state = AdaptiveGather::new(mesh.clone(), &light);
                let looks = device.gather(&mesh, gather.rays, gather.noise, state.dim())?;
                GatherPhase { effort: self.clone(), state, looks, device, shot }
                    .until(goal, progress)?
            }
            _ => shot.judge(self, light, device, progress)?,
        };
        let ShootingPhase {
            mesh,
            solution,
            hemicubes,
            hemicubes_by_resolution,
            near_moved,
            seconds,
            ..
        } = shot;
        Ok(BakeResult {
            mesh,
            solution,
            light,
            certificate,
            effort,
            hemicubes,
            hemicubes_by_resolution,
            near_moved,
            failure: device.failure(),
            seconds,
        })
    }
}

/// What is asked of the certificate.
pub(crate) enum Goal<'a> {
    /// Nothing: the settings say how far to go.
    None,
    /// That it is below an error; whatever settings that takes are then adjusted by hand.
    Error(f64, &'a dyn Fn(&mut BakeSettings)),
}

/// Seconds since `then`, which becomes now.
fn lap(then: &mut Instant) -> f64 {
    let seconds = then.elapsed().as_secs_f64();
    *then = Instant::now();
    seconds
}

/// Places that the certificate looks at, at least.
const LEAST_PLACES: usize = 192;
