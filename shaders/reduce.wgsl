// Adds up the weights of the pixels that see each element: item buffers to form-factor rows,
// dense, in fixed point, so that the order of the additions does not matter.
//
// A thread walks down one pixel column of a strip, and looks the element up and adds to memory only
// where the item changes.

const STRIP: u32 = 16u;

struct Reduction {
    resolution: u32,      // N: an item buffer is N wide and 3N high
    slots: u32,           // words of a row: open, back, then one an element
}

@group(0) @binding(0) var items: texture_2d_array<u32>;   // a layer a hemicube
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
    let end = min(id.y * STRIP + STRIP, 3u * n);
    var item = textureLoad(items, vec2u(x, id.y * STRIP), id.z, 0).x;
    var sum = 0u;
    for (var y = id.y * STRIP; y < end; y++) {
        let next = textureLoad(items, vec2u(x, y), id.z, 0).x;
        if next != item {
            atomicAdd(&rows[base + slots[item]], sum);
            sum = 0u;
            item = next;
        }
        sum += weights[y * n + x];
    }
    atomicAdd(&rows[base + slots[item]], sum);
}
