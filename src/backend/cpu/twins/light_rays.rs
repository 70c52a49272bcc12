//! Twin of `shaders/light_rays.wgsl`: rays from points to points on lights and on the sun.

use glam::Vec3;

use super::gather_state::{HalfSums, SUN};
use super::lights::{passed, ray_from, rotated_sobol, to_light};
use super::ray_arrays::RayArrays;
use super::shift::Shift;
use super::sky::towards_sun;
use super::trace::is_hidden;
use crate::backend::gpu::layout::{ANY_LIGHT, FAR, PointState, TracedPoint, Visible};
use crate::backend::gpu::traced_scene::TracedArrays;

/// What the rays `k` from a point to each light that is not wide, and to the sun, add.
pub fn ray(
    arrays: &RayArrays,
    point: &TracedPoint,
    state: &PointState,
    k: u32,
    shift: Shift,
) -> HalfSums {
    let mut sums = HalfSums::default();
    let lights = state.ranked().iter().zip(&mut sums.visible);
    for (ranked, visible) in lights.filter(|(ranked, _)| ranked.is_wide == 0) {
        *visible = of_light(arrays.scene, point, ranked.light, k, shift);
    }
    if arrays.scene.info.has_sun != 0 {
        sums.visible[SUN] = of_sun(arrays.scene, point, k, shift);
    }
    sums
}

/// Visible and total form factor of point `k` on a light.
fn of_light(
    scene: &TracedArrays,
    point: &TracedPoint,
    light: u32,
    k: u32,
    shift: Shift,
) -> Visible {
    let (at, point) = (shift.moved(rotated_sobol(k, point)), shift.point(*point));
    let to = to_light(scene, &scene.lights[light as usize], &point, at);
    if to.factor <= 0.0 {
        return Visible::default();
    }
    let is_seen = to.is_solid && !is_hidden(scene, &to.ray, to.distance, light);
    let seen = if is_seen { to.factor * passed(scene, &to.ray, to.distance) } else { Vec3::ZERO };
    Visible { seen: seen.to_array(), all: to.factor }
}

/// Visible and total cosine of point `k` on the sun.
fn of_sun(scene: &TracedArrays, point: &TracedPoint, k: u32, shift: Shift) -> Visible {
    let direction = shift.direction(towards_sun(scene, rotated_sobol(k, point)));
    let cosine = Vec3::from(point.normal).dot(direction);
    if cosine <= 0.0 {
        return Visible::default();
    }
    let ray = ray_from(&shift.point(*point), direction);
    let is_seen = !is_hidden(scene, &ray, FAR, ANY_LIGHT);
    let seen = if is_seen { cosine * passed(scene, &ray, FAR) } else { Vec3::ZERO };
    Visible { seen: seen.to_array(), all: cosine }
}
