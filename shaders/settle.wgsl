// Evaluates the rays of each point, and selects the points that cast more: a lane per point. Needs
// shared/trace.wgsl, shared/lights.wgsl, shared/gather_state.wgsl and shared/near_field.wgsl before
// it.
//
// error = max(|E of the first half − E of the second|, largest ray / rays) / 2, for rays over the
// hemisphere and for rays to lights; those with the larger error are doubled.

@group(1) @binding(2) var<storage, read_write> samples: array<Sample>;
@group(1) @binding(4) var<storage, read_write> work: Work;

// By light and sun.
alias Visibilities = array<Visible, 9>;

// The irradiance of the lights of one kind, by the visible part of each.
fn of_lights(p: u32, first: Visibilities, is_wide: bool, points: f32) -> vec3f {
    var irradiance = vec3f(0.0);
    var seen = first;
    for (var k = 0u; k < states[p].light_count; k++) {
        let ranked = states[p].lights[k];
        if (ranked.is_wide != 0u) == is_wide {
            let light = lights[ranked.light];
            var share = 1.0 / max(points, 1.0);
            if light.is_convex != 0u {
                share = ranked.factor / max(seen[k].all, 1e-37);
            }
            irradiance += light.exitance * seen[k].seen * share;
        }
    }
    return irradiance;
}

fn together(a: Visibilities, b: Visibilities) -> Visibilities {
    var out = a;
    var other = b;
    for (var k = 0u; k < 9u; k++) {
        out[k].seen += other[k].seen;
        out[k].all += other[k].all;
    }
    return out;
}

fn of_sun(normal: vec3f, sun: Visible, points: f32) -> vec3f {
    if scene.has_sun == 0u {
        return vec3f(0.0);
    }
    let cosine = dot(normal, scene.sun_middle);
    if cosine >= SINE_OF_SUN {
        return scene.sun * cosine * sun.seen / max(sun.all, 1e-37);
    }
    return scene.sun * sun.seen / max(points, 1.0);
}

@compute @workgroup_size(64)
fn settle(@builtin(global_invocation_id) id: vec3u) {
    let p = id.x;
    if p >= settings.points || states[p].pending == 0u {
        return;
    }
    let pending = states[p].pending;
    let normal = points[p].normal;
    // Number of rays, both halves together.
    var ray_count = states[p].ray_count;
    var shadow_count = states[p].shadow_count;
    if pending == 1u {
        ray_count *= 2u;
    }
    if pending == 2u {
        shadow_count *= 2u;
    }
    var halves = states[p].rays;
    var seen = states[p].visible;
    var all_seen = together(seen[0], seen[1]);
    let rays = f32(ray_count);
    // Of near surfaces the light by the field, unless paths have found it.
    var covered = states[p].covered;
    for (var h = 0u; h < 2u; h++) {
        if is_covered(halves[h].near, 0.5 * rays) {
            covered = 1u;
        } else {
            halves[h].light += halves[h].near_light;
            halves[h].largest = max(halves[h].largest, halves[h].near_largest);
        }
    }
    let shadow_rays = f32(shadow_count);
    var ray_means: array<vec3f, 2>;
    var shadow_means: array<vec3f, 2>;
    for (var h = 0u; h < 2u; h++) {
        ray_means[h] = (halves[h].light + halves[h].lamps) / (0.5 * rays)
            + of_lights(p, seen[h], true, 0.0);
        shadow_means[h] = of_lights(p, seen[h], false, 0.5 * shadow_rays)
            + of_sun(normal, seen[h][SUN], 0.5 * shadow_rays);
    }
    let light = halves[0].light + halves[1].light;
    let emitted = halves[0].lamps + halves[1].lamps;
    let largest = max(halves[0].largest, halves[1].largest);
    let of_wide = of_lights(p, all_seen, true, 0.0);
    let of_shadows = of_lights(p, all_seen, false, shadow_rays)
        + of_sun(normal, all_seen[SUN], shadow_rays);
    var ray_error = states[p].ray_error;
    if (pending & 1u) != 0u {
        ray_error = max(distance(ray_means[0], ray_means[1]), largest / rays) / 2.0;
    }
    var shadow_error = states[p].shadow_error;
    if (pending & 2u) != 0u {
        shadow_error = distance(shadow_means[0], shadow_means[1]) / 2.0;
    }
    let direct = emitted / rays + of_wide + of_shadows + points[p].luminaires;
    let irradiance = light / rays + direct;
    var out: Sample;
    out.irradiance = irradiance;
    out.noise = length(vec2f(ray_error, shadow_error));
    out.direct = direct;
    out.escaped = (halves[0].escaped + halves[1].escaped) / rays;
    out.back = (halves[0].back + halves[1].back) / rays;
    out.inverse_distance = (halves[0].inverse_distance + halves[1].inverse_distance) / rays;
    out.rays = ray_count;
    out.shadow_rays = shadow_count;
    out.covered = covered;
    samples[p] = out;
    // Both halves become the first half of the next pass; without doubling too, since only the
    // total of these sums is used again.
    let allowed = settings.noise * max(length(irradiance), settings.dim);
    let shadows_left = shadow_count < max(settings.max_rays / RAYS_PER_SHADOW_RAY, 2u);
    let rays_left = ray_count < settings.max_rays;
    var next = 0u;
    if out.noise > allowed {
        if shadow_error > ray_error {
            next = select(select(0u, 1u, rays_left), 2u, shadows_left);
        } else {
            next = select(select(0u, 2u, shadows_left), 1u, rays_left);
        }
    }
    states[p].pending = next;
    if next == 0u {
        return;
    }
    states[p].ray_count = ray_count;
    states[p].shadow_count = shadow_count;
    states[p].ray_error = ray_error;
    states[p].shadow_error = shadow_error;
    states[p].covered = covered;
    states[p].rays[0] = RaySums(
        light, halves[0].escaped + halves[1].escaped,
        emitted, halves[0].back + halves[1].back,
        halves[0].inverse_distance + halves[1].inverse_distance, largest,
        0.0, 0.0, vec3f(0.0), 0.0,
    );
    states[p].rays[1] = RaySums();
    states[p].visible[0] = all_seen;
    states[p].visible[1] = Visibilities();
    if next == 1u {
        let at = atomicAdd(&work.ray_groups[0], 1u);
        work.points[at] = p;
    } else {
        let at = atomicAdd(&work.shadow_groups[0], 1u);
        work.points[settings.points + at] = p;
    }
}
