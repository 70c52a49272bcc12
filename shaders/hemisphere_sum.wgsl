// Adds up what a point receives: pixels of its hemicube times their weights, and of each tile the
// form factors of the pixels that show its light. A workgroup a point, twice: columns by
// themselves, then their sums; with nothing to wait for, software devices keep sums in registers.
// Every sum is in a fixed order.

const LANES: u32 = 64u;
const TILE: u32 = 32u;    // pixels along an edge of a light's tile
const WORDS: u32 = 24u;   // numbers that a point receives
const PI: f32 = 3.14159265358979;

alias Columns = array<array<f32, LANES>, WORDS>;

struct Summation {
    resolution: u32,      // N: a hemicube is N wide and 3N high, the tiles follow below
    tiles: u32,           // tiles a point
}

// A tile of a light, in the point's frame, whose z axis is its normal: the direction to the middle
// of its image, and from there to the middle of the right and of the upper edge.
struct Tile {
    middle: vec3f,
    scale: f32,           // area of a pixel at distance 1 along the view; 0 for no light
    right: vec3f,
    disc: f32,            // of the sun's tile, whose red says what hides it: its radius, squared
    up: vec3f,
    padding: u32,
}

@group(0) @binding(0) var pixels: texture_2d_array<f32>;   // a layer a point
// Of a pixel: its form factor, and that times axial distance over distance.
@group(0) @binding(1) var<storage, read> weights: array<vec2f>;
@group(0) @binding(2) var<storage, read> tiles: array<Tile>;
@group(0) @binding(3) var<storage, read_write> columns: array<Columns>;   // a point
@group(0) @binding(4) var<uniform> summation: Summation;

@group(0) @binding(5) var<storage, read> sums_of_columns: array<Columns>;   // the same
@group(0) @binding(6) var<storage, read_write> sums: array<array<f32, WORDS>>;

@compute @workgroup_size(LANES)
fn add_columns(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let n = summation.resolution;
    let point = group.x;
    var radiosity = vec3f(0.0);
    var shares = vec3f(0.0);   // open, back, nearness
    // Eight threads side by side along each line, a line summed up by itself to round less.
    for (var y = lane / 8u; y < 3u * n; y += LANES / 8u) {
        var radiosity_here = vec3f(0.0);
        var shares_here = vec3f(0.0);
        for (var x = lane % 8u; x < n; x += 8u) {
            let pixel = textureLoad(pixels, vec2u(x, y), point, 0);
            let weight = weights[y * n + x];
            radiosity_here += pixel.rgb * weight.x;
            let open = select(0.0, weight.x, pixel.a == 0.0);
            let back = select(0.0, weight.x, pixel.a < 0.0);
            shares_here += vec3f(open, back, abs(pixel.a) * weight.y);
        }
        radiosity += radiosity_here;
        shares += shares_here;
    }
    for (var k = 0u; k < 3u; k++) {
        columns[point][k][lane] = radiosity[k];
        columns[point][3u + k][lane] = shares[k];
    }
    let tiles_per_line = max(n, TILE) / TILE;
    for (var tile_index = 0u; tile_index < summation.tiles; tile_index++) {
        let tile = tiles[point * summation.tiles + tile_index];
        if tile.scale == 0.0 {
            continue;
        }
        let cell = vec2u(tile_index % tiles_per_line, tile_index / tiles_per_line);
        let corner = cell * TILE + vec2u(0u, 3u * n);
        var seen = vec2f(0.0);
        for (var i = lane; i < TILE * TILE; i += LANES) {
            let at = vec2u(i % TILE, i / TILE);
            let pixel = textureLoad(pixels, corner + at, point, 0);
            let p = (vec2f(at) + 0.5) * (2.0 / f32(TILE)) - 1.0;
            let off = p.x * tile.right - p.y * tile.up;
            let d = tile.middle + off;
            // cos / (π r²) of a pixel at distance 1 along the view, which it faces.
            let r2 = dot(d, d);
            let weight = max(d.z, 0.0) * tile.scale / (PI * r2 * r2);
            if tile.disc == 0.0 {
                seen += pixel.ra * weight;
            } else if dot(off, off) <= tile.disc {
                seen += vec2f(1.0 - pixel.r, 1.0) * weight;
            }
        }
        columns[point][8u + 2u * tile_index][lane] = seen.x;
        columns[point][9u + 2u * tile_index][lane] = seen.y;
    }
}

@compute @workgroup_size(WORDS)
fn add_up(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) word: u32) {
    let point = group.x;
    var sum = 0.0;
    for (var lane = 0u; lane < LANES; lane++) {
        sum += sums_of_columns[point][word][lane];
    }
    sums[point][word] = sum;
}
