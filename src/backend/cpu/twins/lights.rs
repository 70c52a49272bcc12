//! Twin of `shaders/shared/lights.wgsl`: points on lights, and the transmittance of clear panes.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::trace::{Ray, intersect, is_solid, walk};
use crate::backend::gpu::layout::{HAS_HOLES, NOTHING, TracedLight, TracedPoint};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::sampling::low_discrepancy::sobol_02_point;

/// Transmittance of clear panes between the ray's near distance and `end`.
pub fn passed(scene: &TracedArrays, ray: &Ray, end: f32) -> Vec3 {
    let mut share = Vec3::ONE;
    if scene.info.panes == NOTHING {
        return share;
    }
    walk(scene, scene.info.panes, ray, end, |k| {
        let hit = intersect(scene, k, ray, end, 0.0);
        if hit.triangle != NOTHING && hit.distance + hit.off < end {
            let row = scene.triangles[k as usize].light as usize;
            share *= Vec3::from(scene.lights[row].exitance);
        }
        Some(end)
    });
    share
}

/// A ray from a point.
pub fn ray_from(point: &TracedPoint, direction: Vec3) -> Ray {
    let (origin, origin_low) = (point.position.into(), point.position_low.into());
    Ray { origin, origin_low, direction, near: point.near }
}

/// Point `k` of Sobol's (0,2)-sequence, in [0, 1]².
pub fn sobol(k: u32) -> Vec2 {
    Vec2::from_array(sobol_02_point(k).map(|x| x as f32))
}

/// The same for sample `k` of a point, with both coordinates rotated.
pub fn rotated_sobol(k: u32, point: &TracedPoint) -> Vec2 {
    let at = sobol(k) + Vec2::new(point.second_rotation, point.rotation);
    at - at.floor()
}

/// A ray from a point to a point on a light.
#[derive(Clone, Copy, Debug)]
pub struct ToLight {
    pub ray: Ray,
    pub distance: f32,
    /// The form factor of all of the light, estimated from this point; 0 where its own plane or the
    /// horizon hides it.
    pub factor: f32,
    pub is_solid: bool,
}

/// The ray to the point `at` of the unit square on a light: uniform over its area.
pub fn to_light(
    scene: &TracedArrays,
    light: &TracedLight,
    point: &TracedPoint,
    at: Vec2,
) -> ToLight {
    // The first triangle that ends beyond the point; the last, if rounding leaves none.
    let (first, last) = (light.first as usize, (light.first + light.count - 1) as usize);
    let low = (first..last).find(|&k| scene.lamps[k].end > at.x).unwrap_or(last);
    let start = if low > first { scene.lamps[low - 1].end } else { 0.0 };
    let across = ((at.x - start) / (scene.lamps[low].end - start)).clamp(0.0, 1.0);
    let t = &scene.triangles[scene.lamps[low].triangle as usize];
    let root = across.sqrt();
    let u = root * (1.0 - at.y);
    let v = root * at.y;
    let [edge_u, edge_v, normal] = [t.edge_u, t.edge_v, point.normal].map(Vec3::from);
    let to = from_point(point, t.corner, t.corner_low) + edge_u * u + edge_v * v;
    let facing = (-edge_u.cross(edge_v).normalize().dot(to)).max(0.0);
    let above = normal.dot(to).max(0.0);
    let square = to.dot(to);
    let distance = square.sqrt();
    let factor = match facing > 0.0 && above > 0.0 && square > 0.0 {
        true => light.area * facing * above / (PI * square * square),
        false => 0.0,
    };
    ToLight {
        ray: ray_from(point, to / distance),
        distance,
        factor,
        is_solid: t.flags & HAS_HOLES == 0 || is_solid(scene, t.index, u, v),
    }
}

/// Vector from a point to a corner, both in two parts.
pub fn from_point(point: &TracedPoint, corner: [f32; 3], corner_low: [f32; 3]) -> Vec3 {
    (Vec3::from(corner) - Vec3::from(point.position))
        + (Vec3::from(corner_low) - Vec3::from(point.position_low))
}
