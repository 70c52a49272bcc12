// Cosine-distributed rays from the points of a list, and the sums of their results: a workgroup per
// point, a lane per ray. Needs shared/trace.wgsl, shared/lights.wgsl, shared/sky.wgsl,
// shared/gather_state.wgsl, shared/hemisphere.wgsl, shared/near_field.wgsl, shared/lattice.wgsl and
// shared/field.wgsl before it.

var<private> light_sums: array<Visible, 16>;

@compute @workgroup_size(64)
fn hemisphere_rays(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let p = work.points[group.x];
    let point = points[p];
    let state =
        vec4u(states[p].ray_count, states[p].pending, states[p].light_count, wide_lights(p));
    let known = uniform_of(lane, state);
    let rays = rays_of_pass(known.x, known.y);
    let light_count = known.z;
    for (var k = 0u; k < 2u * light_count; k++) {
        light_sums[k] = Visible();
    }
    var sums = array<RaySums, 2>();
    for (var k = rays.start + lane; k < rays.stop; k += LANES) {
        let half = select(0u, 1u, k >= rays.middle);
        cast_ray(p, point, direction_of(k, point), light_count, half, &sums);
    }
    if rays.start >= rays.end {
        return;
    }
    for (var half = 0u; half < 2u; half++) {
        let light = added_up(lane, vec4f(sums[half].light, sums[half].escaped));
        let emitted = added_up(lane, vec4f(sums[half].lamps, sums[half].back));
        let near = added_up(lane, vec4f(sums[half].near_light, sums[half].near));
        let rest = added_up(lane, vec4f(sums[half].inverse_distance, 0.0, 0.0, 0.0));
        let largest = largest_of(lane, sums[half].largest);
        let near_largest = largest_of(lane, sums[half].near_largest);
        if lane == 0u {
            states[p].rays[half].light += light.xyz;
            states[p].rays[half].escaped += light.w;
            states[p].rays[half].lamps += emitted.xyz;
            states[p].rays[half].back += emitted.w;
            states[p].rays[half].inverse_distance += rest.x;
            states[p].rays[half].largest = max(states[p].rays[half].largest, largest);
            states[p].rays[half].near += near.w;
            states[p].rays[half].near_largest =
                max(states[p].rays[half].near_largest, near_largest);
            states[p].rays[half].near_light += near.xyz;
        }
        for (var k = 0u; k < light_count; k++) {
            if ((known.w >> k) & 1u) == 0u {
                continue;
            }
            let sum = light_sums[half * light_count + k];
            let of_light = added_up(lane, vec4f(sum.seen, sum.all));
            if lane == 0u {
                states[p].visible[half][k].seen += of_light.xyz;
                states[p].visible[half][k].all += of_light.w;
            }
        }
    }
}

// Adds the result of one ray.
fn cast_ray(
    p: u32,
    point: TracedPoint,
    direction: vec3f,
    light_count: u32,
    half: u32,
    sums: ptr<function, array<RaySums, 2>>,
) {
    let ray = Ray(point.position, point.position_low, direction, point.near);
    let hit = nearest(ray);
    let is_surface = hit.triangle != NOTHING;
    let share = passed(ray, select(FAR, hit.distance, is_surface));
    var of_light = NO_LIGHT;
    if is_surface && hit.front {
        of_light = triangles[hit.triangle].light;
    }
    var is_known = false;
    for (var k = 0u; k < light_count; k++) {
        let ranked = states[p].lights[k];
        let is_hit = ranked.light == of_light;
        is_known |= is_hit;
        if ranked.is_wide != 0u {
            let at = half * light_count + k;
            if is_hit {
                light_sums[at].seen += share;
            }
            light_sums[at].all += f32(is_hit || is_towards(ray, lights[ranked.light]));
        }
    }
    if !is_surface {
        let light = from_sky(direction) * share;
        (*sums)[half].escaped += 1.0;
        (*sums)[half].light += light;
        (*sums)[half].largest = max((*sums)[half].largest, length(light));
        return;
    }
    (*sums)[half].inverse_distance += 1.0 / hit.distance;
    if !hit.front {
        (*sums)[half].back += 1.0;
        return;
    }
    let there = field_at(triangles[hit.triangle].index, vec2f(hit.u, hit.v));
    let light = there.radiosity * share;
    if settings.near_field != 0u && is_near(hit, there.side) {
        (*sums)[half].near += 1.0;
        (*sums)[half].near_light += light;
        (*sums)[half].near_largest = max((*sums)[half].near_largest, length(light));
    } else {
        (*sums)[half].light += light;
        (*sums)[half].largest = max((*sums)[half].largest, length(light));
    }
    if of_light != NO_LIGHT && !is_known {
        (*sums)[half].lamps += lights[of_light].exitance * share;
    }
}

// Whether a light, occluded or not, lies along the ray.
fn is_towards(ray: Ray, light: TracedLight) -> bool {
    for (var k = light.first; k < light.first + light.count; k++) {
        let hit = intersect(lamps[k].triangle, ray, FAR, 1.0);
        if hit.triangle != NOTHING && hit.front {
            return true;
        }
    }
    return false;
}
