//! A small software rasterizer with the conventions of the draw passes, for their twins.
//!
//! Triangles are not clipped: with clip coordinates v0, v1, v2 as columns (x, y, w) the pixel at
//! p = (X, Y, 1) sees the point Σ λᵢ vᵢ with λᵢ = w bᵢ and bᵢ = p·(vⱼ × vₖ) / v0·(v1 × v2), where
//! 1/w = Σ bᵢ (Olano and Greer 1997). It is in the triangle where no bᵢ is negative and 1/w is
//! positive, on its front where v0·(v1 × v2) is positive. Arithmetic is in f64.
//!
//! Devices snap corners to a grid of 1/256 pixel (at least 1/16 by the Vulkan specification), so
//! pixels that close to an outline may go either way: callers shift the pixel centres by `offset`
//! to detect them.

use glam::DVec3;

/// The part of an image that a view fills, pixels.
#[derive(Clone, Copy, Debug)]
pub struct Viewport {
    pub x: u32,
    pub y: u32,
    pub width: u32,
    pub height: u32,
}

/// One triangle at one pixel centre.
#[derive(Clone, Copy, Debug)]
pub struct Fragment {
    /// Perspective-correct weights of the three corners.
    pub weights: [f32; 3],
    pub front: bool,
}

/// An image of the first attachment, with the depth of the second.
#[derive(Clone, Debug)]
pub struct Image<T> {
    pub width: u32,
    pub pixels: Vec<T>,
    depth: Vec<f64>,
}

impl<T: Copy> Image<T> {
    /// All `clear`.
    pub fn new([width, height]: [u32; 2], clear: T) -> Image<T> {
        let count = (width * height) as usize;
        Image { width, pixels: vec![clear; count], depth: vec![0.0; count] }
    }

    /// Draws one triangle, given in clip coordinates: `shade` changes the pixels where it is
    /// visible.
    pub fn draw(
        &mut self,
        corners: [[f32; 4]; 3],
        viewport: Viewport,
        offset: [f64; 2],
        shade: impl Fn(&Fragment, &mut T),
    ) {
        let v = corners.map(|[x, y, _, w]| DVec3::new(x.into(), y.into(), w.into()));
        let z = DVec3::from_array(corners.map(|[_, _, z, _]| f64::from(z)));
        let volume = v[0].dot(v[1].cross(v[2]));
        let front = volume > 0.0;
        if volume == 0.0 {
            return;
        }
        let edges = [v[1].cross(v[2]), v[2].cross(v[0]), v[0].cross(v[1])].map(|e| e / volume);
        let Viewport { x: left, y: top, width, height } = viewport;
        for y in 0..height {
            for x in 0..width {
                let across = (f64::from(x) + 0.5 + offset[0]) / f64::from(width);
                let down = (f64::from(y) + 0.5 + offset[1]) / f64::from(height);
                let p = DVec3::new(2.0 * across - 1.0, 1.0 - 2.0 * down, 1.0);
                let b = DVec3::from_array(edges.map(|e| e.dot(p)));
                let (inverse_w, depth) = (b.element_sum(), b.dot(z));
                let inside = b.min_element() >= 0.0 && inverse_w > 0.0;
                if !inside || !(0.0..=1.0).contains(&depth) {
                    continue;
                }
                let pixel = ((top + y) * self.width + left + x) as usize;
                // The nearest, front or back; depth is reversed, its clear value 0.
                if depth <= self.depth[pixel] {
                    continue;
                }
                self.depth[pixel] = depth;
                let weights = (b / inverse_w).as_vec3().to_array();
                let fragment = Fragment { weights, front };
                shade(&fragment, &mut self.pixels[pixel]);
            }
        }
    }
}
