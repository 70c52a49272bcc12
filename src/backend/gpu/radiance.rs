//! The render pass of a gather: what a batch of places sees, and tiles of the lights apart.

use std::ops::Range;

use super::device::Gpu;
use super::layout::{RADIANCE_WGSL, RadianceTriangle, RadianceView, TILE};
use super::memory::Memory;
use super::render_targets::{DepthMode, RenderTargets};
use super::sources::SourceBuffers;
use super::split_float::SplitFloat;
use crate::error::Error;
use crate::gather::lights::Lights;
use crate::hemicube::Face;
use crate::scene::Scene;

/// Images of a batch of places, and what it takes to draw them: the hemicube, then tiles below it.
#[derive(Debug)]
pub struct Radiance {
    layout: wgpu::BindGroupLayout,
    /// The faces of hemicubes, the scene in a tile, a light alone in a tile.
    faces: wgpu::RenderPipeline,
    seen: wgpu::RenderPipeline,
    alone: wgpu::RenderPipeline,
    corners: wgpu::Buffer,
    triangles: wgpu::Buffer,
    views: wgpu::Buffer,
    pub layers: RenderTargets,
    /// Where each light's triangles are drawn once more.
    lights: Vec<Range<u32>>,
    resolution: u32,
}

/// One face of a hemicube or one tile, and the places in the drawing order that it can see.
#[derive(Debug)]
pub struct View {
    pub view: RadianceView,
    pub places: Vec<Range<u32>>,
}

/// Width and height in pixels of a place's image: the hemicube, and below it so many tiles, line
/// by line.
pub fn image_size(resolution: u32, slots: u32) -> [u32; 2] {
    let width = resolution.max(TILE);
    [width, 3 * resolution + slots.div_ceil(width / TILE) * TILE]
}

impl Radiance {
    /// For the triangles of `scene` in drawing order, in `local` coordinates and in units of `bright`
    /// W/m²; images of `batch` places with `slots` tiles each.
    pub fn new(
        memory: &Memory,
        scene: &Scene,
        lights: &Lights,
        (order, local, bright): (&[u32], &SplitFloat, f64),
        (resolution, slots, batch): (u32, u32, u32),
    ) -> Result<Radiance, Error> {
        let mut drawn = order.to_vec();
        let mut again = vec![];
        for light in &lights.lights {
            let start = drawn.len() as u32;
            drawn.extend(&light.triangles);
            again.push(start..drawn.len() as u32);
        }
        let corners = drawn.iter().flat_map(|&t| scene.corners(t as usize));
        let corners = local.corners(corners);
        let triangle = |&t: &u32| RadianceTriangle {
            exitance: (scene.material(t as usize).exitance / bright).as_vec3().to_array(),
            light: lights.of_triangle[t as usize],
            index: t,
            padding: [0; 3],
        };
        let triangles: Vec<RadianceTriangle> = drawn.iter().map(triangle).collect();
        let device = &memory.gpu.device;
        let bytes = u64::from(batch * (5 + slots)) * size_of::<RadianceView>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let views = memory.buffer("views", bytes, usage)?;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("radiance.wgsl"),
            source: wgpu::ShaderSource::Wgsl(RADIANCE_WGSL.into()),
        });
        let buffer = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Storage { read_only: true },
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let texture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: false },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let entry = |binding: u32| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: match binding {
                0..4 => wgpu::ShaderStages::VERTEX,
                _ => wgpu::ShaderStages::FRAGMENT,
            },
            ty: if binding == 5 { texture } else { buffer },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("radiance"),
            entries: &[0, 1, 2, 3, 4, 5].map(entry),
        });
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("radiance"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let format = wgpu::TextureFormat::Rgba32Float;
        let pipeline = |fragment, write_mask, shown| {
            let target = wgpu::ColorTargetState { format, blend: None, write_mask };
            RenderTargets::pipeline(&memory.gpu, &module, Some(&pipelines), fragment, target, shown)
        };
        Ok(Radiance {
            faces: pipeline("radiance", wgpu::ColorWrites::ALL, DepthMode::Nearest),
            seen: pipeline("sought", wgpu::ColorWrites::RED, DepthMode::Nearest),
            alone: pipeline("sought", wgpu::ColorWrites::ALPHA, DepthMode::AnyFront),
            layout,
            corners: memory.storage("corners", bytemuck::cast_slice(&corners))?,
            triangles: memory.storage("triangles", bytemuck::cast_slice(&triangles))?,
            views,
            layers: RenderTargets::new(memory, format, image_size(resolution, slots), batch)?,
            lights: again,
            resolution,
        })
    }

    /// What the pass reads when it draws `sources`.
    pub fn bindings(&self, gpu: &Gpu, sources: &SourceBuffers) -> wgpu::BindGroup {
        let SourceBuffers { lattices, nodes, elements } = sources;
        let resources = [
            self.corners.as_entire_binding(),
            self.triangles.as_entire_binding(),
            self.views.as_entire_binding(),
            lattices.as_entire_binding(),
            nodes.as_entire_binding(),
            wgpu::BindingResource::TextureView(elements),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("radiance"),
            layout: &self.layout,
            entries: &entries,
        })
    }

    /// Records the drawing of what `places` see, each with five faces and then its tiles, with
    /// timestamps before the first (query 0) and after the last (query 1).
    pub fn draw(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &wgpu::BindGroup,
        places: &[&[View]],
        queries: Option<&wgpu::QuerySet>,
    ) {
        let views: Vec<RadianceView> = places.iter().copied().flatten().map(|v| v.view).collect();
        gpu.queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&views));
        let (n, mut index) = (self.resolution, 0);
        for (h, views) in places.iter().enumerate() {
            let mut pass = self.layers.pass(encoder, h, places.len(), queries);
            pass.set_bind_group(0, bindings, &[]);
            for (k, View { view, places }) in views.iter().enumerate() {
                let draw = |pass: &mut wgpu::RenderPass, places: &Range<u32>| {
                    pass.draw(3 * places.start..3 * places.end, index..index + 1);
                };
                if k < 5 {
                    let lines = Face::rows(k, n);
                    let (y, height) = (lines.start as f32, lines.len() as f32);
                    pass.set_viewport(0.0, y, n as f32, height, 0.0, 1.0);
                    if k == 0 {
                        pass.set_pipeline(&self.faces);
                    }
                } else {
                    let (slot, columns) = (k as u32 - 5, n.max(TILE) / TILE);
                    let (x, y) = (slot % columns * TILE, 3 * n + slot / columns * TILE);
                    let size = TILE as f32;
                    pass.set_viewport(x as f32, y as f32, size, size, 0.0, 1.0);
                    pass.set_pipeline(&self.alone);
                    draw(&mut pass, &self.lights[view.light as usize]);
                    pass.set_pipeline(&self.seen);
                }
                places.iter().for_each(|run| draw(&mut pass, run));
                index += 1;
            }
        }
    }
}
