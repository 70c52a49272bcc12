//! The render pass: the scene's triangles over every face of a batch of hemicubes.

use std::ops::Range;

use super::device::Gpu;
use super::item_table::ItemTable;
use super::layout::{FaceView, ITEM_BUFFER_WGSL, TriangleCells};
use super::memory::Memory;
use super::render_targets::{DepthMode, RenderTargets};
use super::resolution::Resolution;
use super::split_float::SplitFloat;
use crate::error::Error;
use crate::hemicube::Face;
use crate::mesh::Mesh;

/// What it takes to draw the item buffers of a batch of hemicubes, whatever their resolution.
#[derive(Debug)]
pub struct ItemBuffer {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    views: wgpu::Buffer,
}

/// One face of a hemicube, and the places in the drawing order that it can see.
pub struct View {
    pub face: FaceView,
    pub places: Vec<Range<u32>>,
}

impl ItemBuffer {
    /// What an item buffer is made of.
    pub const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::R32Uint;

    /// For the triangles of `mesh` in drawing order, in `local` coordinates; `batch` hemicubes.
    pub fn new(
        memory: &Memory,
        mesh: &Mesh,
        cells: &ItemTable,
        order: &[u32],
        local: &SplitFloat,
        batch: u32,
    ) -> Result<Self, Error> {
        let device = &memory.gpu.device;
        let corners = order.iter().flat_map(|&t| mesh.scene().corners(t as usize));
        let corners = local.corners(corners);
        let triangles: Vec<TriangleCells> =
            order.iter().map(|&t| cells.triangles[t as usize]).collect();
        let corners = memory.storage("corners", bytemuck::cast_slice(&corners))?;
        let triangles = memory.storage("triangles", bytemuck::cast_slice(&triangles))?;
        let bytes = u64::from(batch) * 5 * size_of::<FaceView>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let views = memory.buffer("views", bytes, usage)?;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("item_buffer.wgsl"),
            source: wgpu::ShaderSource::Wgsl(ITEM_BUFFER_WGSL.into()),
        });
        let (target, nearest) = (ItemBuffer::FORMAT.into(), DepthMode::Nearest);
        let pipeline =
            RenderTargets::pipeline(&memory.gpu, &module, None, "fragment", target, nearest);
        let buffers = [&corners, &triangles, &views];
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("item buffer"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[0, 1, 2].map(|k: usize| wgpu::BindGroupEntry {
                binding: k as u32,
                resource: buffers[k].as_entire_binding(),
            }),
        });
        Ok(ItemBuffer { pipeline, bindings, views })
    }

    /// Records the drawing of the hemicubes that `views` (five each) look out from on the layers of
    /// `at`, with timestamps before the first (query 0) and after the last (query 1).
    pub fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        at: &Resolution,
        views: &[View],
        queries: Option<&wgpu::QuerySet>,
    ) {
        let faces: Vec<FaceView> = views.iter().map(|v| v.face).collect();
        gpu.queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&faces));
        let count = views.len() / 5;
        for h in 0..count {
            let mut pass = at.layers.pass(encoder, h, count, queries);
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            let n = at.pixels;
            for face in 0..5 {
                let (lines, view) = (Face::rows(face, n), 5 * h + face);
                let (y, height) = (lines.start as f32, lines.len() as f32);
                pass.set_viewport(0.0, y, n as f32, height, 0.0, 1.0);
                for run in &views[view].places {
                    pass.draw(3 * run.start..3 * run.end, view as u32..view as u32 + 1);
                }
            }
        }
    }
}
