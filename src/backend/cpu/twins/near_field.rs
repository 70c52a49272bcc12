//! Twin of `shaders/shared/near_field.wgsl`: near surfaces.

use glam::Vec3;

use super::trace::Hit;
use crate::backend::gpu::layout::MIN_COVERED;
use crate::backend::gpu::traced_scene::TracedArrays;

/// Whether a hit is nearer than its element is wide, of which there are `side` along an edge of the
/// triangle.
pub fn is_near(scene: &TracedArrays, hit: &Hit, side: u32) -> bool {
    let t = &scene.triangles[hit.triangle as usize];
    let count = side as f32;
    let square = Vec3::from(t.edge_u).cross(t.edge_v.into()).length() / (count * count);
    hit.distance * hit.distance < square
}

/// Whether paths find the light of near surfaces: `near` of all `rays` hit some.
pub fn is_covered(near: f32, rays: f32) -> bool {
    near > MIN_COVERED * rays
}
