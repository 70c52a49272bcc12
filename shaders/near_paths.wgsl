// Light that near surfaces reflect to points of whose hemisphere they cover much: a workgroup per
// point, a lane per ray, a path from each near surface that a ray meets. Needs shared/trace.wgsl,
// shared/lights.wgsl, shared/sky.wgsl, shared/gather_state.wgsl, shared/hemisphere.wgsl,
// shared/near_field.wgsl, shared/lattice.wgsl and shared/field.wgsl before it.
//
// At every vertex of a path light is sampled twice: at a point of a light and of the sun, and where
// the path goes on. A light counts with its share of both densities (balance heuristic: Veach and
// Guibas 1995). The path ends at the first surface that is not near, in the field's light.

var<private> random_state: u32;

// A hash of 32 bits: PCG-RXS-M-XS (Jarzynski and Olano 2020).
fn scrambled(bits: u32) -> u32 {
    let state = bits * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// The next random number in (0, 1).
fn random() -> f32 {
    random_state = random_state * 747796405u + 2891336453u;
    return (f32(scrambled(random_state) >> 8u) + 0.5) * 5.9604645e-8;
}

// The start of the random numbers of ray k: of nothing but where the point is.
fn seed_of(point: TracedPoint, k: u32) -> u32 {
    let bits = bitcast<vec3u>(point.position);
    return scrambled(scrambled(scrambled(scrambled(bits.x) ^ bits.y) ^ bits.z) ^ k);
}

@compute @workgroup_size(64)
fn near_paths(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let p = work.points[group.x];
    let point = points[p];
    let rays = rays_of_pass(states[p].ray_count, states[p].pending);
    var covered = array<bool, 2>(
        is_covered(states[p].rays[0].near, f32(rays.half)),
        is_covered(states[p].rays[1].near, f32(rays.half)),
    );
    let has_paths = rays.start < rays.end && (covered[0] || covered[1]);
    if uniform_of(lane, vec4u(u32(has_paths))).x == 0u {
        return;
    }
    var light = array<vec3f, 2>();
    var largest = array<f32, 2>();
    for (var k = rays.start + lane; k < rays.stop; k += LANES) {
        let half = select(0u, 1u, k >= rays.middle);
        if covered[half] {
            let reflected = near_light(p, point, k);
            light[half] += reflected;
            largest[half] = max(largest[half], length(reflected));
        }
    }
    for (var half = 0u; half < 2u; half++) {
        let all = added_up(lane, vec4f(light[half], 0.0));
        let max_length = largest_of(lane, largest[half]);
        if lane == 0u {
            states[p].rays[half].light += all.xyz;
            states[p].rays[half].largest = max(states[p].rays[half].largest, max_length);
        }
    }
}

// What ray k meets of the light that near surfaces reflect, by one path.
fn near_light(p: u32, point: TracedPoint, k: u32) -> vec3f {
    let ray = Ray(point.position, point.position_low, direction_of(k, point), point.near);
    let hit = nearest(ray);
    if hit.triangle == NOTHING || !hit.front {
        return vec3f(0.0);
    }
    let there = field_at(triangles[hit.triangle].index, vec2f(hit.u, hit.v));
    if !is_near(hit, there.side) {
        return vec3f(0.0);
    }
    random_state = seed_of(point, k);
    return passed(ray, hit.distance) * light_by_path(p, hit, there.reflectance);
}

// Radiosity that a front with this reflectance reflects at a hit, without its emission.
fn light_by_path(p: u32, start: Hit, start_reflectance: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    var throughput = vec3f(1.0);
    var hit = start;
    var reflectance = start_reflectance;
    for (var vertex = 1u; vertex <= MAX_VERTICES; vertex++) {
        let t = triangles[hit.triangle];
        let through = transmittance(t, reflectance);
        if vertex > 1u {
            let albedo = reflectance + through;
            let survival = min(max(albedo.x, max(albedo.y, albedo.z)), MAX_SURVIVAL);
            if random() >= survival {
                return sum;
            }
            throughput /= survival;
        }
        // The side that the path goes on from, in proportion to the light that leaves there.
        var side = 1.0;
        var leaves = reflectance;
        let sum_through = through.x + through.y + through.z;
        if sum_through > 0.0 {
            let sum_reflected = reflectance.x + reflectance.y + reflectance.z;
            let chance = sum_through / (sum_through + sum_reflected);
            if random() < chance {
                side = -1.0;
                leaves = through / chance;
            } else {
                leaves = reflectance / (1.0 - chance);
            }
        }
        throughput *= leaves;
        let at = on_triangle(t, hit.u, hit.v, side);
        sum += throughput * irradiance_of_lights(p, at);
        if scene.has_sun != 0u {
            sum += throughput * irradiance_of_sun(at);
        }
        let square = random();
        let turn = random();
        let direction = turned(vec3f(sqrt(square), 0.0, sqrt(1.0 - square)), at.normal, turn);
        let ray = Ray(at.position, at.position_low, direction, at.near);
        hit = nearest_but(ray, t.index);
        if hit.triangle == NOTHING {
            return sum + throughput * passed(ray, FAR) * from_sky(direction);
        }
        if !hit.front {
            return sum;
        }
        throughput *= passed(ray, hit.distance);
        let next = triangles[hit.triangle];
        if next.light != NO_LIGHT {
            let light = lights[next.light];
            let facing = max(-dot(normal_of(next), direction), 0.0);
            let above = max(dot(at.normal, direction), 0.0);
            let factor = light.area * facing * above / (PI * hit.distance * hit.distance);
            sum += throughput * light.exitance * balance(factor, chance_of(p, next.light));
        }
        let there = field_at(next.index, vec2f(hit.u, hit.v));
        if vertex == MAX_VERTICES || !is_near(hit, there.side) {
            return sum + throughput * there.radiosity;
        }
        reflectance = there.reflectance;
    }
    return sum;
}

// What of the light that arrives at a triangle leaves its other side, where its front reflects this
// much.
fn transmittance(t: TracedTriangle, reflectance: vec3f) -> vec3f {
    let row = t.flags >> ROW_OF_FLAGS;
    if row == 0u {
        return vec3f(0.0);
    }
    // It follows the texture of the reflectance.
    let whole = lights[row].exitance;
    let relative = reflectance / max(whole, vec3f(1e-37));
    return lights[row - 1u].exitance * select(vec3f(1.0), relative, whole > vec3f(0.0));
}

fn normal_of(t: TracedTriangle) -> vec3f {
    return normalize(cross(t.edge_u / t.extent, t.edge_v / t.extent));
}

// A point on a side of a triangle: the front is 1, the back -1.
fn on_triangle(t: TracedTriangle, u: f32, v: f32, side: f32) -> TracedPoint {
    let normal = side * normal_of(t);
    let along = t.edge_u * u + t.edge_v * v + normal * LIFT;
    let position = t.corner + along;
    let low = (along - (position - t.corner)) + t.corner_low;
    return TracedPoint(position, 0.25 * LIFT, low, 0.0, normal, 0.0, vec3f(0.0), 0u);
}

// Share of a sample of one of two densities in their sum: `factor` is the density of directions
// over that of points on a light which is always chosen, and `chance` that of its choice.
fn balance(factor: f32, chance: f32) -> f32 {
    let bounded = min(factor, 1e30);
    return bounded / max(bounded + chance, 1e-37);
}

// How much a light counts among those of a gather point.
fn weight_of(ranked: RankedLight) -> f32 {
    let exitance = lights[ranked.light].exitance;
    return ranked.factor * max(exitance.x, max(exitance.y, exitance.z));
}

fn weight_of_ranked(p: u32) -> f32 {
    var sum = 0.0;
    for (var k = 0u; k < states[p].light_count; k++) {
        sum += weight_of(states[p].lights[k]);
    }
    return sum;
}

// The probability that `choose_light` chooses a light.
fn chance_of(p: u32, light: u32) -> f32 {
    var by_power = lights[light].power_end;
    if light > 0u {
        by_power -= lights[light - 1u].power_end;
    }
    let all = weight_of_ranked(p);
    if all <= 0.0 {
        return by_power;
    }
    var by_rank = 0.0;
    for (var k = 0u; k < states[p].light_count; k++) {
        if states[p].lights[k].light == light {
            by_rank = weight_of(states[p].lights[k]) / all;
        }
    }
    return 0.5 * (by_power + by_rank);
}

// A light: half of the time one of the gather point's, in proportion to what it may bring there,
// otherwise any, in proportion to its power.
fn choose_light(p: u32, at: f32) -> u32 {
    let all = weight_of_ranked(p);
    var remaining = at;
    if all > 0.0 {
        if at < 0.5 {
            var weight = 2.0 * at * all;
            for (var k = 0u; k < states[p].light_count; k++) {
                weight -= weight_of(states[p].lights[k]);
                if weight < 0.0 || k + 1u == states[p].light_count {
                    return states[p].lights[k].light;
                }
            }
        }
        remaining = 2.0 * at - 1.0;
    }
    // The first light that ends beyond it.
    var low = 0u;
    var high = scene.lights - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if lights[middle].power_end <= remaining {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// Irradiance at a vertex from one point of a light, with the share that the balance leaves to it.
fn irradiance_of_lights(p: u32, at: TracedPoint) -> vec3f {
    if scene.lights == 0u {
        return vec3f(0.0);
    }
    let number = choose_light(p, random());
    let across = random();
    let along = random();
    let light = lights[number];
    let to = to_light(light, at, vec2f(across, along));
    // Anything hides it, other parts of the light too: a path meets the first of them only.
    if to.factor <= 0.0 || !to.is_solid || is_hidden(to.ray, to.distance, ANY_LIGHT) {
        return vec3f(0.0);
    }
    let share = balance(to.factor, chance_of(p, number));
    return passed(to.ray, to.distance) * light.exitance * share;
}

// Irradiance at a vertex from one point of the sun. No path meets the sun by itself.
fn irradiance_of_sun(at: TracedPoint) -> vec3f {
    let across = random();
    let along = random();
    let direction = towards_sun(vec2f(across, along));
    let cosine = dot(at.normal, direction);
    let ray = Ray(at.position, at.position_low, direction, at.near);
    if cosine <= 0.0 || is_hidden(ray, FAR, ANY_LIGHT) {
        return vec3f(0.0);
    }
    return passed(ray, FAR) * scene.sun * cosine;
}
