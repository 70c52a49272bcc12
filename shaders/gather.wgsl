// Adds up what a place receives: pixels of its hemicube times their weights, and the form factors
// of the pixels that show each light apart. A workgroup a place; every sum in a fixed order.

const LANES: u32 = 64u;
const APART: u32 = 8u;
const TILE: u32 = 32u;    // pixels along an edge of a light's tile
const WORDS: u32 = 24u;   // numbers that a place receives
const STRIP: u32 = 16u;   // lines added up by themselves, to round less
const PI: f32 = 3.14159265358979;

struct Summation {
    resolution: u32,      // N: a hemicube is N wide and 3N high, the tiles follow below
    stride: u32,          // pixels from line to line
    lines: u32,           // lines a place
    slots: u32,           // tiles a place
}

// A tile of a light, in the place's frame, whose z axis is its normal: the direction to the middle
// of its image, and from there to the middle of the right and of the upper edge.
struct Tile {
    middle: vec3f,
    scale: f32,           // area of a pixel at distance 1 along the view; 0 for no light
    right: vec3f,
    padding: u32,
    up: vec3f,
    padding_2: u32,
}

@group(0) @binding(0) var<storage, read> pixels: array<vec4f>;
@group(0) @binding(1) var<storage, read> weights: array<vec2f>;   // form factor, times axial distance over distance
@group(0) @binding(2) var<storage, read> tiles: array<Tile>;
@group(0) @binding(3) var<storage, read_write> sums: array<f32>;
@group(0) @binding(4) var<uniform> summation: Summation;

var<workgroup> partial: array<array<f32, LANES>, WORDS>;

@compute @workgroup_size(LANES)
fn gather(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let n = summation.resolution;
    let place = group.x;
    let first = place * summation.lines * summation.stride;
    var radiosity = vec3f(0.0);
    var shares = vec3f(0.0);   // open, back, nearness
    for (var strip = 0u; strip < 3u * n; strip += STRIP) {
        var radiosity_here = vec3f(0.0);
        var shares_here = vec3f(0.0);
        for (var y = strip; y < min(strip + STRIP, 3u * n); y++) {
            for (var x = lane; x < n; x += LANES) {
                let pixel = pixels[first + y * summation.stride + x];
                let weight = weights[y * n + x];
                radiosity_here += pixel.rgb * weight.x;
                let open = select(0.0, weight.x, pixel.a == 0.0);
                let back = select(0.0, weight.x, pixel.a < 0.0);
                shares_here += vec3f(open, back, abs(pixel.a) * weight.y);
            }
        }
        radiosity += radiosity_here;
        shares += shares_here;
    }
    for (var k = 0u; k < 3u; k++) {
        partial[k][lane] = radiosity[k];
        partial[3u + k][lane] = shares[k];
    }
    let columns = max(n, TILE) / TILE;
    for (var slot = 0u; slot < summation.slots; slot++) {
        let tile = tiles[place * summation.slots + slot];
        if tile.scale == 0.0 {
            continue;
        }
        let corner = (3u * n + slot / columns * TILE) * summation.stride + slot % columns * TILE;
        var seen = vec2f(0.0);
        for (var i = lane; i < TILE * TILE; i += LANES) {
            let at = vec2u(i % TILE, i / TILE);
            let pixel = pixels[first + corner + at.y * summation.stride + at.x];
            let p = (vec2f(at) + 0.5) * (2.0 / f32(TILE)) - 1.0;
            let d = tile.middle + p.x * tile.right - p.y * tile.up;
            // cos / (π r²) of a pixel at distance 1 along the view, which it faces.
            let r2 = dot(d, d);
            seen += pixel.ra * (max(d.z, 0.0) * tile.scale / (PI * r2 * r2));
        }
        partial[8u + 2u * slot][lane] = seen.x;
        partial[9u + 2u * slot][lane] = seen.y;
    }
    workgroupBarrier();
    if lane < 8u + 2u * summation.slots {
        var sum = 0.0;
        for (var k = 0u; k < LANES; k++) {
            sum += partial[lane][k];
        }
        sums[place * WORDS + lane] = sum;
    }
}
