//! Twin of `shaders/shared/element.wgsl`: the element at a position of a triangle.

use glam::{Vec2, Vec3};

use crate::backend::cpu::shared::{cell_index, has_flipped_cell, lattice_square};
use crate::backend::gpu::layout::INNER;

#[derive(Clone, Copy, Debug)]
pub struct InElement {
    pub element: u32,
    /// Of its second and third corner.
    pub weights: Vec2,
    /// Elements of its size along an edge of the triangle.
    pub side: u32,
}

/// Looked up in a lattice of nodes, then by descent; `weights` are those of the triangle's second
/// and third corner.
pub fn element_at(quadtrees: &[u32], triangle: u32, weights: Vec2) -> InElement {
    let first = quadtrees[2 * triangle as usize];
    let mut side = quadtrees[2 * triangle as usize + 1];
    let at = weights * side as f32;
    let square = lattice_square(at, side);
    let mut p = at - square.as_vec2();
    let beyond = p.x + p.y > 1.0 && has_flipped_cell(square, side);
    if beyond {
        p = 1.0 - p;
    }
    let mut node = quadtrees[(first + cell_index(square, side, beyond)) as usize];
    while node & INNER != 0 {
        let child;
        (child, p) = if p.x > 0.5 {
            (1, 2.0 * p - Vec2::X)
        } else if p.y > 0.5 {
            (2, 2.0 * p - Vec2::Y)
        } else if p.x + p.y > 0.5 {
            (3, 1.0 - 2.0 * p)
        } else {
            (0, 2.0 * p)
        };
        node = quadtrees[((node & !INNER) + child) as usize];
        side *= 2;
    }
    InElement { element: node, weights: p, side }
}

/// Linear interpolation between three corners.
pub fn between([a, b, c]: [Vec3; 3], weights: Vec2) -> Vec3 {
    a + (b - a) * weights.x + (c - a) * weights.y
}
