//! The data of a scene for the rays of a gather.

use std::sync::Arc;

use crate::gather::light_tree::LightTree;
use crate::gather::light_tree::patch::Patch;
use crate::gather::luminaire_light::LuminaireLight;
use crate::mesh::Mesh;
use crate::sampling::rotation::CellRotation;
use crate::scene::{Luminaire, Scene};
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::RayScene;

/// Rays over the hemisphere per shadow ray to lights. Plain choice; no recorded measurement.
pub(crate) const RAYS_PER_SHADOW_RAY: u32 = 4;

/// Number of rays to lights from a point that casts `rays` over the hemisphere.
pub(super) fn shadow_rays(rays: u32) -> u32 {
    (rays / RAYS_PER_SHADOW_RAY).max(2)
}

/// Surfaces, clear panes and lights of a scene, and the rotation of rays at each of its points.
#[derive(Debug)]
pub(super) struct SceneRays {
    pub scene: Arc<Scene>,
    pub surfaces: Arc<RayScene>,
    pub panes: Panes,
    pub lights: Arc<LightTree<Patch>>,
    luminaires: Arc<LightTree<Luminaire>>,
    pub rotations: CellRotation,
}

impl SceneRays {
    /// Those of the scene of `mesh`.
    pub fn new(mesh: &Mesh) -> SceneRays {
        SceneRays {
            scene: mesh.shared_scene(),
            surfaces: RayScene::of_scene(mesh.scene()),
            panes: Panes::of_scene(mesh.scene()),
            lights: LightTree::of_emitters(mesh.scene()),
            luminaires: LightTree::of_luminaires(mesh.scene()),
            rotations: CellRotation::new(&mesh.scene().bounds()),
        }
    }

    /// The light of luminaires.
    pub fn luminaires(&self) -> LuminaireLight<'_> {
        LuminaireLight {
            luminaires: self.scene.luminaires(),
            tree: &self.luminaires,
            rays: &self.surfaces,
            panes: &self.panes,
            rotations: &self.rotations,
        }
    }
}
