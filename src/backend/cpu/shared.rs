//! Twins of `shaders/shared`: view coordinates of corners, and the cells of a lattice.

use glam::{UVec2, Vec2, Vec3, Vec4};

use crate::backend::gpu::layout::Corner;

/// Vector from the eye, itself in two parts, to a corner.
pub fn from_eye(corner: &Corner, eye: Vec3, eye_low: Vec3) -> Vec3 {
    (Vec3::from(corner.high) - eye) + (Vec3::from(corner.low) - eye_low)
}

/// Whether the eye sees a covered back of the triangle of corner `index`: it is not drawn.
pub fn shows_covered_back(corners: &[Corner], index: u32, eye: Vec3, eye_low: Vec3) -> bool {
    let first = (index - index % 3) as usize;
    let [a, b, c] = [0, 1, 2].map(|k| from_eye(&corners[first + k], eye, eye_low));
    corners[first].back_is_covered != 0 && a.dot((b - a).cross(c - a)) >= 0.0
}

/// Clip coordinates of a point with view coordinates `x`, `y` and `w`.
pub fn clip_position(x: f32, y: f32, w: f32, bottom: f32, near: f32) -> Vec4 {
    Vec4::new(x, (2.0 * y - (1.0 + bottom) * w) / (1.0 - bottom), near, w)
}

/// The three corners of a triangle's lattice.
pub fn lattice_corner(corner: u32, side: u32) -> Vec2 {
    let unit = [Vec2::ZERO, Vec2::X, Vec2::Y];
    side as f32 * unit[corner as usize]
}

/// The square that contains a position.
pub fn lattice_square(p: Vec2, side: u32) -> UVec2 {
    let i = (p.x as u32).min(side - 1);
    UVec2::new(i, (p.y as u32).min(side - 1 - i))
}

/// Whether the square has a flipped cell beyond its diagonal.
pub fn has_flipped_cell(square: UVec2, side: u32) -> bool {
    square.x + square.y + 1 < side
}

/// Index of a cell of the square.
pub fn cell_index(square: UVec2, side: u32, beyond: bool) -> u32 {
    square.x * (2 * side - square.x) + 2 * square.y + u32::from(beyond)
}
