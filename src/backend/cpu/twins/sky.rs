//! Twin of `shaders/shared/sky.wgsl`: light from outside.

use std::f32::consts::PI;

use glam::{Vec2, Vec3, Vec4};

use crate::backend::gpu::traced_scene::TracedArrays;

/// Light from the sky along a direction, as the radiosity of a surface.
pub fn from_sky(scene: &TracedArrays, direction: Vec3) -> Vec3 {
    let info = &scene.info;
    if info.sky_side == 0 {
        return info.sky.into();
    }
    let along = Vec3::from_array(
        [info.sky_x, info.sky_y, info.sky_z].map(|axis| Vec3::from(axis).dot(direction)),
    );
    let d = along / along.abs().element_sum();
    let side = info.sky_side as f32;
    let last = info.sky_side - 1;
    let column = (((d.x + d.y + 1.0) * 0.5 * side).max(0.0) as u32).min(last);
    let line = (((d.x - d.y + 1.0) * 0.5 * side).max(0.0) as u32).min(last);
    let square = if d.z < 0.0 { info.sky_side } else { 0 };
    Vec4::from(scene.sky[((square + line) * info.sky_side + column) as usize]).truncate()
}

/// The direction to a point on the sun.
pub fn towards_sun(scene: &TracedArrays, at: Vec2) -> Vec3 {
    let info = &scene.info;
    let [middle, right, up] = [info.sun_middle, info.sun_right, info.sun_up].map(Vec3::from);
    let (sine, cosine) = (2.0 * PI * at.y).sin_cos();
    (middle + (right * cosine + up * sine) * at.x.sqrt()).normalize()
}
