//! Dense rows, compacted to entries on the device and read back as such.
//!
//! ```text
//! counts, dense: row × slot ─► compact_rows ─► entries, row by row ─► staging ─► read
//!        ▲       zeros             │
//!        └─────────────────────────┘
//! ```
//!
//! A row over a mesh of 100 000 elements takes 400 kB, its entries some 10 kB: the bus to the
//! device limits the rate of rows that are read back dense.

use super::device::Gpu;
use super::layout::{ROW_ENTRIES_HEADER_BYTES, RowEntry, RowSettings};
use super::memory::Memory;
use super::pipeline::bind_group;
use crate::error::Error;

/// Buffers for the entries of a batch of rows.
#[derive(Debug)]
pub struct CompactedRows {
    /// [`RowSettings`], also for the passes that count.
    pub settings: wgpu::Buffer,
    /// Capacity in entries.
    pub entries: u32,
    pub(super) found: wgpu::Buffer,
    staging: wgpu::Buffer,
    /// Number of entries of a batch to be copied before their actual number is known.
    expected: u64,
}

/// Bytes of the entries of a batch; larger ones are split into two batches.
const ENTRY_BYTES: u64 = 32 << 20;

/// Expected number of entries of the first batch: 2 MiB of them.
const FIRST_ENTRIES: u64 = 65_536;

impl CompactedRows {
    /// Buffers for batches of up to `rows` rows, of up to `row_entries` entries each; for at least
    /// one row.
    pub fn new(memory: &Memory, rows: u32, row_entries: u32) -> Result<CompactedRows, Error> {
        use wgpu::BufferUsages as Usage;
        let of_row = u64::from(row_entries);
        let most = (ENTRY_BYTES / size_of::<RowEntry>() as u64).max(of_row);
        let entries = most.min(u64::from(rows) * of_row);
        let storage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        Ok(CompactedRows {
            settings: memory.uniform("settings", &[0; size_of::<RowSettings>()])?,
            entries: entries as u32,
            found: memory.buffer("entries", bytes(entries), storage)?,
            staging: memory.buffer("staging", bytes(entries), Usage::MAP_READ | Usage::COPY_DST)?,
            expected: FIRST_ENTRIES,
        })
    }

    /// Records the compaction of the first `rows` rows in `counts`, which are reset to 0. Each has
    /// `settings.slots` words, or four times that `through_panes`.
    pub fn compact(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        counts: &wgpu::Buffer,
        rows: u32,
        through_panes: bool,
    ) {
        let pipelines = gpu.row_pipelines();
        let pipeline = match through_panes {
            true => &pipelines.compact_rows_through_panes,
            false => &pipelines.compact_rows,
        };
        let bindings = [
            (1, counts.as_entire_binding()),
            (3, self.settings.as_entire_binding()),
            (4, self.found.as_entire_binding()),
        ];
        let layout = pipeline.get_bind_group_layout(1);
        let bindings = bind_group(&gpu.device, "compact rows", &layout, &bindings);
        encoder.clear_buffer(&self.found, 0, Some(ROW_ENTRIES_HEADER_BYTES));
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &bindings, &[]);
        pass.dispatch_workgroups(rows, 1, 1);
    }

    /// Submits `encoder`, and returns the result of `read` for all entries, at most `many`: row by
    /// row in any order, slots ascending. `None` if they exceed the capacity in `settings`.
    pub fn finish<T>(
        &mut self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        settings: RowSettings,
        many: u64,
        read: impl Fn(&[RowEntry]) -> T,
    ) -> Result<Option<T>, Error> {
        let Self { found, staging, .. } = self;
        // The number of the previous batch plus a margin; if that is too few, the rest is copied
        // afterwards.
        let guess = self.expected.min(many).min(settings.entries.into()).max(1);
        gpu.queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&settings));
        encoder.copy_buffer_to_buffer(found, 0, staging, 0, bytes(guess));
        let submission = gpu.queue.submit([encoder.finish()]);
        let read_up_to = |submission, copied: u64| {
            let entries = gpu.read_mapped(staging.slice(..bytes(copied)), submission, |bytes| {
                let count = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
                let list: &[RowEntry] =
                    bytemuck::cast_slice(&bytes[ROW_ENTRIES_HEADER_BYTES as usize..]);
                (u64::from(count), list.get(..count as usize).map(&read))
            });
            staging.unmap();
            entries
        };
        let (count, entries) = read_up_to(submission, guess)?;
        if count > settings.entries.into() {
            return Ok(None);
        }
        self.expected = count + count / 4;
        if entries.is_some() {
            return Ok(entries);
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(found, 0, staging, 0, bytes(count));
        let submission = gpu.queue.submit([encoder.finish()]);
        Ok(read_up_to(submission, count)?.1)
    }
}

/// The entries of each of `rows` rows, or a description of an error in them.
pub fn by_row(entries: &[RowEntry], rows: usize) -> Result<Vec<&[RowEntry]>, String> {
    let mut of_rows = vec![&entries[..0]; rows];
    for row in entries.chunk_by(|a, b| a.patch_ == b.patch_) {
        let number = row[0].patch_ as usize;
        *of_rows.get_mut(number).ok_or_else(|| format!("row {number} of {rows}"))? = row;
    }
    Ok(of_rows)
}

/// Bytes of this number of entries with their header.
fn bytes(entries: u64) -> u64 {
    ROW_ENTRIES_HEADER_BYTES + entries * size_of::<RowEntry>() as u64
}
