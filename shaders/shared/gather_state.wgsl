// The state of each point of a gather between passes. Needs shared/lights.wgsl before it.
//
// rank_lights ─► hemisphere_rays, near_paths, light_rays ─► settle ─► those again, of points that
//                                                                     need more

struct Work {
    // Numbers of workgroups of the next passes: points whose rays are doubled, and points whose
    // shadow rays are.
    ray_groups: array<atomic<u32>, 3>,
    shadow_groups: array<atomic<u32>, 3>,
    padding: array<u32, 2>,
    points: array<u32>,   // points of the former; of the latter from GatherSettings::points on
}

@group(1) @binding(0) var<storage, read> points: array<TracedPoint>;
@group(1) @binding(1) var<storage, read_write> states: array<PointState>;
@group(1) @binding(3) var<uniform> settings: GatherSettings;

var<workgroup> sums: array<vec4f, LANES>;

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

var<workgroup> of_first: vec4u;

// The value of the first lane, which all lanes have too. WGSL takes control flow for uniform only
// where it does not depend on buffers that are written: barriers need that.
fn uniform_of(lane: u32, value: vec4u) -> vec4u {
    if lane == 0u {
        of_first = value;
    }
    return workgroupUniformLoad(&of_first);
}

// The lights of a point that its rays over the hemisphere find by themselves, a bit each.
fn wide_lights(p: u32) -> u32 {
    var wide = 0u;
    for (var k = 0u; k < states[p].light_count; k++) {
        wide |= states[p].lights[k].is_wide << k;
    }
    return wide;
}

// The sum over all lanes, in an order that does not depend on the device.
fn added_up(lane: u32, value: vec4f) -> vec4f {
    workgroupBarrier();
    sums[lane] = value;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if lane < step {
            sums[lane] += sums[lane + step];
        }
    }
    workgroupBarrier();
    return sums[0];
}

// The maximum over all lanes.
fn largest_of(lane: u32, value: f32) -> f32 {
    workgroupBarrier();
    sums[lane].x = value;
    for (var step = LANES / 2u; step > 0u; step /= 2u) {
        workgroupBarrier();
        if lane < step {
            sums[lane].x = max(sums[lane].x, sums[lane + step].x);
        }
    }
    workgroupBarrier();
    return sums[0].x;
}
