// Adds up the weights of the pixels that see each element: item buffers to dense form-factor rows
// in fixed point, so that the order of the additions does not matter.
//
// A thread processes one pixel column of a strip, and looks the element up and adds to memory only
// where the item changes.

@group(0) @binding(0) var<storage, read> items: array<u32>;
@group(0) @binding(1) var<storage, read> weights: array<u32>;
@group(0) @binding(2) var<storage, read_write> rows: array<atomic<u32>>;
@group(0) @binding(3) var<uniform> reduction: Reduction;
@group(0) @binding(4) var<storage, read> slots: array<u32>;   // the row slot of each item

@compute @workgroup_size(64)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    let n = reduction.resolution;
    let x = id.x;
    if x >= n {
        return;
    }
    let base = id.z * reduction.slots;
    let line = id.z * 3u * n;
    let start = id.y * STRIP;
    var item = items[(line + start) * reduction.stride + x];
    var sum = 0u;
    for (var y = start; y < min(start + STRIP, 3u * n); y++) {
        let next = items[(line + y) * reduction.stride + x];
        if next != item {
            atomicAdd(&rows[base + slots[item]], sum);
            sum = 0u;
            item = next;
        }
        sum += weights[y * n + x];
    }
    atomicAdd(&rows[base + slots[item]], sum);
}
