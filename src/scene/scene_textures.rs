//! The textures of a scene.

use std::collections::BTreeMap;

use glam::DVec2;

use super::rgb::Rgb;
use super::texture::MaterialTextures;

/// Textures of materials, and texture coordinates of triangles.
#[derive(Clone, Debug, Default)]
pub(super) struct SceneTextures {
    /// Of the corners of each triangle; empty if no material has textures and they were not
    /// requested.
    pub coordinates: Vec<[DVec2; 3]>,
    /// Of the materials with textures, by their indices.
    pub of_materials: BTreeMap<u32, MaterialTextures>,
    /// Ratio of the exitance of each triangle to that of its material; empty if no texture emits.
    pub relative_exitance: Vec<Rgb>,
    /// The solid fraction of each triangle; empty if no material has a mask.
    pub solid_shares: Vec<f64>,
}

impl SceneTextures {
    /// No textures, and these texture coordinates.
    pub fn of_coordinates(coordinates: Vec<[DVec2; 3]>) -> SceneTextures {
        SceneTextures { coordinates, ..SceneTextures::default() }
    }
}
