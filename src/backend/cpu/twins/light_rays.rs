//! Twin of `shaders/light_rays.wgsl`: rays from points to points on lights and on the sun.

use glam::{Vec2, Vec3, Vec4};

use super::gather_state::{PointState, SUN, added_up};
use super::hemisphere_rays::range;
use super::lights::{passed, ray_from, rotated_sobol, to_light};
use super::sky::towards_sun;
use super::trace::is_hidden;
use crate::backend::gpu::layout::{ANY_LIGHT, FAR, GatherSettings, LANES, TracedPoint};
use crate::backend::gpu::traced_scene::TracedArrays;

/// The rays of one pass from a point.
pub fn cast_rays(
    scene: &TracedArrays,
    point: &TracedPoint,
    settings: &GatherSettings,
    state: &mut PointState,
) {
    for source in sources(scene, state) {
        let [from, middle, to] = range(state.shadow_count, state, settings);
        let mut lanes = [[Vec4::ZERO; LANES as usize]; 2];
        for i in from..to {
            let visible = cast_ray(scene, point, state, source, rotated_sobol(i, point));
            lanes[usize::from(i >= middle)][((i - from) % LANES) as usize] += visible;
        }
        for (half, lanes) in lanes.into_iter().enumerate() {
            let sum = added_up(lanes);
            let out = &mut state.visible[half][source];
            out.seen = (Vec3::from(out.seen) + sum.truncate()).to_array();
            out.all += sum.w;
        }
    }
}

/// Indices in `visible` of the lights and the sun that rays are cast to.
pub fn sources(scene: &TracedArrays, state: &PointState) -> Vec<usize> {
    let lights = state.ranked().iter().enumerate().filter(|(_, ranked)| ranked.is_wide == 0);
    let sun = (scene.info.has_sun != 0).then_some(SUN);
    lights.map(|(k, _)| k).chain(sun).collect()
}

/// Visible and total form factor of one point on a light or the sun, given in the unit square.
pub fn cast_ray(
    scene: &TracedArrays,
    point: &TracedPoint,
    state: &PointState,
    source: usize,
    at: Vec2,
) -> Vec4 {
    if source == SUN {
        return to_sun(scene, point, towards_sun(scene, at));
    }
    let number = state.lights[source].light;
    let to = to_light(scene, &scene.lights[number as usize], point, at);
    if to.factor <= 0.0 {
        return Vec4::ZERO;
    }
    let is_seen = to.is_solid && !is_hidden(scene, &to.ray, to.distance, number);
    let seen = if is_seen { to.factor * passed(scene, &to.ray, to.distance) } else { Vec3::ZERO };
    seen.extend(to.factor)
}

/// Visible and total cosine of the sun in a direction.
pub fn to_sun(scene: &TracedArrays, point: &TracedPoint, direction: Vec3) -> Vec4 {
    let cosine = Vec3::from(point.normal).dot(direction);
    if cosine <= 0.0 {
        return Vec4::ZERO;
    }
    let ray = ray_from(point, direction);
    let is_seen = !is_hidden(scene, &ray, FAR, ANY_LIGHT);
    let seen = if is_seen { cosine * passed(scene, &ray, FAR) } else { Vec3::ZERO };
    seen.extend(cosine)
}
