// Cosine-distributed rays from patches, and the number that hits each element: a lane per ray, a
// line of workgroups per patch. Needs shared/trace.wgsl, shared/lights.wgsl, shared/lattice.wgsl
// and shared/element.wgsl before it.
//
// Slots of a row: open, back, then the elements. With panes three more rows of a patch add up their
// transmittances, per channel in units of 1/RowSettings::unit.

@group(1) @binding(0) var<storage, read> patches: array<TracedPatch>;
@group(1) @binding(1) var<storage, read_write> counts: array<atomic<u32>>;
@group(1) @binding(2) var directions: texture_2d<f32>;
@group(1) @binding(3) var<uniform> settings: RowSettings;

@compute @workgroup_size(64)
fn row_rays(@builtin(global_invocation_id) id: vec3u) {
    let k = id.x;
    if k >= settings.rays {
        return;
    }
    let patch_ = patches[id.y];
    let local = textureLoad(directions, vec2u(k % TEXELS_PER_LINE, k / TEXELS_PER_LINE), 0).xyz;
    let direction = turned(local, patch_.normal, patch_.rotation);
    let ray = Ray(patch_.position, patch_.position_low, direction, patch_.near);
    let hit = nearest_but(ray, patch_.own_triangle);
    var slot = OPEN;
    if hit.triangle != NOTHING {
        slot = BACK;
        if hit.front {
            let at = element_at(triangles[hit.triangle].index, vec2f(hit.u, hit.v));
            slot = FIRST_FRONT + at.element;
        }
    }
    if scene.panes == NOTHING {
        atomicAdd(&counts[id.y * settings.slots + slot], 1u);
        return;
    }
    let share = passed(ray, select(FAR, hit.distance, hit.triangle != NOTHING));
    let first = 4u * id.y * settings.slots + slot;
    atomicAdd(&counts[first], 1u);
    for (var channel = 0u; channel < 3u; channel++) {
        let amount = u32(share[channel] * settings.unit + 0.5);
        atomicAdd(&counts[first + (channel + 1u) * settings.slots], amount);
    }
}
