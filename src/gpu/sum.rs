//! The compute pass of a gather: images of places to what they receive.

use super::device::Gpu;
use super::layers::Layers;
use super::layout::{GATHER_WGSL, Summation, Sums, Tile};
use super::radiance::image_size;
use crate::error::Error;
use crate::hemicube::{self, Face};

/// The summation over a batch of places.
#[derive(Debug)]
pub struct Sum {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    /// The images once more, as plain memory: reading them as a texture costs more than the copy.
    pixels: wgpu::Buffer,
    tiles: wgpu::Buffer,
    /// What each place receives, a [`Sums`] each.
    pub sums: wgpu::Buffer,
    stride: u32,
}

/// Bytes of a pixel.
const PIXEL: u32 = 16;

impl Sum {
    /// Bytes of a place's image in memory.
    pub fn image_bytes(resolution: u32, slots: u32) -> u64 {
        u64::from(stride(resolution)) * u64::from(image_size(resolution, slots)[1] * PIXEL)
    }

    /// For images of `resolution` with `slots` tiles, `batch` at a time.
    pub fn new(gpu: &Gpu, resolution: u32, slots: u32, batch: u32) -> Result<Sum, Error> {
        let device = &gpu.device;
        let buffer = |label, size, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | usage,
                mapped_at_creation: false,
            })
        };
        let batch = u64::from(batch);
        let image = Sum::image_bytes(resolution, slots);
        let pixels = buffer("pixels", batch * image, wgpu::BufferUsages::COPY_DST);
        let tile_bytes = u64::from(slots.max(1)) * size_of::<Tile>() as u64;
        let tiles = buffer("tiles", batch * tile_bytes, wgpu::BufferUsages::COPY_DST);
        let sum_bytes = batch * size_of::<Sums>() as u64;
        let sums = buffer("sums", sum_bytes, wgpu::BufferUsages::COPY_SRC);
        let weights = gpu.storage("weights", bytemuck::cast_slice(&weights(resolution)?));
        let (stride, lines) = (stride(resolution), image_size(resolution, slots)[1]);
        let summation = Summation { resolution, stride, lines, slots };
        let summation = gpu.uniform("summation", bytemuck::bytes_of(&summation));
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("gather.wgsl"),
            source: wgpu::ShaderSource::Wgsl(GATHER_WGSL.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("gather"),
            layout: None,
            module: &module,
            entry_point: Some("gather"),
            compilation_options: Default::default(),
            cache: None,
        });
        let buffers = [&pixels, &weights, &tiles, &sums, &summation];
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gather"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[0, 1, 2, 3, 4].map(|k: usize| wgpu::BindGroupEntry {
                binding: k as u32,
                resource: buffers[k].as_entire_binding(),
            }),
        });
        Ok(Sum { pipeline, bindings, pixels, tiles, sums, stride })
    }

    /// Records the summation over the first `count` layers, with a timestamp after it (query 2).
    pub fn sum(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        (layers, count): (&Layers, u32),
        tiles: &[Tile],
        queries: Option<&wgpu::QuerySet>,
    ) {
        gpu.queue.write_buffer(&self.tiles, 0, bytemuck::cast_slice(tiles));
        layers.copy(encoder, &self.pixels, self.stride * PIXEL, count);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("gather"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(count, 1, 1);
    }
}

/// Pixels from one line of an image in memory to the next: lines start at multiples of 256 bytes.
fn stride(resolution: u32) -> u32 {
    image_size(resolution, 0)[0].next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / PIXEL)
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
