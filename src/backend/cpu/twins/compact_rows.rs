//! Twin of `shaders/compact_rows.wgsl`: the slots of rows that any ray has hit.

use crate::backend::gpu::layout::{RowEntry, RowSettings};

/// The entries of all rows in `counts`, in order; with panes a row takes four rows of counts. Their
/// slots are reset to zero.
pub fn compact_rows(counts: &mut [u32], settings: &RowSettings, has_panes: bool) -> Vec<RowEntry> {
    let slots = settings.slots as usize;
    let rows = if has_panes { 4 } else { 1 };
    let mut entries = vec![];
    for (patch_, counts) in (0..).zip(counts.chunks_mut(rows * slots)) {
        for slot in 0..slots {
            let count = counts[slot];
            if count == 0 {
                continue;
            }
            let mut entry = RowEntry { patch_, slot: slot as u32, count, ..Default::default() };
            for channel in 0..rows - 1 {
                entry.passed[channel] = counts[(channel + 1) * slots + slot];
            }
            for row in 0..rows {
                counts[row * slots + slot] = 0;
            }
            entries.push(entry);
        }
    }
    entries
}
