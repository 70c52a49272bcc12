// Ray–triangle intersection with a hierarchy of boxes, two per node, traversed depth first, the
// nearer box first. Coordinates are relative to the middle of the scene, in units of its size, in
// two parts each: see shared/corner.wgsl. Boxes are wider than their contents by more than
// rounding.

const TURN: f32 = 6.2831853;

@group(0) @binding(0) var<storage, read> nodes: array<TraceNode>;
@group(0) @binding(1) var<storage, read> triangles: array<TracedTriangle>;
@group(0) @binding(2) var<uniform> scene: TracedSceneInfo;
// Per triangle with holes three texels: texture coordinates, in texels of the mask, of its first
// and second corner; those of the third, and the mask's first word and width; its height, and
// whether it ends at its border instead of being repeated.
@group(0) @binding(3) var mask_coordinates: texture_2d<f32>;
@group(0) @binding(4) var masks: texture_2d<u32>;   // a bit per texel, 32 per word: 1 where solid

struct Ray {
    origin: vec3f,
    origin_low: vec3f,
    direction: vec3f,     // unit length
    near: f32,            // minimum distance of hits
}

struct Hit {
    distance: f32,
    u: f32,               // weights of the second and third corner
    v: f32,
    triangle: u32,        // its index in `triangles`, or NOTHING
    front: bool,
    off: f32,             // bound of the rounding error of the distance
}

var<private> stack: array<u32, STACK>;

// The hit of triangle k, at most as far as `end`; `slack` scales a margin for rounding, so that no
// ray passes through a side that two triangles share.
fn intersect(k: u32, ray: Ray, end: f32, slack: f32) -> Hit {
    let t = triangles[k];
    let s = (ray.origin - t.corner) + (ray.origin_low - t.corner_low);
    let p = cross(ray.direction, t.edge_v);
    let facing = dot(t.edge_u, p);
    let inverse = 1.0 / facing;
    let q = cross(s, t.edge_u);
    let u = dot(s, p) * inverse;
    let v = dot(ray.direction, q) * inverse;
    let distance = dot(t.edge_v, q) * inverse;
    let off = ROUNDING * (abs(s.x) + abs(s.y) + abs(s.z)) * t.extent * abs(inverse);
    let seam = -off * slack;
    // False for NaN, as for a ray in the triangle's plane.
    let is_hit = facing != 0.0 && u >= seam && v >= seam && u + v <= 1.0 - seam
        && distance - off * t.extent > ray.near && distance <= end
        && (facing > 0.0 || (t.flags & BACK_IS_COVERED) == 0u);
    var hit = Hit(distance, clamp(u, 0.0, 1.0), 0.0, NOTHING, facing > 0.0, off * t.extent);
    hit.v = clamp(v, 0.0, 1.0 - hit.u);
    if is_hit {
        if (t.flags & HAS_HOLES) == 0u || is_solid(t.index, hit.u, hit.v) {
            hit.triangle = k;
        }
    }
    return hit;
}

fn mask_texel(k: u32) -> vec4f {
    return textureLoad(mask_coordinates, vec2u(k % TEXELS_PER_LINE, k / TEXELS_PER_LINE), 0);
}

// Whether a triangle's mask is solid there.
fn is_solid(index: u32, u: f32, v: f32) -> bool {
    let a_b = mask_texel(3u * index);
    let c = mask_texel(3u * index + 1u);
    let size = vec2f(c.w, mask_texel(3u * index + 2u).x);
    let is_clamped = mask_texel(3u * index + 2u).y != 0.0;
    var at = a_b.xy * (1.0 - u - v) + a_b.zw * u + c.xy * v;
    if is_clamped {
        at = clamp(at, vec2f(0.0), size);
    } else {
        at -= floor(at / size) * size;
    }
    let cell = min(vec2u(at), vec2u(size) - 1u);
    let first = u32(c.z);
    let texel = cell.y * u32(size.x) + cell.x;
    let word = first + texel / 32u;
    let bits = textureLoad(masks, vec2u(word % TEXELS_PER_LINE, word / TEXELS_PER_LINE), 0).x;
    return ((bits >> (texel % 32u)) & 1u) != 0u;
}

// Inverse of a direction, with a lower bound on its components, so that it is finite.
fn inverse_of(direction: vec3f) -> vec3f {
    let smallest = select(vec3f(-1e-20), vec3f(1e-20), direction >= vec3f(0.0));
    return 1.0 / select(direction, smallest, abs(direction) < vec3f(1e-20));
}

// The child of node k to be entered next, the other one on the stack; NOTHING if none is hit.
fn enter(k: u32, ray: Ray, inverse: vec3f, end: f32, top: ptr<function, u32>) -> u32 {
    let n = nodes[k];
    let low_a = (n.low_a - ray.origin) * inverse;
    let high_a = (n.high_a - ray.origin) * inverse;
    let low_b = (n.low_b - ray.origin) * inverse;
    let high_b = (n.high_b - ray.origin) * inverse;
    let in_a = min(low_a, high_a);
    let out_a = max(low_a, high_a);
    let in_b = min(low_b, high_b);
    let out_b = max(low_b, high_b);
    let enter_a = max(max(in_a.x, in_a.y), max(in_a.z, 0.0));
    let enter_b = max(max(in_b.x, in_b.y), max(in_b.z, 0.0));
    let meets_a = enter_a <= min(min(out_a.x, out_a.y), min(out_a.z, end));
    let meets_b = enter_b <= min(min(out_b.x, out_b.y), min(out_b.z, end));
    if meets_a && meets_b {
        let b_first = enter_b < enter_a;
        stack[*top] = select(n.child_b, n.child_a, b_first);
        *top += 1u;
        return select(n.child_a, n.child_b, b_first);
    }
    return select(select(NOTHING, n.child_b, meets_b), n.child_a, meets_a);
}

// Converts a direction from two tangents and the normal, rotated about the latter: the tangents of
// Duff et al. 2017, "Building an orthonormal basis, revisited".
fn turned(local: vec3f, n: vec3f, turns: f32) -> vec3f {
    let sign = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let across = vec3f(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let along = vec3f(b, sign + n.y * n.y * a, -n.y);
    let sine = sin(TURN * turns);
    let cosine = cos(TURN * turns);
    let x = across * cosine + along * sine;
    let y = along * cosine - across * sine;
    return normalize(x * local.x + y * local.y + n * local.z);
}

// The nearest hit of the ray; ties are ordered by triangle number.
fn nearest(ray: Ray) -> Hit {
    return nearest_but(ray, NOTHING);
}

// The same without the scene's triangle `own`.
fn nearest_but(ray: Ray, own: u32) -> Hit {
    var best = Hit(FAR, 0.0, 0.0, NOTHING, false, 0.0);
    var best_index = NOTHING;
    let inverse = inverse_of(ray.direction);
    stack[0] = NOTHING;
    var top = 1u;
    var node = 0u;
    loop {
        if node == NOTHING {
            top -= 1u;
            node = stack[top];
            if node == NOTHING {
                break;
            }
        }
        if (node & LEAF) == 0u {
            node = enter(node, ray, inverse, best.distance, &top);
            continue;
        }
        let first = node & 0x1fffffffu;
        let last = first + ((node >> 29u) & 3u);
        for (var k = first; k <= last; k++) {
            let hit = intersect(k, ray, best.distance, 1.0);
            if hit.triangle != NOTHING {
                let index = triangles[k].index;
                if index != own && (hit.distance < best.distance || index < best_index) {
                    best = hit;
                    best_index = index;
                }
            }
        }
        node = NOTHING;
    }
    return best;
}

// Whether anything before `end` occludes it; fronts of the light `but` do not.
fn is_hidden(ray: Ray, end: f32, but: u32) -> bool {
    let inverse = inverse_of(ray.direction);
    stack[0] = NOTHING;
    var top = 1u;
    var node = 0u;
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
            let hit = intersect(k, ray, end, 1.0);
            if hit.triangle != NOTHING && hit.distance + hit.off < end
                && !(hit.front && triangles[k].light == but) {
                return true;
            }
        }
        node = NOTHING;
    }
    return false;
}
