// Lights, and the transmittance of clear panes. Needs shared/trace.wgsl before it.

const PI: f32 = 3.14159265;

@group(0) @binding(5) var<storage, read> lights: array<TracedLight>;
@group(0) @binding(6) var<storage, read> lamps: array<Lamp>;

// Transmittance of clear panes between the ray's near distance and `end`. A ray along the side that
// two triangles of a pane share may count both or neither: one in some 10⁶ rays.
fn passed(ray: Ray, end: f32) -> vec3f {
    var share = vec3f(1.0);
    if scene.panes == NOTHING {
        return share;
    }
    let inverse = inverse_of(ray.direction);
    stack[0] = NOTHING;
    var top = 1u;
    var node = scene.panes;
    loop {
        if node == NOTHING {
            top -= 1u;
            node = stack[top];
            if node == NOTHING {
                break;
            }
        }
        if (node & LEAF) == 0u {
            node = enter(node, ray, inverse, end, &top);
            continue;
        }
        let first = node & 0x1fffffffu;
        let last = first + ((node >> 29u) & 3u);
        for (var k = first; k <= last; k++) {
            let hit = intersect(k, ray, end, 0.0);
            if hit.triangle != NOTHING && hit.distance + hit.off < end {
                share *= lights[triangles[k].light].exitance;
            }
        }
        node = NOTHING;
    }
    return share;
}

// Point k of Sobol's (0,2)-sequence, in (0, 1)².
fn sobol(k: u32) -> vec2f {
    var remaining = k;
    var column = 0x80000000u;
    var bits = 0u;
    while remaining != 0u {
        if (remaining & 1u) != 0u {
            bits ^= column;
        }
        remaining >>= 1u;
        column ^= column >> 1u;
    }
    // A float has 24 bits; the offset to the middle of the cell is half of the last.
    return (vec2f(vec2u(reverseBits(k), bits) >> vec2u(8u)) + 0.5) * 5.9604645e-8;
}

// The same for sample k of a point, with both coordinates rotated.
fn rotated_sobol(k: u32, point: TracedPoint) -> vec2f {
    return fract(sobol(k) + vec2f(point.second_rotation, point.rotation));
}

// A ray from a point to a point on a light.
struct ToLight {
    ray: Ray,
    distance: f32,
    factor: f32,          // of all of the light, estimated from this point; 0 where its
                          // own plane or the horizon hides it
    is_solid: bool,
}

// The ray to the point `at` of the unit square on a light: uniform over its area.
fn to_light(light: TracedLight, point: TracedPoint, at: vec2f) -> ToLight {
    // The first triangle that ends beyond the point.
    var low = light.first;
    var high = light.first + light.count - 1u;
    while low < high {
        let middle = (low + high) / 2u;
        if lamps[middle].end <= at.x {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    var start = 0.0;
    if low > light.first {
        start = lamps[low - 1u].end;
    }
    let across = clamp((at.x - start) / (lamps[low].end - start), 0.0, 1.0);
    let t = triangles[lamps[low].triangle];
    let root = sqrt(across);
    let u = root * (1.0 - at.y);
    let v = root * at.y;
    // a (1 − √x) + (b (1 − y) + c y) √x (Pharr, Jakob, Humphreys 2016, 13.6.5).
    let to = (t.corner - point.position) + (t.corner_low - point.position_low)
        + t.edge_u * u + t.edge_v * v;
    let facing = max(-dot(normalize(cross(t.edge_u, t.edge_v)), to), 0.0);
    let above = max(dot(point.normal, to), 0.0);
    let square = dot(to, to);
    let factor = light.area * facing * above / (PI * square * square);
    let distance = sqrt(square);
    var out: ToLight;
    out.ray = Ray(point.position, point.position_low, to / distance, point.near);
    out.distance = distance;
    out.factor = select(0.0, factor, facing > 0.0 && above > 0.0 && square > 0.0);
    out.is_solid = (t.flags & HAS_HOLES) == 0u || is_solid(t.index, u, v);
    return out;
}
