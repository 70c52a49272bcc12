//! The compute pass of rows: item buffers to dense rows in fixed point.
//!
//! ```text
//! layers of R32Uint ──copy──► items (lines padded to `stride` words)
//! items, weights, slot of each item ──► reduce ──► rows: slots words per hemicube
//!                                                        [open, back, element 0, element 1, …]
//! ```
//!
//! A thread adds up a strip of [`STRIP`] pixels of one column; the sums are added by integer
//! atomics, so that their order does not matter. The twin on the CPU is `backend/cpu/reduce.rs`.

use super::layout::{LANES, Reduction, STRIP};
use super::memory::Memory;
use super::pipeline;
use super::render_targets::RenderTargets;
use crate::error::Error;
use crate::hemicube;

/// The reduction of a batch of hemicubes, at any resolution.
#[derive(Debug)]
pub struct Reduce {
    pipeline: wgpu::ComputePipeline,
    /// The row slot of each item.
    slot_of_item: wgpu::Buffer,
    /// Copies of the item buffers in a plain buffer: reading them as a texture costs more than the
    /// copy.
    items: wgpu::Buffer,
    /// Dense rows of the batch, `slots` words each.
    pub rows: wgpu::Buffer,
    slots: u32,
}

/// Dimensions of a batch of hemicubes.
#[derive(Clone, Copy, Debug)]
pub struct BatchSize {
    /// Maximum number of pixels along an edge of the top face.
    pub resolution: u32,
    /// Words of a row: open, backs, then one per element.
    pub slots: u32,
    /// Maximum number of hemicubes.
    pub hemicubes: u32,
}

impl Reduce {
    /// Bytes of one item buffer in memory.
    pub fn items_bytes(resolution: u32) -> u64 {
        u64::from(stride(resolution)) * u64::from(3 * resolution) * 4
    }

    /// For item buffers whose item k counts for slot `slot_of_item[k]` of the row.
    pub fn new(memory: &Memory, slot_of_item: &[u32], size: BatchSize) -> Result<Self, Error> {
        let BatchSize { resolution, slots, hemicubes } = size;
        let slot_of_item = memory.storage("slots", bytemuck::cast_slice(slot_of_item))?;
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        let row_bytes = u64::from(hemicubes) * u64::from(slots) * 4;
        // Zero initially and after each batch.
        let rows = memory.buffer("rows", row_bytes, usage | wgpu::BufferUsages::COPY_SRC)?;
        let pipeline = pipeline::compute(&memory.device, "reduce.wgsl", "reduce");
        let item_bytes = Reduce::items_bytes(resolution) * u64::from(hemicubes);
        let items = memory.buffer("items", item_bytes, usage)?;
        Ok(Reduce { pipeline, slot_of_item, items, rows, slots })
    }

    /// Bindings of the pass for hemicubes of `resolution`, at most the one that this was made for.
    pub fn bindings(&self, memory: &Memory, resolution: u32) -> Result<wgpu::BindGroup, Error> {
        let weights = hemicube::weights(resolution)?;
        let weights = memory.storage("weights", bytemuck::cast_slice(&weights))?;
        let reduction = Reduction { resolution, slots: self.slots, stride: stride(resolution) };
        let reduction = memory.uniform("reduction", bytemuck::bytes_of(&reduction))?;
        let buffers = [&self.items, &weights, &self.rows, &reduction, &self.slot_of_item];
        let resources: Vec<_> =
            (0..).zip(buffers).map(|(k, buffer)| (k, buffer.as_entire_binding())).collect();
        let layout = self.pipeline.get_bind_group_layout(0);
        Ok(pipeline::bind_group(&memory.device, "reduce", &layout, &resources))
    }

    /// Records the reduction of the first `count` hemicubes on `targets`, with the bindings for
    /// their resolution and a timestamp after it (query 2). Rows must be 0 before.
    pub fn reduce(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        targets: &RenderTargets,
        bindings: &wgpu::BindGroup,
        count: u32,
        queries: Option<&wgpu::QuerySet>,
    ) {
        let pixels = targets.texture.width();
        targets.copy(encoder, &self.items, stride(pixels) * 4, count);
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("reduce"),
            timestamp_writes: queries.map(|query_set| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: None,
                end_of_pass_write_index: Some(2),
            }),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, bindings, &[]);
        pass.dispatch_workgroups(pixels.div_ceil(LANES), (3 * pixels).div_ceil(STRIP), count);
    }
}

/// Words per line of an item buffer in memory, a multiple of 256 bytes.
pub fn stride(resolution: u32) -> u32 {
    resolution.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT / 4)
}
