// Rays from the points of a list to points on their lights and on the sun: a workgroup per point.
// Needs shared/trace.wgsl, shared/lights.wgsl, shared/sky.wgsl and shared/gather_state.wgsl before
// it.

@compute @workgroup_size(64)
fn light_rays(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let p = work.points[settings.points + group.x];
    let point = points[p];
    let state =
        vec4u(states[p].shadow_count, states[p].pending, states[p].light_count, wide_lights(p));
    let known = uniform_of(lane, state);
    let rays = rays_of_pass(known.x, known.y);
    if rays.start >= rays.end {
        return;
    }
    for (var k = 0u; k < known.z; k++) {
        if ((known.w >> k) & 1u) != 0u {
            continue;
        }
        let number = states[p].lights[k].light;
        let light = lights[number];
        var visible = array<vec4f, 2>();
        for (var i = rays.start + lane; i < rays.stop; i += LANES) {
            let to = to_light(light, point, rotated_sobol(i, point));
            if to.factor > 0.0 {
                var seen = vec3f(0.0);
                if to.is_solid && !is_hidden(to.ray, to.distance, number) {
                    seen = to.factor * passed(to.ray, to.distance);
                }
                visible[select(0u, 1u, i >= rays.middle)] += vec4f(seen, to.factor);
            }
        }
        add(p, k, lane, visible);
    }
    if scene.has_sun != 0u {
        var visible = array<vec4f, 2>();
        for (var i = rays.start + lane; i < rays.stop; i += LANES) {
            let direction = towards_sun(rotated_sobol(i, point));
            let cosine = dot(point.normal, direction);
            if cosine > 0.0 {
                var seen = vec3f(0.0);
                let ray = Ray(point.position, point.position_low, direction, point.near);
                if !is_hidden(ray, FAR, ANY_LIGHT) {
                    seen = cosine * passed(ray, FAR);
                }
                visible[select(0u, 1u, i >= rays.middle)] += vec4f(seen, cosine);
            }
        }
        add(p, SUN, lane, visible);
    }
}

// Adds the visible part of a light over all lanes.
fn add(p: u32, light: u32, lane: u32, visible: array<vec4f, 2>) {
    var of_half = visible;
    for (var half = 0u; half < 2u; half++) {
        let sum = added_up(lane, of_half[half]);
        if lane == 0u {
            states[p].visible[half][light].seen += sum.xyz;
            states[p].visible[half][light].all += sum.w;
        }
    }
}
