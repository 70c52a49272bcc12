// Draws the sky behind all surfaces, over one face of a hemicube: last, at the far end. Directions
// are looked up as in src/scene/sky_map.rs. Needs shared/view.wgsl before it.

struct SkyAxes {
    x: vec3f,             // the map's axes: its zenith is z
    side: u32,            // pieces along the edge of a square
    y: vec3f,
    padding: u32,
    z: vec3f,
    padding_2: u32,
}

@group(0) @binding(0) var<storage, read> views: array<RadianceView>;
@group(0) @binding(1) var<uniform> axes: SkyAxes;
// Radiosity of a surface as bright, in units of about the brightest: the square above the horizon,
// and below it the other one.
@group(0) @binding(2) var pieces: texture_2d<f32>;

struct Varying {
    @builtin(position) position: vec4f,
    @location(0) direction: vec3f,   // of any length, in the map's axes
}

// One triangle that covers the face.
@vertex
fn vertex(@builtin(vertex_index) index: u32, @builtin(instance_index) view_index: u32) -> Varying {
    let corner = vec2f(f32(index == 1u), f32(index == 2u)) * 4.0 - 1.0;
    let bottom = views[view_index].bottom;
    let height = bottom + (1.0 - bottom) * (corner.y + 1.0) * 0.5;
    let d = views[view_index].forward
        + views[view_index].right * corner.x
        + views[view_index].up * height;
    var out: Varying;
    out.position = vec4f(corner, 0.0, 1.0);
    out.direction = vec3f(dot(axes.x, d), dot(axes.y, d), dot(axes.z, d));
    return out;
}

// Radiosity; the alpha of 0 says that nothing is there.
@fragment
fn sky(in: Varying) -> @location(0) vec4f {
    let d = in.direction / dot(abs(in.direction), vec3f(1.0));
    let side = f32(axes.side);
    let last = axes.side - 1u;
    let column = min(u32(max((d.x + d.y + 1.0) * 0.5 * side, 0.0)), last);
    let line = min(u32(max((d.x - d.y + 1.0) * 0.5 * side, 0.0)), last);
    let square = select(0u, axes.side, d.z < 0.0);
    return vec4f(textureLoad(pieces, vec2u(column, square + line), 0).rgb, 0.0);
}
