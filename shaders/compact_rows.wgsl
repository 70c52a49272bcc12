// The slots of rows that any ray has met, and zeros in their place: a lane a slot, a line of
// workgroups a patch.

struct RowSettings {
    rays: u32,            // of a patch
    slots: u32,           // of a row
    unit: f32,
    entries: u32,         // that there is room for
}

struct RowEntry {
    patch_: u32,          // in its batch
    slot: u32,
    count: u32,           // rays
    padding: u32,
    passed: vec3u,        // of them, in units of 1/RowSettings::unit; 0 where there are no panes
    padding_2: u32,
}

struct RowEntries {
    count: atomic<u32>,   // of entries; more than there is room for are counted, not written
    padding: array<u32, 3>,
    entries: array<RowEntry>,
}

@group(1) @binding(1) var<storage, read_write> counts: array<u32>;
@group(1) @binding(3) var<uniform> settings: RowSettings;
@group(1) @binding(4) var<storage, read_write> found: RowEntries;

@compute @workgroup_size(64)
fn compact_rows(@builtin(global_invocation_id) id: vec3u) {
    compact(id.x, id.y, id.y * settings.slots + id.x, false);
}

// The same of rows through panes.
@compute @workgroup_size(64)
fn compact_rows_through_panes(@builtin(global_invocation_id) id: vec3u) {
    compact(id.x, id.y, 4u * id.y * settings.slots + id.x, true);
}

fn compact(slot: u32, patch_: u32, at: u32, has_panes: bool) {
    if slot >= settings.slots {
        return;
    }
    let count = counts[at];
    if count == 0u {
        return;
    }
    counts[at] = 0u;
    var entry = RowEntry(patch_, slot, count, 0u, vec3u(0u), 0u);
    if has_panes {
        for (var channel = 0u; channel < 3u; channel++) {
            let passed = at + (channel + 1u) * settings.slots;
            entry.passed[channel] = counts[passed];
            counts[passed] = 0u;
        }
    }
    let place = atomicAdd(&found.count, 1u);
    if place < settings.entries {
        found.entries[place] = entry;
    }
}
