// Lists the slots of rows that any ray has hit, in order within a row, and resets them to zero: a
// workgroup per row, a lane per range of its slots.

const COMPACT_LANES: u32 = 256u;

struct RowEntries {
    count: atomic<u32>,   // of entries; those beyond the capacity are counted, not written
    padding: array<u32, 3>,
    entries: array<RowEntry>,
}

@group(1) @binding(1) var<storage, read_write> counts: array<u32>;
@group(1) @binding(3) var<uniform> settings: RowSettings;
@group(1) @binding(4) var<storage, read_write> list: RowEntries;

var<workgroup> ends: array<u32, COMPACT_LANES>;   // cumulative counts of lanes
var<workgroup> first: u32;

@compute @workgroup_size(256)
fn compact_rows(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    compact(group.x, group.x * settings.slots, lane, false);
}

// The same for rows through panes.
@compute @workgroup_size(256)
fn compact_rows_through_panes(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    compact(group.x, 4u * group.x * settings.slots, lane, true);
}

// Compacts the row of a patch, whose counts begin at `row`.
fn compact(patch_: u32, row: u32, lane: u32, has_panes: bool) {
    let run = (settings.slots + COMPACT_LANES - 1u) / COMPACT_LANES;
    let start = min(lane * run, settings.slots);
    let end = min(start + run, settings.slots);
    var count = 0u;
    for (var slot = start; slot < end; slot++) {
        count += u32(counts[row + slot] != 0u);
    }
    // Prefix sums over the lanes (Hillis and Steele 1986).
    ends[lane] = count;
    for (var step = 1u; step < COMPACT_LANES; step *= 2u) {
        workgroupBarrier();
        var before = 0u;
        if lane >= step {
            before = ends[lane - step];
        }
        workgroupBarrier();
        ends[lane] += before;
    }
    workgroupBarrier();
    if lane == 0u {
        first = atomicAdd(&list.count, ends[COMPACT_LANES - 1u]);
    }
    workgroupBarrier();
    var index = first + ends[lane] - count;
    for (var slot = start; slot < end; slot++) {
        let at = row + slot;
        let count = counts[at];
        if count == 0u {
            continue;
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
        if index < settings.entries {
            list.entries[index] = entry;
        }
        index += 1u;
    }
}
