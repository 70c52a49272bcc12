// Draws the scene's own triangles over one face of a hemicube. Every pixel gets the visible item: 0
// (the clear value) for nothing, BACK, or a cell of the triangle's lattice, computed from the
// barycentric position. Needs shared/corner.wgsl and shared/lattice.wgsl before it.

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
    let triangle = index / 3u;   // its position in the drawing order
    let d = from_eye(corners[index], view.eye, view.eye_low);
    let x = dot(d, view.right);
    let y = dot(d, view.up);
    let w = dot(d, view.forward);
    var out: Varying;
    out.position = clip_position(x, y, w, view.bottom, view.near);
    if triangle == view.own_triangle || shows_covered_back(index, view.eye, view.eye_low) {
        out.position = vec4f(0.0, 0.0, -1.0, 1.0);   // beyond the far end: not drawn
    }
    let grid = triangles[triangle];
    out.lattice = lattice_corner(index % 3u, grid.side);
    out.first = grid.first;
    out.side = grid.side;
    return out;
}

// The lattice position is perspective-correct.
@fragment
fn fragment(in: Varying, @builtin(front_facing) front: bool) -> @location(0) u32 {
    let p = max(in.lattice, vec2f(0.0));
    let square = lattice_square(p, in.side);
    let past_diagonal = p.x - f32(square.x) + p.y - f32(square.y) > 1.0;
    let beyond = past_diagonal && has_flipped_cell(square, in.side);
    return select(BACK, in.first + cell_index(square, in.side, beyond), front);
}
