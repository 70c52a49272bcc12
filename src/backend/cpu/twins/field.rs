//! Twin of `shaders/shared/field.wgsl`: the radiosity that surfaces reflect, and their reflectance.

use glam::{Vec2, Vec3, Vec4};

use super::element::{between, element_at};
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

/// The field at a position of a triangle: `elements` are texels of lines of [`TEXELS_PER_LINE`],
/// the corners of an element below one another, each with a channel of its reflectance.
pub fn field_at(
    quadtrees: &[u32],
    elements: &[[f32; 4]],
    triangle: u32,
    weights: Vec2,
) -> OnElement {
    let at = element_at(quadtrees, triangle, weights);
    let corners = [0, 1, 2].map(|k| {
        let line = at.element / TEXELS_PER_LINE * 3 + k;
        Vec4::from(elements[(line * TEXELS_PER_LINE + at.element % TEXELS_PER_LINE) as usize])
    });
    OnElement {
        radiosity: between(corners.map(Vec4::truncate), at.weights),
        reflectance: Vec3::from_array(corners.map(|texel| texel.w)),
        side: at.side,
    }
}
