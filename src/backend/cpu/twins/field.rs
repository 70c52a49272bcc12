//! Twin of `shaders/shared/field.wgsl`: the radiosity that surfaces reflect, and their reflectance.

use glam::{Vec2, Vec3, Vec4};

use super::element::{between, element_at};
use super::ray_arrays::RayArrays;
use super::trace::Hit;
use crate::backend::gpu::layout::TEXELS_PER_LINE;

#[derive(Clone, Copy, Debug)]
pub struct OnElement {
    /// Reflected radiosity.
    pub radiosity: Vec3,
    /// Mean over the element.
    pub reflectance: Vec3,
    /// Elements of its size along an edge of the triangle.
    pub side: u32,
}

/// The field at a hit: elements are texels of lines of [`TEXELS_PER_LINE`], the corners of an
/// element below one another, each with a channel of its reflectance.
pub fn field_at(arrays: &RayArrays, hit: &Hit) -> OnElement {
    let triangle = arrays.scene.triangles[hit.triangle as usize].index;
    let at = element_at(arrays.quadtrees, triangle, Vec2::new(hit.u, hit.v));
    let corners = [0, 1, 2].map(|k| {
        let line = at.element / TEXELS_PER_LINE * 3 + k;
        let texel = line * TEXELS_PER_LINE + at.element % TEXELS_PER_LINE;
        Vec4::from(arrays.elements[texel as usize])
    });
    OnElement {
        radiosity: between(corners.map(Vec4::truncate), at.weights),
        reflectance: Vec3::from_array(corners.map(|texel| texel.w)),
        side: at.side,
    }
}
