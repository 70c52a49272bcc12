//! Twin of `shaders/sky.wgsl`: the sky behind what a point sees.

use glam::{Vec3, Vec4};

use super::radiance::Target;
use super::rasterizer::{DepthTest, Image};
use crate::backend::gpu::layout::{RadianceView, SkyAxes};

/// What the shader is bound to.
#[derive(Clone, Copy, Debug)]
pub struct Sky<'a> {
    pub axes: SkyAxes,
    /// Texels of lines of `axes.side`.
    pub pieces: &'a [[f32; 4]],
}

impl Sky<'_> {
    /// Draws behind a face of the hemicube.
    pub fn draw_face(&self, image: &mut Image<Vec4>, target: Target) {
        let corners = [0, 1, 2].map(|index| self.vertex(index, target.view));
        let positions = corners.map(|(position, _)| position);
        let Target { viewport, offset, .. } = target;
        image.draw(positions, viewport, offset, DepthTest::Behind, |fragment, pixel| {
            let direction = (0..3).map(|k| corners[k].1 * fragment.weights[k]).sum();
            *pixel = self.radiosity(direction);
        });
    }

    /// Clip position and direction.
    fn vertex(&self, index: u32, view: &RadianceView) -> ([f32; 4], Vec3) {
        let [x, y] = [index == 1, index == 2].map(|far| if far { 3.0 } else { -1.0 });
        let height = view.bottom + (1.0 - view.bottom) * (y + 1.0) * 0.5;
        let [right, up, forward] = [view.right, view.up, view.forward].map(Vec3::from);
        let d = forward + right * x + up * height;
        let axes = [self.axes.x, self.axes.y, self.axes.z].map(|axis| Vec3::from(axis).dot(d));
        ([x, y, 0.0, 1.0], axes.into())
    }

    fn radiosity(&self, direction: Vec3) -> Vec4 {
        let d = direction / direction.abs().element_sum();
        let side = self.axes.side;
        let cell = |t: f32| (((t + 1.0) * 0.5 * side as f32).max(0.0) as u32).min(side - 1);
        let square = if d.z < 0.0 { side } else { 0 };
        let k = (square + cell(d.x - d.y)) * side + cell(d.x + d.y);
        Vec4::from(self.pieces[k as usize])
    }
}
