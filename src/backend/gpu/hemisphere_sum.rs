//! The compute pass of a gather: images of places to what they receive.

use super::device::Gpu;
use super::layout::{HEMISPHERE_SUM_WGSL, LANES, Summation, Sums, Tile};
use super::memory::Memory;
use super::render_targets::RenderTargets;
use crate::error::Error;
use crate::hemicube::{self, Face};

/// The summation over a batch of places.
#[derive(Debug)]
pub struct HemisphereSum {
    /// Two steps: columns, and their sums.
    steps: [(wgpu::ComputePipeline, wgpu::BindGroup); 2],
    tiles: wgpu::Buffer,
    /// What each place receives, a [`Sums`] each.
    pub sums: wgpu::Buffer,
}

impl HemisphereSum {
    /// Over the images of `resolution` with `slots` tiles on `layers`.
    pub fn new(
        memory: &Memory,
        layers: &RenderTargets,
        resolution: u32,
        slots: u32,
    ) -> Result<HemisphereSum, Error> {
        let device = &memory.gpu.device;
        let buffer =
            |label, size, usage| memory.buffer(label, size, wgpu::BufferUsages::STORAGE | usage);
        let batch = u64::from(layers.texture.depth_or_array_layers());
        let tile_bytes = u64::from(slots.max(1)) * size_of::<Tile>() as u64;
        let tiles = buffer("tiles", batch * tile_bytes, wgpu::BufferUsages::COPY_DST)?;
        let sum_bytes = batch * size_of::<Sums>() as u64;
        let sums = buffer("sums", sum_bytes, wgpu::BufferUsages::COPY_SRC)?;
        let unread = wgpu::BufferUsages::empty();
        let columns = buffer("columns", sum_bytes * u64::from(LANES), unread)?;
        let weights = memory.storage("weights", bytemuck::cast_slice(&weights(resolution)?))?;
        let summation = Summation { resolution, slots };
        let summation = memory.uniform("summation", bytemuck::bytes_of(&summation))?;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("gather.wgsl"),
            source: wgpu::ShaderSource::Wgsl(HEMISPHERE_SUM_WGSL.into()),
        });
        let step = |entry_point: &str, resources: &[wgpu::BindingResource], first: u32| {
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(entry_point),
                layout: None,
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            });
            let entries: Vec<_> = (first..)
                .zip(resources.iter().cloned())
                .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
                .collect();
            let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(entry_point),
                layout: &pipeline.get_bind_group_layout(0),
                entries: &entries,
            });
            (pipeline, bindings)
        };
        let pixels = layers.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let add_columns = [
            wgpu::BindingResource::TextureView(&pixels),
            weights.as_entire_binding(),
            tiles.as_entire_binding(),
            columns.as_entire_binding(),
            summation.as_entire_binding(),
        ];
        let add_up = [columns.as_entire_binding(), sums.as_entire_binding()];
        let steps = [step("add_columns", &add_columns, 0), step("add_up", &add_up, 5)];
        Ok(HemisphereSum { steps, tiles, sums })
    }

    /// Records the summation over the first `count` layers, whose tiles are `tiles`, with a
    /// timestamp after it (query 2).
    pub fn sum(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        count: u32,
        tiles: &[Tile],
        queries: Option<&wgpu::QuerySet>,
    ) {
        gpu.queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(tiles));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("gather"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        for (pipeline, bindings) in &self.steps {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bindings, &[]);
            pass.dispatch_workgroups(count, 1, 1);
        }
    }
}

/// Per pixel of a hemicube, its exact form factor, and that times the ratio of distance along the
/// face's axis to distance, which turns a mean over depths into one over distances.
fn weights(n: u32) -> Result<Vec<[f32; 2]>, Error> {
    let factors = hemicube::delta_form_factors(n)?;
    let step = 2.0 / f64::from(n);
    let middle = |k: u32| (f64::from(k) + 0.5) * step - 1.0;
    let faces = (0..5).flat_map(|face| {
        let lines = Face::rows(face, n);
        (0..lines.len() as u32).flat_map(move |y| (0..n).map(move |x| (middle(x), middle(y))))
    });
    let axial = faces.map(|(x, y)| 1.0 / (1.0 + x * x + y * y).sqrt());
    Ok(factors.iter().zip(axial).map(|(f, a)| [*f as f32, (f * a) as f32]).collect())
}
