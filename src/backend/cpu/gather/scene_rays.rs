//! The data of a scene for the rays of a gather.

use std::sync::Arc;

use crate::gather::lights::Lights;
use crate::gather::luminaire_light::LuminaireLight;
use crate::mesh::Mesh;
use crate::sampling::rotation::CellRotation;
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Rays over the hemisphere per shadow ray to each light. Plain choice; no recorded measurement.
pub(crate) const RAYS_PER_SHADOW_RAY: u32 = 4;

/// Surfaces, clear panes and lights of a scene, and the rotation of rays at each of its points.
#[derive(Debug)]
pub(super) struct SceneRays {
    pub surfaces: Arc<RayScene>,
    pub panes: Panes,
    pub lights: Lights,
    pub rotations: CellRotation,
}

impl SceneRays {
    /// Those of the scene of `mesh`.
    pub fn new(mesh: &Mesh) -> SceneRays {
        SceneRays {
            surfaces: RayScene::of_scene(mesh.scene()),
            panes: Panes::of_scene(mesh.scene()),
            lights: Lights::new(mesh.shared_scene()),
            rotations: CellRotation::new(&mesh.scene().bounds()),
        }
    }

    /// The light of luminaires.
    pub fn luminaires(&self) -> LuminaireLight<'_> {
        LuminaireLight {
            luminaires: self.lights.scene().luminaires(),
            rays: &self.surfaces,
            panes: &self.panes,
            rotations: &self.rotations,
        }
    }
}
