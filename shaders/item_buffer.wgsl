// Draws the scene's own triangles over one face of a hemicube. Every pixel gets the item seen
// there: 0 (the clear value) for nothing, BACK, or a cell of the triangle's lattice, found from the
// barycentric position.

const BACK: u32 = 1u;

// A corner in two parts that add up to it.
struct Corner {
    high: vec3f,          // from the middle of the scene, in units of its size
    padding: u32,
    low: vec3f,           // what rounding took off
    padding_2: u32,
}

struct FaceView {
    eye: vec3f,           // patch centre, from the middle of the scene, in units of its size
    near: f32,            // near plane, same unit
    right: vec3f,         // unit vectors of the view, right x up = -forward
    bottom: f32,          // tangent of the lowest line's elevation: -1 or 0
    up: vec3f,
    own_triangle: u32,    // place of the patch's own triangle, which is never drawn
    forward: vec3f,
    padding: u32,
    eye_low: vec3f,       // what rounding took off the eye
    padding_2: u32,
}

struct TriangleCells {
    first: u32,           // item of its first cell
    side: u32,            // cells along an edge, a power of two
}

@group(0) @binding(0) var<storage, read> corners: array<Corner>;
@group(0) @binding(1) var<storage, read> triangles: array<TriangleCells>;
@group(0) @binding(2) var<storage, read> views: array<FaceView>;

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) lattice: vec2f,
    @location(1) @interpolate(flat) first: u32,
    @location(2) @interpolate(flat) side: u32,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) view_index: u32) -> Varying {
    let view = views[view_index];
    let triangle = index / 3u;   // its place in the drawing order
    let corner = index % 3u;
    // Of corners near the eye the first difference is exact: nothing is too small to be seen.
    let d = (corners[index].high - view.eye) + (corners[index].low - view.eye_low);
    let x = dot(d, view.right);
    let y = dot(d, view.up);
    let w = dot(d, view.forward);
    // Lines from `bottom` to 1 fill the viewport; depth near/w is reversed, its far end infinite.
    let span = 1.0 - view.bottom;
    var out: Varying;
    out.position = vec4f(x, (2.0 * y - (1.0 + view.bottom) * w) / span, view.near, w);
    if triangle == view.own_triangle {
        out.position = vec4f(0.0, 0.0, -1.0, 1.0);
    }
    let grid = triangles[triangle];
    out.lattice = f32(grid.side) * vec2f(f32(corner == 1u), f32(corner == 2u));
    out.first = grid.first;
    out.side = grid.side;
    return out;
}

// The lattice position is perspective-correct: (1, 0) steps along the first side, (0, 1) along the
// third. A square of the lattice holds an upright cell and, beyond its diagonal, a flipped one.
@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) u32 {
    let p = max(in.lattice, vec2f(0.0));
    let i = min(u32(p.x), in.side - 1u);
    let j = min(u32(p.y), in.side - 1u - i);
    let beyond = p.x - f32(i) + p.y - f32(j) > 1.0 && i + j + 1u < in.side;
    let cell = in.first + i * (2u * in.side - i) + 2u * j + u32(beyond);
    return select(BACK, cell, front);
}
