//! The holes of triangles that rays are cast at: a ray through a hole has no hit.

use glam::DVec2;

use crate::geometry::barycentric::WHOLE;
use crate::scene::Scene;
use crate::scene::texture::TextureMap;

/// Holes of triangles.
#[derive(Debug)]
pub(crate) struct CutOuts {
    /// One per material of the scene.
    masks: Vec<Option<TextureMap>>,
    /// Per triangle, its material and the texture coordinates of its corners.
    corners: Vec<(u32, [DVec2; 3])>,
}

impl CutOuts {
    /// The holes of some `triangles` of `scene`, in their order; `None` in a scene without.
    pub fn new(scene: &Scene, triangles: impl Iterator<Item = usize>) -> Option<CutOuts> {
        if !scene.has_cut_outs() {
            return None;
        }
        let mut masks = vec![None; scene.materials().len()];
        let corners_of = |t: usize| {
            let material = scene.triangles()[t].material;
            let mask = &mut masks[material as usize];
            if mask.is_none() {
                *mask = scene.mask(t).cloned();
            }
            (material, WHOLE.map(|corner| scene.texture_point(t, corner)))
        };
        let corners = triangles.map(corners_of).collect();
        Some(CutOuts { masks, corners })
    }

    /// Whether triangle number `triangle` is solid at the point where its second and third corner
    /// have these weights.
    #[inline]
    pub fn is_solid(&self, triangle: usize, [u, v]: [f64; 2]) -> bool {
        let (material, [a, b, c]) = self.corners[triangle];
        let mask = self.masks[material as usize].as_ref();
        mask.is_none_or(|mask| mask.is_solid(a * (1.0 - u - v) + b * u + c * v))
    }
}
