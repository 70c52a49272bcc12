//! The draw pass of a gather: what a batch of points sees, and tiles of the lights seen one by one.
//!
//! ```text
//! width = max(N, TILE)
//! ┌──────────────┐
//! │ hemicube     │ 3N lines, as the item buffer: radiosity in rgb, ±1/depth in alpha
//! ├────┬────┬────┤
//! │ 0  │ 1  │ …  │ tiles of TILE × TILE pixels, one a light: red where it is seen, alpha where it
//! └────┴────┴────┘ would be if nothing hid it; in that of the sun red where something hides it
//! ```
//!
//! A sky that is not uniform is drawn behind the hemicube, with an alpha of 0 as where nothing is.
//!
//! The twin on the CPU is `backend/cpu/radiance.rs`.

use std::ops::Range;

use super::layout::{RadianceTriangle, RadianceView, TILE};
use super::memory::Memory;
use super::pipeline::{self, DepthMode};
use super::render_targets::RenderTargets;
use super::shaders::RADIANCE_WGSL;
use super::sky::Sky;
use super::sources::SourceBuffers;
use super::split_float::SplitFloat;
use crate::error::Error;
use crate::gather::lights::{Lights, NO_LIGHT};
use crate::hemicube::Face;
use crate::scene::Scene;

/// Images of a batch of points, and what it takes to draw them: the hemicube, then tiles below it.
#[derive(Debug)]
pub struct Radiance {
    layout: wgpu::BindGroupLayout,
    /// The faces of hemicubes, the scene in the tile of a light, and the light alone in it.
    faces: wgpu::RenderPipeline,
    seen: wgpu::RenderPipeline,
    alone: wgpu::RenderPipeline,
    /// What hides the sun in its tile, if there is one.
    sun: Option<wgpu::RenderPipeline>,
    /// What lies behind the faces, if that differs by direction.
    sky: Option<Sky>,
    corners: wgpu::Buffer,
    triangles: wgpu::Buffer,
    views: wgpu::Buffer,
    pub targets: RenderTargets,
    /// Each light's triangles in [`DrawnScene::draws`], once more.
    lights: Vec<Range<u32>>,
    resolution: u32,
}

/// One face of a hemicube or one tile, and the runs of the drawing order that it can see.
#[derive(Debug)]
pub struct View {
    pub view: RadianceView,
    pub runs: Vec<Range<u32>>,
}

/// Size of the images of a batch of points.
#[derive(Clone, Copy, Debug)]
pub struct TargetSize {
    /// Pixels along an edge of the hemicube's top face, N.
    pub resolution: u32,
    /// Tiles of lights and of the sun below the hemicube.
    pub tiles: u32,
    /// Images.
    pub batch: u32,
}

impl TargetSize {
    /// Width and height of an image in pixels.
    pub fn pixels(&self) -> [u32; 2] {
        let width = self.resolution.max(TILE);
        [width, 3 * self.resolution + self.tiles.div_ceil(width / TILE) * TILE]
    }
}

/// A scene as it is drawn.
#[derive(Clone, Copy, Debug)]
pub struct DrawnScene<'a> {
    pub scene: &'a Scene,
    pub lights: &'a Lights,
    /// Triangle at each position of the drawing order.
    pub order: &'a [u32],
    pub coordinates: &'a SplitFloat,
    /// Unit of light on the device, W/m².
    pub radiance_unit: f64,
}

impl DrawnScene<'_> {
    /// Triangles in drawing order, then those of each light once more, and where the latter are.
    pub fn draws(&self) -> (Vec<u32>, Vec<Range<u32>>) {
        let mut drawn = self.order.to_vec();
        let mut of_lights = vec![];
        for light in &self.lights.lights {
            let start = drawn.len() as u32;
            drawn.extend(&light.triangles);
            of_lights.push(start..drawn.len() as u32);
        }
        (drawn, of_lights)
    }

    /// Triangle `t` as the shader reads it.
    pub fn triangle(&self, t: u32) -> RadianceTriangle {
        let exitance = self.scene.exitance(t as usize) / self.radiance_unit;
        RadianceTriangle {
            exitance: exitance.as_vec3().to_array(),
            light: self.lights.of_triangle[t as usize],
            index: t,
            padding: [0; 3],
        }
    }
}

impl Radiance {
    /// For images of `size`.
    pub fn new(memory: &Memory, drawn: DrawnScene, size: TargetSize) -> Result<Radiance, Error> {
        let (draws, lights) = drawn.draws();
        let corners = drawn.coordinates.corners(drawn.scene, &draws);
        let triangles: Vec<_> = draws.iter().map(|&t| drawn.triangle(t)).collect();
        let device = &memory.device;
        let views = u64::from(size.batch * (5 + size.tiles)) * size_of::<RadianceView>() as u64;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let views = memory.buffer("views", views, usage)?;
        let module = pipeline::shader(device, "radiance.wgsl", RADIANCE_WGSL);
        let layout = bind_group_layout(device);
        let pipelines = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("radiance"),
            bind_group_layouts: &[Some(&layout)],
            ..Default::default()
        });
        let format = wgpu::TextureFormat::Rgba32Float;
        let pipeline = |fragment, write_mask, depth_mode| {
            let target = wgpu::ColorTargetState { format, blend: None, write_mask };
            let layout = Some(&pipelines);
            pipeline::Draw { module: &module, layout, fragment, target, depth_mode }.create(device)
        };
        let unit = drawn.radiance_unit;
        let sky = drawn.scene.sky();
        let sun = |_| pipeline("sun_hidden", wgpu::ColorWrites::RED, DepthMode::Nearest);
        Ok(Radiance {
            sun: sky.sun().map(sun),
            sky: sky.map().map(|map| Sky::new(memory, map, &views, format, unit)).transpose()?,
            faces: pipeline("radiance", wgpu::ColorWrites::ALL, DepthMode::Nearest),
            seen: pipeline("light_visibility", wgpu::ColorWrites::RED, DepthMode::Nearest),
            alone: pipeline("light_visibility", wgpu::ColorWrites::ALPHA, DepthMode::AnyFront),
            layout,
            corners: memory.storage("corners", bytemuck::cast_slice(&corners))?,
            triangles: memory.storage("triangles", bytemuck::cast_slice(&triangles))?,
            views,
            targets: RenderTargets::new(memory, format, size.pixels(), size.batch)?,
            lights,
            resolution: size.resolution,
        })
    }

    /// What the pass reads when it draws `sources`.
    pub fn bindings(&self, device: &wgpu::Device, sources: &SourceBuffers) -> wgpu::BindGroup {
        let SourceBuffers { lattices, nodes, elements } = sources;
        let resources = [
            self.corners.as_entire_binding(),
            self.triangles.as_entire_binding(),
            self.views.as_entire_binding(),
            lattices.as_entire_binding(),
            nodes.as_entire_binding(),
            wgpu::BindingResource::TextureView(elements),
        ];
        pipeline::bind_group(device, "radiance", &self.layout, 0, &resources)
    }

    /// Records the drawing of what the points see, each with five faces and then its tiles, with
    /// timestamps before the first (query 0) and after the last (query 1).
    pub fn draw(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        bindings: &wgpu::BindGroup,
        points: &[&[View]],
        queries: Option<&wgpu::QuerySet>,
    ) {
        let views: Vec<RadianceView> = points.iter().copied().flatten().map(|v| v.view).collect();
        queue.write_buffer(&self.views, 0, bytemuck::cast_slice(&views));
        let mut index = 0;
        for (layer, views) in points.iter().enumerate() {
            let mut pass = self.targets.pass(encoder, layer, points.len(), queries);
            pass.set_bind_group(0, bindings, &[]);
            let (faces, tiles) = views.split_at(5);
            for (face, view) in faces.iter().enumerate() {
                self.draw_face(&mut pass, face, view, index + face as u32);
            }
            if let Some(sky) = &self.sky {
                sky.begin(&mut pass);
                for face in 0..5 {
                    self.set_viewport(&mut pass, face);
                    Sky::draw(&mut pass, index + face as u32);
                }
                pass.set_bind_group(0, bindings, &[]);
            }
            for (tile, view) in (0..).zip(tiles) {
                self.draw_tile(&mut pass, tile, view, index + 5 + tile);
            }
            index += views.len() as u32;
        }
    }

    fn set_viewport(&self, pass: &mut wgpu::RenderPass, face: usize) {
        let lines = Face::rows(face, self.resolution);
        let (y, height) = (lines.start as f32, lines.len() as f32);
        pass.set_viewport(0.0, y, self.resolution as f32, height, 0.0, 1.0);
    }

    fn draw_face(&self, pass: &mut wgpu::RenderPass, face: usize, view: &View, index: u32) {
        self.set_viewport(pass, face);
        if face == 0 {
            pass.set_pipeline(&self.faces);
        }
        draw_runs(pass, &view.runs, index);
    }

    fn draw_tile(&self, pass: &mut wgpu::RenderPass, tile: u32, view: &View, index: u32) {
        let [x, y] = tile_corner(self.resolution, tile);
        let size = TILE as f32;
        pass.set_viewport(x as f32, y as f32, size, size, 0.0, 1.0);
        if let (NO_LIGHT, Some(sun)) = (view.view.light, &self.sun) {
            pass.set_pipeline(sun);
        } else {
            pass.set_pipeline(&self.alone);
            draw_runs(pass, &self.lights[view.view.light as usize..][..1], index);
            pass.set_pipeline(&self.seen);
        }
        draw_runs(pass, &view.runs, index);
    }
}

/// Left and top of a tile in the image of a point, pixels.
pub fn tile_corner(resolution: u32, tile: u32) -> [u32; 2] {
    let columns = resolution.max(TILE) / TILE;
    [tile % columns * TILE, 3 * resolution + tile / columns * TILE]
}

fn draw_runs(pass: &mut wgpu::RenderPass, runs: &[Range<u32>], index: u32) {
    for run in runs {
        pass.draw(3 * run.start..3 * run.end, index..index + 1);
    }
}

/// One layout for three pipelines that do not all read all of it.
fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
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
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("radiance"),
        entries: &[0, 1, 2, 3, 4, 5].map(entry),
    })
}
