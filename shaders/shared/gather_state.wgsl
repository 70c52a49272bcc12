// The state of each point of a gather between passes. Needs shared/lights.wgsl before it.
//
// rank_lights ─► hemisphere_rays, near_paths, light_rays ─► settle ─► those again, of points that
//                                                                     need more

const RAYS_PER_SHADOW_RAY: u32 = 4u;

// Sums over rays.
struct RaySums {
    light: vec3f,         // from the sky and surfaces, without near ones and lights sampled apart
    escaped: f32,
    lamps: vec3f,         // exitance of the other lights
    back: f32,
    inverse_distance: f32,
    largest: f32,         // largest contribution of one ray to `light`: length over channels
    near: f32,            // number of rays that meet near surfaces
    near_largest: f32,    // the same as `largest` of `near_light`
    near_light: vec3f,    // from near surfaces by the field; it counts where paths do not find it
    padding: f32,
}

// Sums of form factors of points on a light, or of rays towards it: the visible ones, and all.
struct Visible {
    seen: vec3f,
    all: f32,
}

struct RankedLight {
    light: u32,
    factor: f32,          // unoccluded form factor to all of it
    is_wide: u32,         // whether rays over the hemisphere estimate its visible share
    padding: u32,
}

const SUN: u32 = MAX_EXPLICIT_LIGHTS; // its index in `visible`

struct PointState {
    rays: array<RaySums, 2>,          // the first half, or all earlier rays; the second half
    lights: array<RankedLight, MAX_EXPLICIT_LIGHTS>,
    visible: array<Visible, 18>,      // by light and sun, for the first half; for the second
    light_count: u32,
    ray_count: u32,       // rays over the hemisphere
    shadow_count: u32,    // to each light
    pending: u32,         // 1: rays were doubled; 2: rays to lights were doubled
    ray_error: f32,
    shadow_error: f32,
    covered: u32,         // whether paths found the light of near surfaces for earlier rays
    padding: u32,
}

struct GatherSettings {
    min_rays: u32,
    max_rays: u32,
    noise: f32,           // allowed, as a share of the irradiance
    dim: f32,             // irradiance below which `noise` is a share of this
    points: u32,
    first: u32,           // number of rays of a half cast by preceding passes
    pass_rays: u32,       // number of rays cast by one pass
    near_field: u32,      // whether paths find the light of near surfaces
}

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
