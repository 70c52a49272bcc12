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
use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;

/// Buffers for the entries of a batch of rows.
#[derive(Debug)]
pub struct CompactedRows {
    /// [`RowSettings`], also for the passes that count.
    pub settings: wgpu::Buffer,
    /// Capacity in entries.
    pub entries: u32,
    pub(super) list: wgpu::Buffer,
    staging: wgpu::Buffer,
    /// Entries of the next batch that are copied to `staging` in the submission that makes them.
    expected: u64,
}

/// A batch of rows that the device makes.
#[derive(Debug)]
pub struct SubmittedRows {
    pub submission: wgpu::SubmissionIndex,
    /// Entries that it copies to `staging`.
    copied: u64,
    /// Entries that it has room for.
    room: u64,
}

impl CompactedRows {
    /// Maximum number of rows of a batch. They share the millisecond that a submission and its
    /// readback take on hardware; and a hemicube takes a layer of a texture, of which every WebGPU
    /// device has 256. The size of a batch decides the order of shots.
    pub const MAX_BATCH: u32 = 256;

    /// Room for batches of up to `rows` rows, of up to `row_entries` entries each, as far as it
    /// fits a buffer of `buffer_bytes`.
    pub fn new(
        memory: &Memory,
        buffer_bytes: u64,
        rows: u32,
        row_entries: u32,
    ) -> Result<CompactedRows, Error> {
        use wgpu::BufferUsages as Usage;
        let (of_row, entry_bytes) = (u64::from(row_entries), size_of::<RowEntry>() as u64);
        let fits = buffer_bytes.saturating_sub(ROW_ENTRIES_HEADER_BYTES) / entry_bytes;
        // 32 MiB, or one row where that is more. Plain choice.
        let max = ((32 << 20) / entry_bytes).max(of_row).min(fits);
        let entries = max.min(u64::from(rows) * of_row);
        let storage = Usage::STORAGE | Usage::COPY_DST | Usage::COPY_SRC;
        Ok(CompactedRows {
            settings: memory.uniform("settings", &[0; size_of::<RowSettings>()])?,
            entries: entries as u32,
            list: memory.buffer("entries", bytes(entries), storage)?,
            staging: memory.buffer("staging", bytes(entries), Usage::MAP_READ | Usage::COPY_DST)?,
            // 2 MiB.
            expected: 65_536,
        })
    }

    /// All rows of `patches`, in their order. `make` makes those of up to `batch_len` patches at
    /// once, or returns `None` where there is no room for their entries: then it is called with
    /// each half of them.
    ///
    /// # Errors
    /// Those of `make`, and [`ErrorKind::Memory`] where there is no room for a single row.
    pub fn in_batches<P>(
        gpu: &Gpu,
        patches: &[P],
        batch_len: u32,
        mut make: impl FnMut(&[P]) -> Result<Option<Vec<Row>>, Error>,
    ) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::with_capacity(patches.len());
        // The next batch is the last.
        let mut batches: Vec<&[P]> = patches.chunks(batch_len as usize).rev().collect();
        while let Some(batch) = batches.pop() {
            match make(batch)? {
                Some(made) => rows.extend(made),
                None if batch.len() > 1 => {
                    let (first, second) = batch.split_at(batch.len() / 2);
                    batches.extend([second, first]);
                }
                None => {
                    let found = "a row of more entries than there is room for".into();
                    return Err(gpu.device_error(ErrorKind::Memory, found));
                }
            }
        }
        Ok(rows)
    }

    /// Records how the first `rows` rows in `counts` are compacted, and these set to 0. Each has
    /// `settings.slots` words, or four times as many `through_panes`.
    pub fn compact(
        &self,
        gpu: &Gpu,
        encoder: &mut wgpu::CommandEncoder,
        counts: &wgpu::Buffer,
        rows: u32,
        through_panes: bool,
    ) {
        let pipelines = gpu.tracing.row_pipelines(&gpu.device);
        let pipeline = match through_panes {
            true => &pipelines.compact_rows_through_panes,
            false => &pipelines.compact_rows,
        };
        let bindings = [
            (1, counts.as_entire_binding()),
            (3, self.settings.as_entire_binding()),
            (4, self.list.as_entire_binding()),
        ];
        let layout = pipeline.get_bind_group_layout(1);
        let bindings = bind_group(&gpu.device, "compact rows", &layout, &bindings);
        encoder.clear_buffer(&self.list, 0, Some(ROW_ENTRIES_HEADER_BYTES));
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(pipeline);
        pass.set_bind_group(1, &bindings, &[]);
        pass.dispatch_workgroups(rows, 1, 1);
    }

    /// Runs what `encoder` recorded, by these `settings`: passes that count, then
    /// [`CompactedRows::compact`]. All rows together have at most `max_entries` entries.
    pub fn submit(
        &self,
        gpu: &Gpu,
        mut encoder: wgpu::CommandEncoder,
        settings: RowSettings,
        max_entries: u64,
    ) -> SubmittedRows {
        let room = u64::from(settings.entries);
        let copied = self.expected.min(max_entries).min(room).max(1);
        gpu.queue.write_buffer(&self.settings, 0, bytemuck::bytes_of(&settings));
        encoder.copy_buffer_to_buffer(&self.list, 0, &self.staging, 0, bytes(copied));
        SubmittedRows { submission: gpu.queue.submit([encoder.finish()]), copied, room }
    }

    /// The result of `read` for all entries of the rows, the last that were submitted: row by row
    /// in any order, slots ascending. `None` where there is no room for them.
    pub fn read<T>(
        &mut self,
        gpu: &Gpu,
        rows: &SubmittedRows,
        read: impl Fn(&[RowEntry]) -> T,
    ) -> Result<Option<T>, Error> {
        let Self { list, staging, .. } = self;
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
        let (count, entries) = read_up_to(rows.submission.clone(), rows.copied)?;
        if count > rows.room {
            return Ok(None);
        }
        // The next batch is likely to have about as many.
        self.expected = count + count / 4;
        if entries.is_some() {
            return Ok(entries);
        }
        // More than were copied: once more, all of them.
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_buffer_to_buffer(list, 0, staging, 0, bytes(count));
        let submission = gpu.queue.submit([encoder.finish()]);
        Ok(read_up_to(submission, count)?.1)
    }
}

/// The entries of each of `rows` rows, by their numbers in the batch; or the first wrong number.
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

#[cfg(test)]
mod tests {
    use super::super::test_support::gpu;
    use super::*;

    #[test]
    #[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
    fn batches_without_room_are_made_in_halves() {
        let gpu = gpu();
        let patches: Vec<u32> = (0..10).collect();
        let make_all = |room: usize| {
            let mut asked = vec![];
            let made = CompactedRows::in_batches(&gpu, &patches, 8, |batch| {
                asked.push(batch.len());
                let row = |&patch: &u32| Row { escaped: patch, ..Row::default() };
                Ok((batch.len() <= room).then(|| batch.iter().map(row).collect()))
            });
            (made, asked)
        };
        let (rows, asked) = make_all(3);
        let escaped: Vec<u32> = rows.unwrap().iter().map(|row| row.escaped).collect();
        assert_eq!(escaped, patches);
        assert_eq!(asked, [8, 4, 2, 2, 4, 2, 2, 2]);
        let (rows, asked) = make_all(0);
        assert_eq!(rows.unwrap_err().kind(), ErrorKind::Memory);
        assert_eq!(asked, [8, 4, 2, 1]);
    }
}
