//! The draw pass of a sky that is not the same in all directions, behind all that is drawn.
//!
//! The twin on the CPU is `backend/cpu/sky.rs`.

use std::f64::consts::PI;

use glam::DVec3;

use super::layout::SkyAxes;
use super::memory::Memory;
use super::pipeline::{self, DepthMode};
use super::shaders::SKY_WGSL;
use crate::error::Error;
use crate::scene::SkyMap;

/// What draws a sky behind the faces of a gather.
#[derive(Debug)]
pub struct Sky {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
}

impl Sky {
    /// Behind faces of `views` on targets of `format`, with light in units of `radiance_unit` W/m².
    pub fn new(
        memory: &Memory,
        map: &SkyMap,
        views: &wgpu::Buffer,
        format: wgpu::TextureFormat,
        radiance_unit: f64,
    ) -> Result<Sky, Error> {
        let (texels, side) = (texels(map, radiance_unit), map.side() as u32);
        let pieces = memory.texels("sky", &texels, [side, 2 * side])?;
        let axes = memory.uniform("sky axes", bytemuck::bytes_of(&axes(map)))?;
        let device = &memory.device;
        let module = pipeline::shader(device, "sky.wgsl", SKY_WGSL);
        let target =
            wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL };
        let layout = bind_group_layout(device);
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("sky"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let draw = pipeline::Draw {
            module: &module,
            layout: Some(&pipelines),
            fragment: "sky",
            target,
            depth_mode: DepthMode::Behind,
        };
        let resources = [
            views.as_entire_binding(),
            axes.as_entire_binding(),
            wgpu::BindingResource::TextureView(&pieces),
        ];
        let bindings = pipeline::bind_group(device, "sky", &layout, 0, &resources);
        Ok(Sky { pipeline: draw.create(device), bindings })
    }

    /// Sets the pass up to draw skies with [`Sky::draw`].
    pub fn begin(&self, pass: &mut wgpu::RenderPass) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
    }

    /// Draws behind the face of view `index`, over the pass's viewport.
    pub fn draw(pass: &mut wgpu::RenderPass, index: u32) {
        pass.draw(0..3, index..index + 1);
    }
}

/// The axes of a map, in those of the scene.
pub fn axes(map: &SkyMap) -> SkyAxes {
    let back = map.turn().inverse();
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (back * axis).as_vec3().to_array());
    SkyAxes { x, side: map.side() as u32, y, padding: 0, z, padding_2: 0 }
}

/// Radiosity of the pieces of a map in units of `radiance_unit`, line by line.
pub fn texels(map: &SkyMap, radiance_unit: f64) -> Vec<[f32; 4]> {
    let texel = |piece: &[f32; 3]| {
        let [r, g, b] = piece.map(|l| (f64::from(l) * PI / radiance_unit) as f32);
        [r, g, b, 0.0]
    };
    map.pieces().iter().map(texel).collect()
}

fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let buffer =
        |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: false },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let entry = |binding, visibility, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility,
        ty,
        count: None,
    };
    let (vertex, fragment) = (wgpu::ShaderStages::VERTEX, wgpu::ShaderStages::FRAGMENT);
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("sky"),
        entries: &[
            entry(0, vertex, buffer(wgpu::BufferBindingType::Storage { read_only: true })),
            entry(1, vertex | fragment, buffer(wgpu::BufferBindingType::Uniform)),
            entry(2, fragment, texture),
        ],
    })
}
