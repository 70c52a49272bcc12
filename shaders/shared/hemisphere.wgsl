// Directions over the hemisphere of a point. Needs shared/trace.wgsl before it.

// Unit vectors along two tangents and the normal, ray by ray.
@group(1) @binding(2) var directions: texture_2d<f32>;

// The direction of ray k.
fn direction_of(k: u32, point: TracedPoint) -> vec3f {
    let local = textureLoad(directions, vec2u(k % TEXELS_PER_LINE, k / TEXELS_PER_LINE), 0).xyz;
    return turned(local, point.normal, point.rotation);
}
