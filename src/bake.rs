//! A whole bake: from a scene to radiosity at vertices, as far as an effort goes, or until an
//! accuracy is reached.

mod settling;
mod shot;

use std::sync::Arc;
use std::time::Instant;

use crate::certificate::Certificate;
use crate::device::Device;
use crate::device::backed::Backed;
use crate::effort::Effort;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::scene::Scene;
use crate::solve::{Go, Progress, Solution, Stop};
use crate::vertex::gathering::{GatherProgress, GatheredRadiosity};
use crate::vertex::refined::Refined;
use settling::Settling;
use shot::Shot;

/// What came out of a bake.
#[derive(Clone, Debug)]
pub struct Baked {
    /// The mesh that light was shot on.
    pub mesh: Mesh,
    /// The light of its elements.
    pub solution: Solution,
    /// Radiosity at vertices, each with the error it may have.
    pub light: GatheredRadiosity,
    /// How far off that is.
    pub certificate: Certificate,
    /// The settings that were used in the end.
    pub effort: Effort,
    /// Rows drawn or cast, those of all rotations and viewpoints counted.
    pub hemicubes: u64,
    /// Hemicubes drawn at each resolution; none where rays were cast.
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Share of a row that the proximity repair moved, in the mean.
    pub near_moved: f64,
    /// What the graphics device failed of, if it did; from then on rays on the CPU saw.
    pub failure: Option<Error>,
    /// Where the time went.
    pub seconds: BakeSeconds,
}

/// Seconds of wall time by stage.
#[derive(Clone, Copy, Debug, Default)]
pub struct BakeSeconds {
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

impl BakeSeconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        let rows = self.draw + self.reduce + self.readback;
        self.mesh + rows + self.solve + self.vertices + self.certificate
    }
}

/// What a bake is at, told often.
#[derive(Clone, Debug)]
pub enum Stage {
    /// Light is shot.
    Shooting(Progress),
    /// Vertices gather.
    Gathering(GatherProgress),
    /// Random places are looked at, to judge by.
    Judging {
        /// Places looked at so far.
        places: usize,
        /// How many there are.
        of: usize,
    },
    /// The solution was judged.
    Judged(Certificate),
    /// The graphics device failed. Nothing is lost: rays on the CPU go on from here, in more time, or
    /// what was reached is returned.
    Failed(Error),
}

/// Whoever is told of the stages of a bake, and may stop it.
pub(crate) type Tell<'a> = &'a mut dyn FnMut(&Stage) -> Go;

impl Effort {
    /// Bakes `scene` as far as these settings go. `progress` may stop it at any time: what was
    /// reached is returned.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] for a setting out of range; [`crate::ErrorKind::Device`] and
    /// [`crate::ErrorKind::Memory`] when the device cannot even start. One that fails later is in
    /// [`Baked::failure`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        device: &Device,
        mut progress: impl FnMut(&Stage) -> Go,
    ) -> Result<Baked, Error> {
        self.bake_until(&scene.into(), device, &Goal::None, &mut progress)
    }

    /// As [`Effort::bake`], and on until `goal` is reached.
    pub(crate) fn bake_until(
        &self,
        scene: &Arc<Scene>,
        device: &Device,
        goal: &Goal,
        progress: Tell,
    ) -> Result<Baked, Error> {
        let device = &Backed::new(device);
        let shot = Shot::new(self, scene, device, progress)?;
        let light = GatheredRadiosity::from_elements(&shot.mesh, &shot.solution.radiosity)?;
        let (light, certificate, shot, effort) = match &self.gather {
            Some(gather) if shot.solution.stop != Stop::Cancelled => {
                let mesh = Mesh::new(scene.clone(), gather.element_size)?;
                let mesh = mesh.split_at_contacts(gather.contacts);
                let state = Refined::new(mesh.clone(), &light);
                let looks = device.gather(&mesh, gather.rays, gather.noise, state.dim())?;
                Settling { effort: self.clone(), state, looks, device, shot }
                    .until(goal, progress)?
            }
            _ => shot.judge(self, light, device, progress)?,
        };
        let Shot {
            mesh, solution, hemicubes, hemicubes_by_resolution, near_moved, seconds, ..
        } = shot;
        Ok(Baked {
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
    Error(f64, &'a dyn Fn(&mut Effort)),
}

/// Seconds since `then`, which becomes now.
fn lap(then: &mut Instant) -> f64 {
    let seconds = then.elapsed().as_secs_f64();
    *then = Instant::now();
    seconds
}

/// Places that the certificate looks at, at least.
const LEAST_PLACES: usize = 192;
