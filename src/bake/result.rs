//! What comes out of a bake.

use crate::backend::RowMaker;
use crate::bake::error_estimate::{ErrorEstimate, GroupError};
use crate::bake::outcome::Outcome;
use crate::bake::settings::BakeSettings;
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::mesh::Mesh;
use crate::progress::Timings;
use crate::solver::Solution;

/// What comes out of a bake.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakeResult {
    /// The mesh that light was shot on; its [`scene`](Mesh::scene) is what was baked.
    pub mesh: Mesh,
    /// Radiosity of the elements of [`BakeResult::mesh`].
    pub solution: Solution,
    /// Radiosity at vertices, each with its estimated error, on a mesh of its own. Most programs
    /// need only [`GatheredMesh::surface`] of it: positions, faces, radiosity.
    pub light: GatheredMesh,
    /// Estimated error of [`BakeResult::light`].
    pub estimate: ErrorEstimate,
    /// The same for each group of the scene that reflects, the largest first; those beyond the
    /// largest 64 are judged together, as a part of the whole.
    pub groups: Vec<GroupError>,
    /// Whether the error that was asked for was met and, if not, what stood in the way.
    pub outcome: Outcome,
    /// The settings that were used in the end.
    pub settings: BakeSettings,
    /// Hemicubes drawn, or rows of rays cast.
    pub hemicubes: u64,
    /// Which of the two: what [`Backend::row_maker`](crate::Backend::row_maker) chose, or rays
    /// where the mesh does not fit the device. Where a device failed on the way, what it began
    /// with.
    pub row_maker: RowMaker,
    /// Hemicubes drawn at each resolution (pixels along an edge of the top face); empty where rays
    /// were cast.
    pub hemicubes_by_resolution: Vec<(u32, u64)>,
    /// Mean share of a row that the correction of near receivers moved:
    /// [`crate::form_factor::ProximityCorrection`].
    pub mean_near_correction: f64,
    /// Why the graphics device failed, if it did; from then on rays were cast on the CPU.
    pub device_failure: Option<Error>,
    /// Wall time by stage.
    pub timings: Timings,
}

/// Light with its estimated error, and the settings it took.
pub(super) struct BakedLight {
    pub light: GatheredMesh,
    pub estimate: ErrorEstimate,
    pub groups: Vec<GroupError>,
    pub outcome: Outcome,
    pub settings: BakeSettings,
}
