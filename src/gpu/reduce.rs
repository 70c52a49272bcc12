//! The compute pass: item buffers to dense rows in fixed point.

use super::cells::Cells;
use super::device::Gpu;
use super::item_buffer::ItemBuffer;
use super::layout::{REDUCE_WGSL, Reduction, STRIP, WORKGROUP};
use crate::error::Error;
use crate::hemicube;

/// The reduction of a batch of hemicubes.
#[derive(Debug)]
pub struct Reduce {
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
    /// The item buffers once more, as plain memory: reading them as a texture costs more than the
    /// copy does.
    items: wgpu::Buffer,
    /// Dense rows of the batch, `slots` words each.
    pub rows: wgpu::Buffer,
    resolution: u32,
}

impl Reduce {
    /// Bytes of one item buffer in memory.
    pub fn items_bytes(resolution: u32) -> u64 {
        u64::from(stride(resolution)) * u64::from(3 * resolution) * 4
    }

    /// For `batch` hemicubes of `resolution`, to rows of `slots` words.
    pub fn new(
        gpu: &Gpu,
        cells: &Cells,
        resolution: u32,
        slots: u32,
        batch: u32,
    ) -> Result<Self, Error> {
        let device = &gpu.device;
        let weights = hemicube::weights(resolution)?;
        let weights = gpu.storage("weights", bytemuck::cast_slice(&weights));
        let slot_of = gpu.storage("slots", bytemuck::cast_slice(&cells.slots));
        let stride = stride(resolution);
        let reduction = Reduction { resolution, slots, stride };
        let reduction = gpu.uniform("reduction", bytemuck::bytes_of(&reduction));
        let rows = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("rows"),
            size: u64::from(batch) * u64::from(slots) * 4,
            usage: wgpu::BufferUsages::STORAGE
                | wgpu::BufferUsages::COPY_SRC
                | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("reduce.wgsl"),
            source: wgpu::ShaderSource::Wgsl(REDUCE_WGSL.into()),
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("reduce"),
            layout: None,
            module: &module,
            entry_point: Some("reduce"),
            compilation_options: Default::default(),
            cache: None,
        });
        let items = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("items"),
            size: Reduce::items_bytes(resolution) * u64::from(batch),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let resources = [
            items.as_entire_binding(),
            weights.as_entire_binding(),
            rows.as_entire_binding(),
            reduction.as_entire_binding(),
            slot_of.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reduce"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Ok(Reduce { pipeline, bindings, items, rows, resolution })
    }

    /// Records the reduction of the first `count` hemicubes of `source`, with a timestamp after it
    /// (query 2).
    pub fn reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        source: &ItemBuffer,
        count: u32,
        queries: Option<&wgpu::QuerySet>,
    ) {
        let n = self.resolution;
        encoder.clear_buffer(&self.rows, 0, None);
        source.layers.copy(encoder, &self.items, stride(n) * 4, count);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reduce"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.dispatch_workgroups(n.div_ceil(WORKGROUP), (3 * n).div_ceil(STRIP), count);
    }
}

/// Words from one line of an item buffer in memory to the next: lines start at multiples of 256
/// bytes.
fn stride(resolution: u32) -> u32 {
    resolution.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}
