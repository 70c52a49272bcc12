//! Twin of `shaders/shared/gather_state.wgsl`: what a gather knows of each of its points between
//! passes.

use bytemuck::{Pod, Zeroable};
use glam::Vec4;

use crate::gather::lights::MAX_EXPLICIT_LIGHTS;

/// A workgroup, of one point.
pub const LANES: u32 = 64;

/// Lights and the sun.
pub const SOURCES: usize = MAX_EXPLICIT_LIGHTS + 1;

/// The sun's place in `visible`.
pub const SUN: usize = MAX_EXPLICIT_LIGHTS;

pub const RAYS_PER_SHADOW_RAY: u32 = 4;

/// Sums over rays.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct RaySums {
    /// What surfaces reflect and the sky sends, but for lights sampled apart.
    pub light: [f32; 3],
    pub escaped: f32,
    /// Exitance of the other lights.
    pub lamps: [f32; 3],
    pub back: f32,
    pub inverse_distance: f32,
    /// The largest of `light` by one ray: a length over the channels.
    pub largest: f32,
    pub padding: [f32; 2],
}

/// Of places on a light, or of rays towards it: form factors of those that are seen, and of all.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Visible {
    pub seen: [f32; 3],
    pub all: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct RankedLight {
    pub light: u32,
    /// Form factor to all of it as if nothing were in between.
    pub factor: f32,
    /// Rays over the hemisphere tell how much of it is seen.
    pub is_wide: u32,
    pub padding: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PointState {
    /// The first half, or what was before; the second half.
    pub rays: [RaySums; 2],
    pub lights: [RankedLight; MAX_EXPLICIT_LIGHTS],
    /// By light and sun, of the first half; of the second.
    pub visible: [Visible; 2 * SOURCES],
    pub light_count: u32,
    /// Rays over the hemisphere.
    pub ray_count: u32,
    /// Rays to each light.
    pub shadow_count: u32,
    /// 1: rays were doubled; 2: rays to lights were; 3: these are the first of both.
    pub pending: u32,
    pub ray_error: f32,
    pub shadow_error: f32,
    pub padding: [u32; 2],
}

impl PointState {
    /// The lights that rays are cast to, or that rays over the hemisphere look for.
    pub fn ranked(&self) -> &[RankedLight] {
        &self.lights[..self.light_count as usize]
    }
}

/// The sum over all lanes, in the order of the shader.
pub fn added_up(mut lanes: [Vec4; LANES as usize]) -> Vec4 {
    let mut step = lanes.len() / 2;
    while step > 0 {
        for lane in 0..step {
            lanes[lane] += lanes[lane + step];
        }
        step /= 2;
    }
    lanes[0]
}
