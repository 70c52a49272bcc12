// Draws the radiosity of the scene's own triangles: over one face of a hemicube, or over a tile
// that fits one light. The element that a pixel sees is found in the triangle's quadtree: in a
// lattice of nodes at the deepest level that it is complete to, then by descent. Needs
// shared/corner.wgsl, shared/lattice.wgsl and shared/view.wgsl before it.

const INNER: u32 = 0x80000000u;
const ELEMENTS_A_LINE: u32 = 2048u;   // of their texture

struct RadianceTriangle {
    exitance: vec3f,      // per channel, in units of about the brightest
    light: u32,           // the light that it belongs to, if any
    index: u32,           // which of the scene's it is
    padding: array<u32, 3>,
}

struct Lattice {
    first: u32,           // its first node
    side: u32,            // cells along an edge, a power of two
}

@group(0) @binding(0) var<storage, read> corners: array<Corner>;
@group(0) @binding(1) var<storage, read> triangles: array<RadianceTriangle>;
@group(0) @binding(2) var<storage, read> views: array<RadianceView>;
@group(0) @binding(3) var<storage, read> lattices: array<Lattice>;   // one a triangle of the scene
@group(0) @binding(4) var<storage, read> nodes: array<u32>;   // INNER + first child, or an element
@group(0) @binding(5) var elements: texture_2d<f32>;   // reflected radiosity at corners, same unit

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) lattice: vec2f,   // weights of the second and third corner, times the side
    @location(1) @interpolate(flat) exitance: vec3f,
    @location(2) @interpolate(flat) first: u32,
    @location(3) @interpolate(flat) side: u32,
    @location(4) @interpolate(flat) sought: f32,   // 1 on the light that the view looks for
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) view_index: u32) -> Varying {
    let triangle = triangles[index / 3u];
    let d = from_eye(corners[index], views[view_index].eye, views[view_index].eye_low);
    let x = dot(d, views[view_index].right);
    let y = dot(d, views[view_index].up);
    let w = dot(d, views[view_index].forward);
    var out: Varying;
    out.position = clip_position(x, y, w, views[view_index].bottom, views[view_index].near);
    if shows_covered_back(index, views[view_index].eye, views[view_index].eye_low) {
        out.position = NOWHERE;
    }
    let lattice = lattices[triangle.index];
    out.lattice = lattice_corner(index % 3u, lattice.side);
    out.first = lattice.first;
    out.side = lattice.side;
    out.exitance = triangle.exitance;
    for (var k = 0u; k < views[view_index].light_count; k++) {
        if views[view_index].lights[k] == triangle.light {
            out.exitance = vec3f(0.0);
        }
    }
    out.sought = f32(triangle.light == views[view_index].light);
    return out;
}

// Reflected radiosity at a position of a triangle's lattice, linear between the element's corners.
fn reflected(lattice: vec2f, first: u32, side: u32) -> vec3f {
    // The middle of a pixel is in the triangle but for the rounding of its corners.
    let inside = max(lattice, vec2f(0.0));
    let at = inside * min(f32(side) / max(inside.x + inside.y, 1e-30), 1.0);
    let square = lattice_square(at, side);
    var p = at - vec2f(square);
    let beyond = p.x + p.y > 1.0 && has_flipped_cell(square, side);
    if beyond {
        p = 1.0 - p;
    }
    // Weights of the second and third corner of the node.
    var node = nodes[first + cell_index(square, side, beyond)];
    // What lies out of the arrays reads as 0, an element: the descent ends.
    while (node & INNER) != 0u {
        node &= ~INNER;
        if p.x > 0.5 {
            node += 1u;
            p = vec2f(2.0 * p.x - 1.0, 2.0 * p.y);
        } else if p.y > 0.5 {
            node += 2u;
            p = vec2f(2.0 * p.x, 2.0 * p.y - 1.0);
        } else if p.x + p.y > 0.5 {
            node += 3u;
            p = 1.0 - 2.0 * p;
        } else {
            p = 2.0 * p;
        }
        node = nodes[node];
    }
    // The corners of an element lie below one another.
    let at_a = vec2u(node % ELEMENTS_A_LINE, node / ELEMENTS_A_LINE * 3u);
    let a = textureLoad(elements, at_a, 0).rgb;
    let b = textureLoad(elements, at_a + vec2u(0u, 1u), 0).rgb;
    let c = textureLoad(elements, at_a + vec2u(0u, 2u), 0).rgb;
    return a + (b - a) * p.x + (c - a) * p.y;
}

// Radiosity, and the reciprocal of the depth along the face's axis: negative for a back, whose
// light is not seen. The clear value 0 is for nothing.
@fragment
fn radiance(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if !front {
        return vec4f(0.0, 0.0, 0.0, -in.position.w);
    }
    return vec4f(reflected(in.lattice, in.first, in.side) + in.exitance, in.position.w);
}

// Whether the light that a tile looks for is seen: red where all is drawn, alpha where the light
// is drawn alone. Each is masked out where the other is drawn.
@fragment
fn light_visibility(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    return vec4f(select(0.0, in.sought, front));
}

// That something is seen before the sun.
@fragment
fn sun_hidden() -> @location(0) vec4f {
    return vec4f(1.0);
}
