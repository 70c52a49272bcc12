// Rays from each point to points on its lights and on the sun: a workgroup per point. Needs
// shared/trace.wgsl, shared/lights.wgsl, shared/sky.wgsl and shared/gather_state.wgsl before it.

// All points.
@compute @workgroup_size(64)
fn light_rays(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    cast_rays(group.x, lane);
}

// Points whose rays to lights are doubled.
@compute @workgroup_size(64)
fn more_light_rays(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    cast_rays(work.points[settings.points + group.x], lane);
}

fn cast_rays(p: u32, lane: u32) {
    let point = points[p];
    let total = states[p].shadow_count;
    let is_first = states[p].pending == 3u;
    let start = select(total, 0u, is_first);
    let middle = select(total, total / 2u, is_first);
    let end = select(2u * total, total, is_first);
    let from_ray = start + settings.first;
    let to_ray = min(from_ray + settings.pass_rays, end);
    if from_ray >= end {
        return;
    }
    for (var k = 0u; k < states[p].light_count; k++) {
        if states[p].lights[k].is_wide != 0u {
            continue;
        }
        let number = states[p].lights[k].light;
        let light = lights[number];
        var visible = array<vec4f, 2>();
        for (var i = from_ray + lane; i < to_ray; i += LANES) {
            let to = to_light(light, point, rotated_sobol(i, point));
            if to.factor > 0.0 {
                var seen = vec3f(0.0);
                if to.is_solid && !is_hidden(to.ray, to.distance, number) {
                    seen = to.factor * passed(to.ray, to.distance);
                }
                visible[select(0u, 1u, i >= middle)] += vec4f(seen, to.factor);
            }
        }
        add(p, k, lane, visible);
    }
    if scene.has_sun != 0u {
        var visible = array<vec4f, 2>();
        for (var i = from_ray + lane; i < to_ray; i += LANES) {
            let direction = towards_sun(rotated_sobol(i, point));
            let cosine = dot(point.normal, direction);
            if cosine > 0.0 {
                var seen = vec3f(0.0);
                let ray = Ray(point.position, point.position_low, direction, point.near);
                if !is_hidden(ray, FAR, ANY_LIGHT) {
                    seen = cosine * passed(ray, FAR);
                }
                visible[select(0u, 1u, i >= middle)] += vec4f(seen, cosine);
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
            states[p].visible[9u * half + light].seen += sum.xyz;
            states[p].visible[9u * half + light].all += sum.w;
        }
    }
}
