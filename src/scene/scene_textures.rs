//! The textures of a scene.

use std::collections::BTreeMap;

use glam::DVec2;

use super::rgb::Rgb;
use super::texture::MaterialTextures;

/// Textures of materials, and where they lie on triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneTextures {
    /// Of the corners of each triangle; empty where no material has textures and nobody asked for
    /// them.
    pub coordinates: Vec<[DVec2; 3]>,
    /// Of the materials that have some, by their indices.
    pub of_materials: BTreeMap<u32, MaterialTextures>,
    /// Exitance of each triangle over that of its material; empty where no texture emits.
    pub relative_exitance: Vec<Rgb>,
    /// The share of each triangle that is solid; empty where no material has a mask.
    pub solid_shares: Vec<f64>,
}

impl SceneTextures {
    /// No textures, and these texture coordinates.
    pub fn of_coordinates(coordinates: Vec<[DVec2; 3]>) -> SceneTextures {
        SceneTextures { coordinates, ..SceneTextures::default() }
    }
}
