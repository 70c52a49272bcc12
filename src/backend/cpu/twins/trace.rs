//! Twin of `shaders/shared/trace.wgsl`: ray–triangle intersection.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, Vec4, Vec4Swizzles};

use crate::backend::gpu::layout::{BACK_IS_COVERED, FAR, HAS_HOLES, LEAF, NOTHING, ROUNDING};
use crate::backend::gpu::traced_scene::TracedArrays;

#[derive(Clone, Copy, Debug)]
pub struct Ray {
    pub origin: Vec3,
    pub origin_low: Vec3,
    /// Unit length.
    pub direction: Vec3,
    /// Minimum distance of hits.
    pub near: f32,
}

#[derive(Clone, Copy, Debug)]
pub struct Hit {
    pub distance: f32,
    /// Weights of the second and third corner.
    pub u: f32,
    pub v: f32,
    /// Its index in the triangles, or [`NOTHING`].
    pub triangle: u32,
    pub front: bool,
    /// Bound of the rounding error of the distance.
    pub off: f32,
}

/// The hit of triangle `k`, no farther than `end`; `slack` scales a margin for rounding.
pub fn intersect(scene: &TracedArrays, k: u32, ray: &Ray, end: f32, slack: f32) -> Hit {
    let t = &scene.triangles[k as usize];
    let [corner, low, edge_u, edge_v] =
        [t.corner, t.corner_low, t.edge_u, t.edge_v].map(Vec3::from);
    let s = (ray.origin - corner) + (ray.origin_low - low);
    let p = ray.direction.cross(edge_v);
    let facing = edge_u.dot(p);
    let inverse = 1.0 / facing;
    let q = s.cross(edge_u);
    let u = s.dot(p) * inverse;
    let v = ray.direction.dot(q) * inverse;
    let distance = edge_v.dot(q) * inverse;
    let off = ROUNDING * (s.x.abs() + s.y.abs() + s.z.abs()) * t.extent * inverse.abs();
    let seam = -off * slack;
    let is_hit = facing != 0.0
        && u >= seam
        && v >= seam
        && u + v <= 1.0 - seam
        && distance - off * t.extent > ray.near
        && distance <= end
        && (facing > 0.0 || t.flags & BACK_IS_COVERED == 0);
    let u = u.clamp(0.0, 1.0);
    // Not `clamp`, which panics where the ray is in the triangle's plane and u is NaN.
    let v = v.max(0.0).min(1.0 - u);
    let is_there = is_hit && (t.flags & HAS_HOLES == 0 || is_solid(scene, t.index, u, v));
    let triangle = if is_there { k } else { NOTHING };
    Hit { distance, u, v, triangle, front: facing > 0.0, off: off * t.extent }
}

/// Whether a triangle's mask is solid there.
pub fn is_solid(scene: &TracedArrays, index: u32, u: f32, v: f32) -> bool {
    let [a_b, c, rest] =
        [0, 1, 2].map(|k| Vec4::from(scene.mask_coordinates[3 * index as usize + k]));
    let size = Vec2::new(c.w, rest.x);
    let is_clamped = rest.y != 0.0;
    let mut at = a_b.xy() * (1.0 - u - v) + a_b.zw() * u + c.xy() * v;
    if is_clamped {
        at = at.max(Vec2::ZERO).min(size);
    } else {
        at -= (at / size).floor() * size;
    }
    let cell = at.as_uvec2().min(size.as_uvec2() - 1);
    let first = c.z as u32;
    let texel = cell.y * size.x as u32 + cell.x;
    let bits = scene.masks[(first + texel / 32) as usize];
    bits >> (texel % 32) & 1 != 0
}

/// Inverse of a direction, with a lower bound on its components, so that it is finite.
fn inverse_of(direction: Vec3) -> Vec3 {
    let smallest =
        Vec3::select(direction.cmpge(Vec3::ZERO), Vec3::splat(1e-20), Vec3::splat(-1e-20));
    1.0 / Vec3::select(direction.abs().cmplt(Vec3::splat(1e-20)), smallest, direction)
}

/// The child of node `k` to be entered next, the other one on the stack; `None` if none is hit.
fn enter(
    scene: &TracedArrays,
    k: u32,
    ray: &Ray,
    inverse: Vec3,
    end: f32,
    stack: &mut Vec<u32>,
) -> Option<u32> {
    let n = &scene.nodes[k as usize];
    let reach = |low: [f32; 3], high: [f32; 3]| {
        let low = (Vec3::from(low) - ray.origin) * inverse;
        let high = (Vec3::from(high) - ray.origin) * inverse;
        let (enters, leaves) = (low.min(high), low.max(high));
        (enters.max_element().max(0.0), leaves.min_element().min(end))
    };
    let (enter_a, leave_a) = reach(n.low_a, n.high_a);
    let (enter_b, leave_b) = reach(n.low_b, n.high_b);
    match (enter_a <= leave_a, enter_b <= leave_b) {
        (true, true) if enter_b < enter_a => {
            stack.push(n.child_a);
            Some(n.child_b)
        }
        (true, true) => {
            stack.push(n.child_b);
            Some(n.child_a)
        }
        (true, false) => Some(n.child_a),
        (false, true) => Some(n.child_b),
        (false, false) => None,
    }
}

/// Visits depth first the triangles of the leaves below `root` that the ray enters before its end;
/// each visit returns the new end, or `None` to stop.
pub fn walk(
    scene: &TracedArrays,
    root: u32,
    ray: &Ray,
    mut end: f32,
    mut visit: impl FnMut(u32) -> Option<f32>,
) {
    let inverse = inverse_of(ray.direction);
    let mut stack = vec![];
    let mut next = Some(root);
    while let Some(node) = next {
        if node & LEAF == 0 {
            next = enter(scene, node, ray, inverse, end, &mut stack).or_else(|| stack.pop());
            continue;
        }
        let first = node & 0x1fff_ffff;
        for k in first..=first + (node >> 29 & 3) {
            let Some(new_end) = visit(k) else { return };
            end = new_end;
        }
        next = stack.pop();
    }
}

/// Converts a direction from two tangents and the normal, rotated about the latter: the tangents of
/// Duff et al. 2017, "Building an orthonormal basis, revisited".
pub fn turned(local: Vec3, n: Vec3, turns: f32) -> Vec3 {
    let (across, along) = n.any_orthonormal_pair();
    let (sine, cosine) = (TAU * turns).sin_cos();
    let x = across * cosine + along * sine;
    let y = along * cosine - across * sine;
    (x * local.x + y * local.y + n * local.z).normalize()
}

/// The nearest hit of the ray; ties are ordered by triangle number.
pub fn nearest(scene: &TracedArrays, ray: &Ray) -> Hit {
    nearest_but(scene, ray, NOTHING)
}

/// The same without the scene's triangle `own`.
pub fn nearest_but(scene: &TracedArrays, ray: &Ray, own: u32) -> Hit {
    let mut best = Hit { distance: FAR, u: 0.0, v: 0.0, triangle: NOTHING, front: false, off: 0.0 };
    let mut best_index = NOTHING;
    walk(scene, 0, ray, FAR, |k| {
        let hit = intersect(scene, k, ray, best.distance, 1.0);
        if hit.triangle != NOTHING {
            let index = scene.triangles[k as usize].index;
            if index != own && (hit.distance < best.distance || index < best_index) {
                best = hit;
                best_index = index;
            }
        }
        Some(best.distance)
    });
    best
}

/// Whether anything before `end` occludes it; fronts of the light `but` do not.
pub fn is_hidden(scene: &TracedArrays, ray: &Ray, end: f32, but: u32) -> bool {
    let mut hidden = false;
    walk(scene, 0, ray, end, |k| {
        let hit = intersect(scene, k, ray, end, 1.0);
        hidden = hit.triangle != NOTHING
            && hit.distance + hit.off < end
            && !(hit.front && scene.triangles[k as usize].light == but);
        (!hidden).then_some(end)
    });
    hidden
}
