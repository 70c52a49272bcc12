//! Twin of `shaders/radiance.wgsl`: what a point sees, and which part of each light.

use glam::{Vec2, Vec3, Vec4};

use super::rasterizer::{DepthTest, Fragment, Image, Viewport};
use super::shared::{
    NOWHERE, cell_index, clip_position, from_eye, has_flipped_cell, lattice_corner, lattice_square,
    shows_covered_back,
};
use crate::backend::gpu::layout::{
    Corner, ELEMENTS_A_LINE, INNER, Lattice, RadianceTriangle, RadianceView,
};

/// What the shader is bound to.
#[derive(Clone, Copy, Debug)]
pub struct Radiance<'a> {
    pub corners: &'a [Corner],
    pub triangles: &'a [RadianceTriangle],
    pub lattices: &'a [Lattice],
    pub nodes: &'a [u32],
    /// Texels of lines of [`ELEMENTS_A_LINE`].
    pub elements: &'a [[f32; 4]],
}

/// What goes from the vertex to the fragment stage.
#[derive(Clone, Copy, Debug)]
struct Varying {
    position: Vec4,
    lattice: Vec2,
    exitance: Vec3,
    grid: Lattice,
    /// 1 on the light that the view looks for.
    sought: f32,
}

/// A view in an image: where it is drawn, and how far pixel centres are shifted, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    pub view: &'a RadianceView,
    pub viewport: Viewport,
    pub offset: [f64; 2],
}

impl Radiance<'_> {
    /// Draws a face of the hemicube.
    pub fn draw_face(&self, image: &mut Image<Vec4>, target: Target, triangles: u32) {
        let nearest = DepthTest::Nearest;
        self.draw(image, target, 0..triangles, nearest, |v, fragment, pixel| {
            *pixel = self.radiance(&v, fragment);
        });
    }

    /// Draws the tile of a light: the `light` triangles alone in alpha, then the scene in red.
    pub fn draw_tile(
        &self,
        image: &mut Image<Vec4>,
        target: Target,
        light: std::ops::Range<u32>,
        triangles: u32,
    ) {
        self.draw(image, target, light, DepthTest::AnyFront, |v, fragment, pixel| {
            pixel.w = light_visibility(&v, fragment);
        });
        self.draw(image, target, 0..triangles, DepthTest::Nearest, |v, fragment, pixel| {
            pixel.x = light_visibility(&v, fragment);
        });
    }

    /// Draws the tile of the sun: in red that something hides it.
    pub fn draw_sun_tile(&self, image: &mut Image<Vec4>, target: Target, triangles: u32) {
        self.draw(image, target, 0..triangles, DepthTest::Nearest, |_, _, pixel| pixel.x = 1.0);
    }

    fn draw(
        &self,
        image: &mut Image<Vec4>,
        target: Target,
        triangles: std::ops::Range<u32>,
        test: DepthTest,
        shade: impl Fn(Varying, &Fragment, &mut Vec4),
    ) {
        for t in triangles {
            let v = [0, 1, 2].map(|k| self.vertex(3 * t + k, target.view));
            let corners = v.map(|v| v.position.to_array());
            image.draw(corners, target.viewport, target.offset, test, |fragment, pixel| {
                let lattice = (0..3).map(|k| v[k].lattice * fragment.weights[k]).sum();
                shade(Varying { lattice, ..v[0] }, fragment, pixel);
            });
        }
    }

    fn vertex(&self, index: u32, view: &RadianceView) -> Varying {
        let triangle = &self.triangles[index as usize / 3];
        let corner = &self.corners[index as usize];
        let [eye, eye_low] = [view.eye, view.eye_low].map(Vec3::from);
        let d = from_eye(corner, eye, eye_low);
        let x = d.dot(Vec3::from(view.right));
        let y = d.dot(Vec3::from(view.up));
        let w = d.dot(Vec3::from(view.forward));
        let grid = self.lattices[triangle.index as usize];
        let has_tile = view.lights[..view.light_count as usize].contains(&triangle.light);
        let is_hidden = shows_covered_back(self.corners, index, eye, eye_low);
        let position =
            if is_hidden { NOWHERE } else { clip_position(x, y, w, view.bottom, view.near) };
        Varying {
            position,
            lattice: lattice_corner(index % 3, grid.side),
            exitance: if has_tile { Vec3::ZERO } else { triangle.exitance.into() },
            grid,
            sought: f32::from(triangle.light == view.light),
        }
    }

    /// Reflected radiosity at a position of a triangle's lattice.
    fn reflected(&self, lattice: Vec2, grid: Lattice) -> Vec3 {
        let inside = lattice.max(Vec2::ZERO);
        let at = inside * (grid.side as f32 / (inside.x + inside.y).max(1e-30)).min(1.0);
        let square = lattice_square(at, grid.side);
        let mut p = at - square.as_vec2();
        let beyond = p.x + p.y > 1.0 && has_flipped_cell(square, grid.side);
        if beyond {
            p = 1.0 - p;
        }
        let mut node = self.nodes[(grid.first + cell_index(square, grid.side, beyond)) as usize];
        while node & INNER != 0 {
            let first_child = node & !INNER;
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
            node = self.nodes[(first_child + child) as usize];
        }
        let [a, b, c] = [0, 1, 2].map(|k| {
            let line = node / ELEMENTS_A_LINE * 3 + k;
            let texel = self.elements[(line * ELEMENTS_A_LINE + node % ELEMENTS_A_LINE) as usize];
            Vec4::from(texel).truncate()
        });
        a + (b - a) * p.x + (c - a) * p.y
    }

    fn radiance(&self, v: &Varying, fragment: &Fragment) -> Vec4 {
        if !fragment.front {
            return Vec4::new(0.0, 0.0, 0.0, -fragment.inverse_w);
        }
        (self.reflected(v.lattice, v.grid) + v.exitance).extend(fragment.inverse_w)
    }
}

fn light_visibility(v: &Varying, fragment: &Fragment) -> f32 {
    if fragment.front { v.sought } else { 0.0 }
}
