//! Twin of `shaders/shared/gather_state.wgsl`: the state of each point of a gather between passes.

use glam::Vec4;

use crate::backend::gpu::layout::{LANES, shared_structs};
use crate::gather::lights::MAX_EXPLICIT_LIGHTS;

/// Index of the sun in `visible`, after the lights.
pub const SUN: usize = MAX_EXPLICIT_LIGHTS;

shared_structs! {
    /// Sums over rays.
    pub struct RaySums {
        /// Light reflected by surfaces and from the sky, except for near surfaces and lights
        /// sampled separately.
        pub light: [f32; 3],
        pub escaped: f32,
        /// Exitance of the other lights.
        pub lamps: [f32; 3],
        pub back: f32,
        pub inverse_distance: f32,
        /// The largest contribution of one ray to `light`: its length over the channels.
        pub largest: f32,
        /// Number of rays that meet near surfaces.
        pub near: f32,
        /// The same as `largest` of `near_light`.
        pub near_largest: f32,
        /// Light of near surfaces by the field.
        pub near_light: [f32; 3],
        pub padding: f32,
    }

    /// Sums of form factors of points on a light, or of rays towards it: the visible ones, and all.
    pub struct Visible {
        pub seen: [f32; 3],
        pub all: f32,
    }

    /// A light that is sampled separately.
    pub struct RankedLight {
        pub light: u32,
        /// Unoccluded form factor to all of it.
        pub factor: f32,
        /// Whether rays over the hemisphere estimate its visible share.
        pub is_wide: u32,
        pub padding: u32,
    }

    /// A point of a gather.
    pub struct PointState {
        /// The first half, or all earlier rays; the second half.
        pub rays: [RaySums; 2],
        pub lights: [RankedLight; MAX_EXPLICIT_LIGHTS],
        /// For the first half and the second, by light and sun.
        pub visible: [[Visible; SUN + 1]; 2],
        pub light_count: u32,
        /// Number of rays over the hemisphere.
        pub ray_count: u32,
        /// Number of rays to each light.
        pub shadow_count: u32,
        /// 1: rays were doubled; 2: rays to lights were doubled; 3: these are the first of both.
        pub pending: u32,
        pub ray_error: f32,
        pub shadow_error: f32,
        /// Whether paths found the light of near surfaces for earlier rays.
        pub covered: u32,
        pub padding: u32,
    }
}

impl PointState {
    /// The lights that rays are cast to, or that are sampled by rays over the hemisphere.
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
