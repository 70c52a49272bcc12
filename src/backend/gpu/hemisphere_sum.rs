//! The compute pass of a gather: images of points to what they receive.
//!
//! ```text
//! image of a point ─► add_columns ─► columns: LANES partial sums of each of 24 numbers
//!                     64 threads        │
//!                                       ▼
//!                                    add_up ─► Sums: radiosity rgb, open, back, nearness,
//!                                    24 threads      and of each light [seen, alone]
//! ```
//!
//! Every sum is in a fixed order. The twin on the CPU is `backend/cpu/hemisphere_sum.rs`.

use super::layout::{LANES, Summation, Sums, Tile};
use super::memory::Memory;
use super::pipeline;
use super::radiance::TargetSize;
use super::render_targets::RenderTargets;
use super::shaders::HEMISPHERE_SUM_WGSL;
use crate::error::Error;
use crate::hemicube::{self, Face};

/// The summation over a batch of points.
#[derive(Debug)]
pub struct HemisphereSum {
    add_columns: Step,
    add_up: Step,
    tiles: wgpu::Buffer,
    /// Partial sums of each point: for every number of [`Sums`], one a lane.
    #[cfg(test)]
    pub columns: wgpu::Buffer,
    /// What each point receives, a [`Sums`] each.
    pub sums: wgpu::Buffer,
}

/// A compute pipeline and what it reads and writes.
#[derive(Debug)]
struct Step {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
}

impl HemisphereSum {
    /// Over the images on `targets`, which have `size`.
    pub fn new(
        memory: &Memory,
        targets: &RenderTargets,
        size: TargetSize,
    ) -> Result<HemisphereSum, Error> {
        let TargetSize { resolution, tiles, batch } = size;
        let buffer =
            |label, size, usage| memory.buffer(label, size, wgpu::BufferUsages::STORAGE | usage);
        let batch = u64::from(batch);
        let tile_bytes = u64::from(tiles.max(1)) * size_of::<Tile>() as u64;
        let tile_buffer = buffer("tiles", batch * tile_bytes, wgpu::BufferUsages::COPY_DST)?;
        let sum_bytes = batch * size_of::<Sums>() as u64;
        let sums = buffer("sums", sum_bytes, wgpu::BufferUsages::COPY_SRC)?;
        let column_bytes = sum_bytes * u64::from(LANES);
        let columns = buffer("columns", column_bytes, wgpu::BufferUsages::COPY_SRC)?;
        let weights = memory.storage("weights", bytemuck::cast_slice(&weights(resolution)?))?;
        let summation = Summation { resolution, tiles };
        let summation = memory.uniform("summation", bytemuck::bytes_of(&summation))?;
        let pixels = targets.texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2Array),
            ..Default::default()
        });
        let device = &memory.device;
        let module = pipeline::shader(device, "hemisphere_sum.wgsl", HEMISPHERE_SUM_WGSL);
        let step = |entry_point: &str, resources: &[wgpu::BindingResource], first: u32| {
            let pipeline = pipeline::compute(device, &module, entry_point);
            let layout = pipeline.get_bind_group_layout(0);
            let bindings = pipeline::bind_group(device, entry_point, &layout, first, resources);
            Step { pipeline, bindings }
        };
        let columns_in = [
            wgpu::BindingResource::TextureView(&pixels),
            weights.as_entire_binding(),
            tile_buffer.as_entire_binding(),
            columns.as_entire_binding(),
            summation.as_entire_binding(),
        ];
        let sums_in = [columns.as_entire_binding(), sums.as_entire_binding()];
        let add_columns = step("add_columns", &columns_in, 0);
        let add_up = step("add_up", &sums_in, 5);
        Ok(HemisphereSum {
            add_columns,
            add_up,
            tiles: tile_buffer,
            #[cfg(test)]
            columns,
            sums,
        })
    }

    /// Records the summation over the first `count` layers, whose tiles are `tiles`, with a
    /// timestamp after it (query 2).
    pub fn sum(
        &self,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        count: u32,
        tiles: &[Tile],
        queries: Option<&wgpu::QuerySet>,
    ) {
        queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(tiles));
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("hemisphere sum"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        for step in [&self.add_columns, &self.add_up] {
            pass.set_pipeline(&step.pipeline);
            pass.set_bind_group(0, &step.bindings, &[]);
            pass.dispatch_workgroups(count, 1, 1);
        }
    }
}

/// Per pixel of a hemicube, its exact form factor, and that times the ratio of distance along the
/// face's axis to distance, which turns a mean over depths into one over distances.
pub fn weights(n: u32) -> Result<Vec<[f32; 2]>, Error> {
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
