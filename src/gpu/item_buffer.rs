//! The render pass: the scene's triangles over every face of a batch of hemicubes.

use std::ops::Range;

use glam::DVec3;
use wgpu::util::DeviceExt;

use super::cells::Cells;
use super::device::Gpu;
use super::layout::{FaceView, ITEM_BUFFER_WGSL, TriangleCells};
use crate::hemicube::Face;
use crate::mesh::Mesh;

/// Item buffers of a batch of hemicubes, and what it takes to draw them.
///
/// Each is a layer of its own, so that its pixels do not depend on its place in the batch; all
/// share one depth buffer.
#[derive(Debug)]
pub struct ItemBuffer {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    views: wgpu::Buffer,
    pub items: wgpu::Texture,
    layers: Vec<wgpu::TextureView>,
    depth: wgpu::TextureView,
    resolution: u32,
}

/// One face of a hemicube, and the places in the drawing order that it can see.
pub struct View {
    pub face: FaceView,
    pub places: Vec<Range<u32>>,
}

impl ItemBuffer {
    /// For the triangles of `mesh` in drawing order, relative to `origin`; `batch` hemicubes of
    /// `resolution`.
    pub fn new(
        gpu: &Gpu,
        mesh: &Mesh,
        cells: &Cells,
        order: &[u32],
        origin: DVec3,
        resolution: u32,
        batch: u32,
    ) -> Self {
        let device = &gpu.device;
        let corners: Vec<[f32; 4]> = order
            .iter()
            .flat_map(|&t| mesh.scene().corners(t as usize))
            .map(|p| (p - origin).as_vec3().extend(1.0).to_array())
            .collect();
        let triangles: Vec<TriangleCells> =
            order.iter().map(|&t| cells.triangles[t as usize]).collect();
        let storage = |label, contents: &[u8]| {
            let usage = wgpu::BufferUsages::STORAGE;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents,
                usage,
            })
        };
        let corners = storage("corners", bytemuck::cast_slice(&corners));
        let triangles = storage("triangles", bytemuck::cast_slice(&triangles));
        let views = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("views"),
            size: u64::from(batch) * 5 * size_of::<FaceView>() as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("item_buffer.wgsl"),
            source: wgpu::ShaderSource::Wgsl(ITEM_BUFFER_WGSL.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("item buffer"),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::TextureFormat::R32Uint.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let buffers = [&corners, &triangles, &views];
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("item buffer"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[0, 1, 2].map(|k: usize| wgpu::BindGroupEntry {
                binding: k as u32,
                resource: buffers[k].as_entire_binding(),
            }),
        });
        let texture = |label, layers, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d {
                    width: resolution,
                    height: 3 * resolution,
                    depth_or_array_layers: layers,
                },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            })
        };
        let readable = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let items = texture("items", batch, wgpu::TextureFormat::R32Uint, readable);
        let unread = wgpu::TextureUsages::empty();
        let depth = texture("depth", 1, wgpu::TextureFormat::Depth32Float, unread);
        let layer = |base_array_layer| {
            items.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let layers = (0..batch).map(layer).collect();
        ItemBuffer {
            pipeline,
            bindings,
            views,
            items,
            layers,
            depth: depth.create_view(&Default::default()),
            resolution,
        }
    }

    /// Records the drawing of the hemicubes that `views` (five each) look out from, with
    /// timestamps before the first (query 0) and after the last (query 1).
    pub fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        views: &[View],
        queries: Option<&wgpu::QuerySet>,
    ) {
        let faces: Vec<FaceView> = views.iter().map(|v| v.face).collect();
        gpu.queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&faces));
        let count = views.len() / 5;
        for (h, layer) in self.layers[..count].iter().enumerate() {
            let timestamp_writes = queries.map(|query_set| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: (h == 0).then_some(0),
                end_of_pass_write_index: (h + 1 == count).then_some(1),
            });
            // wgpu refuses a set of timestamps that writes none.
            let timestamp_writes = timestamp_writes.filter(|_| h == 0 || h + 1 == count);
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("item buffer"),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: layer,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &self.depth,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes,
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &self.bindings, &[]);
            let n = self.resolution;
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
