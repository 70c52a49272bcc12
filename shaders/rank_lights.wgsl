// Selects the lights that are sampled separately from each point, by closed form: a workgroup per
// point. Needs shared/trace.wgsl, shared/lights.wgsl and shared/gather_state.wgsl before it.

var<workgroup> factors: array<f32, LANES>;
var<workgroup> ranked: array<RankedLight, MAX_EXPLICIT_LIGHTS>;
var<workgroup> ranked_irradiance: array<f32, MAX_EXPLICIT_LIGHTS>;
var<workgroup> count: u32;
var<workgroup> all_irradiance: f32;

// n · Γ of one side of a polygon seen from the origin: its angle times the cosine of its plane.
fn side(a: vec3f, b: vec3f, normal: vec3f) -> f32 {
    let across = cross(a, b - a);
    let sine = length(across);
    // Where the side is in line with the point its angle is 0 or a half turn.
    return atan2(sine, dot(a, b)) * dot(normal, across) / max(sine, 1e-37);
}

// The form factor from a point to a triangle that faces it: Lambert's formula for the part above
// the horizon (Baum, Rushmeier and Winget 1989, eq. 8). A triangle whose size is a small share s of
// its distance is represented by its middle, with an error of s²; the error of the formula is
// rounding over s, since its terms cancel: both are 3e-5 for s = 5e-3. Terms of a light that grazes
// the surface cancel too: the absolute error of the remainder is 1e-7.
fn to_triangle(t: TracedTriangle, point: TracedPoint) -> f32 {
    let a = (t.corner - point.position) + (t.corner_low - point.position_low);
    let area_normal = cross(t.edge_u, t.edge_v);
    if dot(area_normal, a) >= 0.0 {
        return 0.0;
    }
    let middle = a + (t.edge_u + t.edge_v) / 3.0;
    let square = dot(middle, middle);
    if t.extent * t.extent < 2.5e-5 * square {
        let cosines = -dot(area_normal, middle) * max(dot(point.normal, middle), 0.0);
        return 0.5 * cosines / (PI * square * square);
    }
    // Clipped at the horizon: at most four corners are left.
    var corners = array<vec3f, 3>(a, a + t.edge_u, a + t.edge_v);
    var cut: array<vec3f, 4>;
    var left = 0u;
    for (var k = 0u; k < 3u; k++) {
        let p = corners[k];
        let q = corners[(k + 1u) % 3u];
        let height = dot(point.normal, p);
        let next = dot(point.normal, q);
        if height >= 0.0 {
            cut[left] = p;
            left += 1u;
        }
        if (height >= 0.0) != (next >= 0.0) {
            cut[left] = p + (q - p) * (height / (height - next));
            left += 1u;
        }
    }
    var sum = 0.0;
    for (var k = 0u; k < left; k++) {
        sum += side(cut[k], cut[select(k + 1u, 0u, k + 1u == left)], point.normal);
    }
    // Fronts are clockwise as seen from the point.
    return max(-sum / (2.0 * PI), 0.0);
}

@compute @workgroup_size(64)
fn rank_lights(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let p = group.x;
    let point = points[p];
    if lane == 0u {
        count = 0u;
        all_irradiance = 0.0;
    }
    for (var base = 0u; base < scene.lights; base += LANES) {
        var factor = 0.0;
        if base + lane < scene.lights {
            let light = lights[base + lane];
            for (var k = 0u; k < light.count; k++) {
                factor += to_triangle(triangles[lamps[light.first + k].triangle], point);
            }
        }
        workgroupBarrier();
        factors[lane] = factor;
        workgroupBarrier();
        if lane == 0u {
            for (var k = 0u; k < min(LANES, scene.lights - base); k++) {
                insert(base + k, factors[k]);
            }
        }
    }
    if lane == 0u {
        while count > 0u && ranked_irradiance[count - 1u] <= MIN_IRRADIANCE_SHARE * all_irradiance {
            count -= 1u;
        }
    }
    let kept = workgroupUniformLoad(&count);
    for (var k = 0u; k < kept; k++) {
        let light = lights[ranked[k].light];
        var weight = 0.0;
        if lane < EVENNESS_POINTS {
            weight = to_light(light, point, sobol(lane)).factor;
        }
        // Points of weights w have the effective number (Σ w)² / Σ w² (Kish 1965, section 11.7).
        let sum = added_up(lane, vec4f(weight, weight * weight, 0.0, 0.0));
        if lane == 0u {
            let worth = sum.x * sum.x / max(sum.y * f32(EVENNESS_POINTS), 1e-37);
            let factor = ranked[k].factor;
            let has_rays = f32(settings.min_rays) * factor >= MIN_RAYS;
            let is_wide = has_rays && factor * f32(RAYS_PER_SHADOW_RAY) > worth;
            ranked[k].is_wide = u32(is_wide);
        }
    }
    if lane == 0u {
        write(p, kept);
    }
}

// Inserts a light into the list of the brightest; ties are ordered by number.
fn insert(light: u32, factor: f32) {
    let exitance = lights[light].exitance;
    let irradiance = factor * max(exitance.x, max(exitance.y, exitance.z));
    all_irradiance += irradiance;
    if irradiance <= 0.0 {
        return;
    }
    var at = count;
    if count == MAX_EXPLICIT_LIGHTS {
        if irradiance <= ranked_irradiance[count - 1u] {
            return;
        }
        at -= 1u;
    } else {
        count += 1u;
    }
    while at > 0u && ranked_irradiance[at - 1u] < irradiance {
        ranked[at] = ranked[at - 1u];
        ranked_irradiance[at] = ranked_irradiance[at - 1u];
        at -= 1u;
    }
    ranked[at] = RankedLight(light, factor, 0u, 0u);
    ranked_irradiance[at] = irradiance;
}

// Writes the state of a point before the first ray. A wide light without a closed form is treated
// like any surface.
fn write(p: u32, kept: u32) {
    var left = 0u;
    for (var k = 0u; k < kept; k++) {
        if ranked[k].is_wide == 0u || lights[ranked[k].light].is_convex != 0u {
            states[p].lights[left] = ranked[k];
            left += 1u;
        }
    }
    states[p].light_count = left;
    states[p].rays = array<RaySums, 2>();
    states[p].visible = array<array<Visible, 9>, 2>();
    states[p].ray_count = settings.min_rays;
    states[p].shadow_count = max(settings.min_rays / RAYS_PER_SHADOW_RAY, 2u);
    states[p].pending = 3u;
    states[p].ray_error = 0.0;
    states[p].shadow_error = 0.0;
    states[p].covered = 0u;
}
