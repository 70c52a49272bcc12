// What a gather knows of each of its points between passes. Needs shared/lights.wgsl before it.
//
// rank_lights ─► hemisphere_rays, light_rays ─► settle ─► those again, of points that need more

const LANES: u32 = 64u;               // a workgroup, of one point
const RAYS_PER_SHADOW_RAY: u32 = 4u;

// Sums over rays.
struct RaySums {
    light: vec3f,         // what surfaces reflect and the sky sends, but for lights sampled apart
    escaped: f32,
    lamps: vec3f,         // exitance of the other lights
    back: f32,
    inverse_distance: f32,
    largest: f32,         // the largest of `light` by one ray: a length over the channels
    padding: vec2f,
}

// Of places on a light, or of rays towards it: form factors of those that are seen, and of all.
struct Visible {
    seen: vec3f,
    all: f32,
}

struct RankedLight {
    light: u32,
    factor: f32,          // form factor to all of it as if nothing were in between
    is_wide: u32,         // rays over the hemisphere tell how much of it is seen
    padding: u32,
}

const SUN: u32 = MAX_EXPLICIT_LIGHTS; // its place in `visible`

struct PointState {
    rays: array<RaySums, 2>,          // the first half, or what was before; the second half
    lights: array<RankedLight, MAX_EXPLICIT_LIGHTS>,
    visible: array<Visible, 18>,      // by light and sun, of the first half; of the second
    light_count: u32,
    ray_count: u32,       // rays over the hemisphere
    shadow_count: u32,    // to each light
    pending: u32,         // 1: rays were doubled; 2: rays to lights were
    ray_error: f32,
    shadow_error: f32,
    padding: array<u32, 2>,
}

struct GatherSettings {
    min_rays: u32,
    max_rays: u32,
    noise: f32,           // allowed, as a share of the irradiance
    dim: f32,             // or of this, where the irradiance is less
    points: u32,
    first: u32,           // rays of a half that passes before this have cast
    pass_rays: u32,       // those that one casts
    padding: u32,
}

struct Work {
    // Workgroups of the next passes: of points whose rays are doubled, of those whose shadow rays
    // are.
    ray_groups: array<atomic<u32>, 3>,
    shadow_groups: array<atomic<u32>, 3>,
    padding: array<u32, 2>,
    points: array<u32>,   // the former's points, then from GatherSettings::points on the latter's
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

// The largest of all lanes.
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
