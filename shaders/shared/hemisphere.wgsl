// Directions over the hemisphere of a point, and those that a pass casts rays along. Needs
// shared/trace.wgsl and shared/gather_state.wgsl before it.

// Unit vectors along two tangents and the normal, ray by ray.
@group(1) @binding(2) var directions: texture_2d<f32>;

// The direction of ray k.
fn direction_of(k: u32, point: TracedPoint) -> vec3f {
    let local = textureLoad(directions, vec2u(k % TEXELS_PER_LINE, k / TEXELS_PER_LINE), 0).xyz;
    return turned(local, point.normal, point.rotation);
}

struct RayRange {
    start: u32,           // first ray of the pass
    stop: u32,            // the ray after its last
    middle: u32,          // first ray of the second half
    end: u32,             // the ray after the last of all passes
    half: u32,            // number of rays of each half that is cast
}

// The rays that a pass casts from a point: in the first pass all rays, in two halves; then the same
// number again, as the second half.
fn rays_of_pass(total: u32, pending: u32) -> RayRange {
    let is_first = pending == 3u;
    let middle = select(total, total / 2u, is_first);
    let end = select(2u * total, total, is_first);
    let start = select(total, 0u, is_first) + settings.first;
    return RayRange(start, min(start + settings.pass_rays, end), middle, end, middle);
}
