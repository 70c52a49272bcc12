// Light from outside: the sky and the sun. Needs shared/trace.wgsl and shared/lights.wgsl before
// it.

@group(0) @binding(7) var sky_pieces: texture_2d<f32>;

// Light from the sky along a direction, as the radiosity of a surface.
fn from_sky(direction: vec3f) -> vec3f {
    if scene.sky_side == 0u {
        return scene.sky;
    }
    let along = vec3f(
        dot(scene.sky_x, direction),
        dot(scene.sky_y, direction),
        dot(scene.sky_z, direction),
    );
    let d = along / dot(abs(along), vec3f(1.0));
    let side = f32(scene.sky_side);
    let last = scene.sky_side - 1u;
    let column = min(u32(max((d.x + d.y + 1.0) * 0.5 * side, 0.0)), last);
    let line = min(u32(max((d.x - d.y + 1.0) * 0.5 * side, 0.0)), last);
    let square = select(0u, scene.sky_side, d.z < 0.0);
    return textureLoad(sky_pieces, vec2u(column, square + line), 0).rgb;
}

// The direction to the point `at` of the unit square on the sun.
fn towards_sun(at: vec2f) -> vec3f {
    let turn = 2.0 * PI * at.y;
    let across = scene.sun_right * cos(turn) + scene.sun_up * sin(turn);
    return normalize(scene.sun_middle + across * sqrt(at.x));
}
