//! The holes of triangles that rays are cast at: a hit in one is none.

use glam::DVec2;

use super::ray_scene::Hit;
use crate::scene::Scene;
use crate::scene::texture::TextureMap;

/// Where triangles have holes.
#[derive(Debug)]
pub(crate) struct CutOuts {
    /// Of each material of the scene.
    masks: Vec<Option<TextureMap>>,
    /// Of each triangle its material, and the texture coordinates of its corners.
    places: Vec<(u32, [DVec2; 3])>,
}

impl CutOuts {
    /// Those of pieces of triangles of `scene`: each triangle, and the weights of its second and
    /// third corner at the corners of the piece. None in a scene without.
    pub fn new(
        scene: &Scene,
        pieces: impl Iterator<Item = (usize, [[f64; 2]; 3])>,
    ) -> Option<CutOuts> {
        if !scene.has_cut_outs() {
            return None;
        }
        let mut masks = vec![None; scene.materials().len()];
        let place = |(t, corners): (usize, [[f64; 2]; 3])| {
            let material = scene.triangles()[t].material;
            let mask = &mut masks[material as usize];
            if mask.is_none() {
                *mask = scene.mask(t).cloned();
            }
            (material, corners.map(|corner| scene.texture_place(t, corner)))
        };
        let places = pieces.map(place).collect();
        Some(CutOuts { masks, places })
    }

    /// Whether what was hit is there.
    #[inline]
    pub fn is_solid(&self, hit: &Hit) -> bool {
        let (material, [a, b, c]) = self.places[hit.triangle];
        self.masks[material as usize]
            .as_ref()
            .is_none_or(|mask| mask.is_solid(a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v))
    }
}
