//! The draw pass of rows: the scene's triangles over every face of a batch of hemicubes.
//!
//! ```text
//! corners, triangles ──► vertex ──► rasterizer ──► fragment ──► one layer per hemicube, R32Uint
//! views (5 a hemicube) ──┘          depth test     item of      N wide:  top face    N lines
//!                                                  the pixel             side +t     N/2
//!                                                                        side −t     N/2
//!                                                                        side +b     N/2
//!                                                                        side −b     N/2
//! ```
//!
//! The twin on the CPU is `backend/cpu/item_buffer.rs`.

use std::ops::Range;

use super::layout::{Corner, FaceView, TriangleCells};
use super::memory::Memory;
use super::pipeline;
use super::render_targets::RenderTargets;
use crate::error::Error;
use crate::hemicube::Face;

/// The pipeline and buffers to draw the item buffers of a batch of hemicubes, at any resolution.
#[derive(Debug)]
pub struct ItemBuffer {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    views: wgpu::Buffer,
}

/// One face of a hemicube, and the visible runs of the drawing order.
pub struct View {
    pub face: FaceView,
    pub runs: Vec<Range<u32>>,
}

impl ItemBuffer {
    /// Texel format of an item buffer.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

    /// Creates it for triangles in drawing order, three `corners` each, and `batch` hemicubes.
    pub fn new(
        memory: &Memory,
        corners: &[Corner],
        triangles: &[TriangleCells],
        batch: u32,
    ) -> Result<Self, Error> {
        let device = &memory.device;
        let corners = memory.storage("corners", bytemuck::cast_slice(corners))?;
        let triangles = memory.storage("triangles", bytemuck::cast_slice(triangles))?;
        let bytes = u64::from(batch) * 5 * size_of::<FaceView>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let views = memory.buffer("views", bytes, usage)?;
        let module = pipeline::shader(device, "item_buffer.wgsl");
        let pipeline = pipeline::draw(device, &module, ItemBuffer::FORMAT.into());
        let resources = [(0, &corners), (1, &triangles), (2, &views)]
            .map(|(binding, buffer)| (binding, buffer.as_entire_binding()));
        let layout = pipeline.get_bind_group_layout(0);
        let bindings = pipeline::bind_group(device, "item buffer", &layout, &resources);
        Ok(ItemBuffer { pipeline, bindings, views })
    }

    /// Records the drawing of the hemicubes with these `views` (five each) on the layers of
    /// `targets`, with timestamps before the first (query 0) and after the last (query 1).
    pub fn draw(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        targets: &RenderTargets,
        views: &[View],
        queries: Option<&wgpu::QuerySet>,
    ) {
        let faces: Vec<FaceView> = views.iter().map(|v| v.face).collect();
        queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&faces));
        let count = views.len() / 5;
        let pixels = targets.texture.width();
        for hemicube in 0..count {
            let mut pass = targets.pass(encoder, hemicube, count, queries);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            for face in 0..5 {
                let (lines, view) = (Face::rows(face, pixels), 5 * hemicube + face);
                let (y, height) = (lines.start as f32, lines.len() as f32);
                pass.set_viewport(0.0, y, pixels as f32, height, 0.0, 1.0);
                for run in &views[view].runs {
                    pass.draw(3 * run.start..3 * run.end, view as u32..view as u32 + 1);
                }
            }
        }
    }
}
