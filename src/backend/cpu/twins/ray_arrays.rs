//! The arrays that the shaders of rays read.

use glam::{Vec3, Vec4};

use super::trace::turned;
use crate::backend::gpu::traced_scene::TracedArrays;

/// The scene, and what rays from points or patches look up in it.
#[derive(Clone, Copy, Debug)]
pub struct RayArrays<'a> {
    pub scene: &'a TracedArrays,
    pub quadtrees: &'a [u32],
    /// Texels of the elements of a field; empty for rows.
    pub elements: &'a [[f32; 4]],
    /// Coordinates along two tangents and the normal, ray by ray.
    pub directions: &'a [[f32; 4]],
}

impl RayArrays<'_> {
    /// The direction of ray `k` above a surface with this normal and rotation, in turns.
    pub fn direction(&self, k: u32, normal: [f32; 3], rotation: f32) -> Vec3 {
        let local = Vec4::from(self.directions[k as usize]).truncate();
        turned(local, normal.into(), rotation)
    }
}
