//! Twin of `shaders/item_buffer.wgsl`: the item visible at every pixel of a hemicube.

use glam::{Vec2, Vec3, Vec4};

use super::rasterizer::{Image, Viewport};
use super::shared::{
    cell_index, clip_position, from_eye, has_flipped_cell, lattice_corner, lattice_square,
    shows_covered_back,
};
use crate::backend::gpu::layout::{BACK, Corner, FaceView, OPEN, TriangleCells};
use crate::hemicube::Face;

/// Bindings of the shader.
#[derive(Clone, Copy, Debug)]
pub struct ItemBuffer<'a> {
    pub corners: &'a [Corner],
    pub triangles: &'a [TriangleCells],
}

/// Data from the vertex to the fragment stage.
#[derive(Clone, Copy, Debug)]
struct Varying {
    position: Vec4,
    lattice: Vec2,
}

impl ItemBuffer<'_> {
    /// Draws the five `views` of a hemicube of `resolution`, all triangles for each, with pixel
    /// centres shifted by `offset` pixels.
    pub fn draw(&self, views: &[FaceView], resolution: u32, offset: [f64; 2]) -> Image<u32> {
        let mut image = Image::new([resolution, 3 * resolution], OPEN);
        for (face, view) in views.iter().enumerate() {
            let lines = Face::rows(face, resolution);
            let (y, height) = (lines.start, lines.len() as u32);
            let viewport = Viewport { x: 0, y, width: resolution, height };
            for (t, grid) in (0..).zip(self.triangles) {
                let v = [0, 1, 2].map(|k| self.vertex(3 * t + k, view));
                let corners = v.map(|v| v.position.to_array());
                image.draw(corners, viewport, offset, |fragment, pixel| {
                    let weighted = (0..3).map(|k| v[k].lattice * fragment.weights[k]);
                    *pixel = self.fragment(weighted.sum(), grid, fragment.front);
                });
            }
        }
        image
    }

    fn vertex(&self, index: u32, view: &FaceView) -> Varying {
        let triangle = index / 3;
        let corner = &self.corners[index as usize];
        let [eye, eye_low] = [view.eye, view.eye_low].map(Vec3::from);
        let d = from_eye(corner, eye, eye_low);
        let x = d.dot(Vec3::from(view.right));
        let y = d.dot(Vec3::from(view.up));
        let w = d.dot(Vec3::from(view.forward));
        let mut position = clip_position(x, y, w, view.bottom, view.near);
        if triangle == view.own_triangle || shows_covered_back(self.corners, index, eye, eye_low) {
            position = Vec4::new(0.0, 0.0, -1.0, 1.0); // beyond the far end: not drawn
        }
        let lattice = lattice_corner(index % 3, self.triangles[triangle as usize].side);
        Varying { position, lattice }
    }

    fn fragment(&self, lattice: Vec2, grid: &TriangleCells, front: bool) -> u32 {
        if !front {
            return BACK;
        }
        let p = lattice.max(Vec2::ZERO);
        let square = lattice_square(p, grid.side);
        let past_diagonal = p.x - square.x as f32 + p.y - square.y as f32 > 1.0;
        let beyond = past_diagonal && has_flipped_cell(square, grid.side);
        grid.first + cell_index(square, grid.side, beyond)
    }
}
