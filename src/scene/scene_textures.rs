//! The textures of a scene.

use std::collections::BTreeMap;

use glam::{DVec2, Vec3};

use super::rgb::Rgb;
use super::texture::MaterialTextures;

/// Textures of materials, and texture coordinates of triangles.
#[derive(Clone, Debug, Default)]
pub(crate) struct SceneTextures {
    /// Of the corners of each triangle; empty if no material has textures and they were not
    /// requested.
    pub coordinates: Vec<[DVec2; 3]>,
    /// Colours of the corners of each triangle, by which reflectances with a texture are
    /// multiplied; empty for white.
    pub colours: Vec<[Vec3; 3]>,
    /// Of the materials with textures, by their indices.
    pub of_materials: BTreeMap<u32, MaterialTextures>,
    /// Ratio of the exitance of each triangle to that of its material; empty if no texture emits.
    pub relative_exitance: Vec<Rgb>,
    /// The solid fraction of each triangle; empty if no material has a mask.
    pub solid_shares: Vec<f64>,
}

impl SceneTextures {
    /// Keeps what belongs to the triangles with these numbers alone, in their order.
    pub fn keep(&mut self, kept: impl Fn(usize) -> bool) {
        fn of<T>(all: &mut Vec<T>, kept: impl Fn(usize) -> bool) {
            let mut t = 0..;
            all.retain(|_| t.next().is_some_and(&kept));
        }
        of(&mut self.coordinates, &kept);
        of(&mut self.colours, &kept);
    }
}
