//! Twin of `shaders/shared/field.wgsl`: the radiosity that surfaces reflect.

use glam::{Vec2, Vec3, Vec4};

use super::element::{between, element_at};
use crate::backend::gpu::layout::ELEMENTS_A_LINE;

/// Reflected radiosity at a position of a triangle: `elements` are texels of lines of
/// [`ELEMENTS_A_LINE`], the corners of an element below one another.
pub fn reflected(quadtrees: &[u32], elements: &[[f32; 4]], triangle: u32, weights: Vec2) -> Vec3 {
    let at = element_at(quadtrees, triangle, weights);
    let corners = [0, 1, 2].map(|k| {
        let line = at.element / ELEMENTS_A_LINE * 3 + k;
        let texel = elements[(line * ELEMENTS_A_LINE + at.element % ELEMENTS_A_LINE) as usize];
        Vec4::from(texel).truncate()
    });
    between(corners, at.weights)
}
