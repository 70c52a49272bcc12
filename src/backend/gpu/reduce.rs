//! The compute pass: item buffers to dense rows in fixed point.

use super::item_table::ItemTable;
use super::layout::{REDUCE_WGSL, Reduction, STRIP, WORKGROUP};
use super::memory::Memory;
use super::resolution::Resolution;
use crate::error::Error;
use crate::hemicube;

/// The reduction of a batch of hemicubes, whatever their resolution.
#[derive(Debug)]
pub struct Reduce {
    pipeline: wgpu::ComputePipeline,
    /// The row slot of each item.
    slot_of: wgpu::Buffer,
    /// The item buffers once more, as plain memory: reading them as a texture costs more than the
    /// copy does.
    items: wgpu::Buffer,
    /// Dense rows of the batch, `slots` words each.
    pub rows: wgpu::Buffer,
    slots: u32,
}

impl Reduce {
    /// Bytes of one item buffer in memory.
    pub fn items_bytes(resolution: u32) -> u64 {
        u64::from(stride(resolution)) * u64::from(3 * resolution) * 4
    }

    /// For `batch` hemicubes of at most `resolution`, to rows of `slots` words.
    pub fn new(
        memory: &Memory,
        cells: &ItemTable,
        resolution: u32,
        slots: u32,
        batch: u32,
    ) -> Result<Self, Error> {
        let device = &memory.gpu.device;
        let slot_of = memory.storage("slots", bytemuck::cast_slice(&cells.slots))?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let row_bytes = u64::from(batch) * u64::from(slots) * 4;
        let rows = memory.buffer("rows", row_bytes, usage | wgpu::BufferUsages::COPY_SRC)?;
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
        let item_bytes = Reduce::items_bytes(resolution) * u64::from(batch);
        let items = memory.buffer("items", item_bytes, usage)?;
        Ok(Reduce { pipeline, slot_of, items, rows, slots })
    }

    /// What the pass reads and writes for hemicubes of `resolution`, at most the one that this was
    /// made for.
    pub fn bindings(&self, memory: &Memory, resolution: u32) -> Result<wgpu::BindGroup, Error> {
        let weights = hemicube::weights(resolution)?;
        let weights = memory.storage("weights", bytemuck::cast_slice(&weights))?;
        let reduction = Reduction { resolution, slots: self.slots, stride: stride(resolution) };
        let reduction = memory.uniform("reduction", bytemuck::bytes_of(&reduction))?;
        let resources = [
            self.items.as_entire_binding(),
            weights.as_entire_binding(),
            self.rows.as_entire_binding(),
            reduction.as_entire_binding(),
            self.slot_of.as_entire_binding(),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        Ok(memory.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("reduce"),
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &entries,
        }))
    }

    /// Records the reduction of the first `count` hemicubes on the layers of `at`, with a timestamp
    /// after it (query 2).
    pub fn reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        at: &Resolution,
        count: u32,
        queries: Option<&wgpu::QuerySet>,
    ) {
        let n = at.pixels;
        encoder.clear_buffer(&self.rows, 0, None);
        at.layers.copy(encoder, &self.items, stride(n) * 4, count);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reduce"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &at.bindings, &[]);
        pass.dispatch_workgroups(n.div_ceil(WORKGROUP), (3 * n).div_ceil(STRIP), count);
    }
}

/// Words from one line of an item buffer in memory to the next: lines start at multiples of 256
/// bytes.
fn stride(resolution: u32) -> u32 {
    resolution.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}
