//! Twin of `shaders/hemisphere_rays.wgsl`: cosine-distributed rays from points.

use glam::Vec3;

use super::field::field_at;
use super::gather_state::HalfSums;
use super::lights::{passed, ray_from};
use super::near_field::is_near;
use super::ray_arrays::RayArrays;
use super::shift::Shift;
use super::sky::from_sky;
use super::trace::{Hit, Ray, intersect, nearest};
use crate::backend::gpu::layout::{
    FAR, NOTHING, PointState, RaySums, TracedLight, TracedPoint, Visible,
};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::gather::lights::NO_LIGHT;

/// What ray `k` from a point adds.
pub fn ray(
    arrays: &RayArrays,
    point: &TracedPoint,
    state: &PointState,
    k: u32,
    shift: Shift,
) -> HalfSums {
    let scene = arrays.scene;
    let direction = shift.direction(arrays.direction(k, point.normal, point.rotation));
    let ray = ray_from(&shift.point(*point), direction);
    let hit = nearest(scene, &ray);
    let is_surface = hit.triangle != NOTHING;
    let share = passed(scene, &ray, if is_surface { hit.distance } else { FAR });
    let mut of_light = NO_LIGHT;
    if is_surface && hit.front {
        of_light = scene.triangles[hit.triangle as usize].light;
    }
    let mut sums = HalfSums::default();
    let mut is_known = false;
    for (ranked, visible) in state.ranked().iter().zip(&mut sums.visible) {
        let is_hit = ranked.light == of_light;
        is_known |= is_hit;
        if ranked.is_wide != 0 {
            let light = &scene.lights[ranked.light as usize];
            let seen = if is_hit { share.to_array() } else { [0.0; 3] };
            *visible = Visible { seen, all: (is_hit || is_towards(scene, &ray, light)).into() };
        }
    }
    sums.rays = if is_surface {
        let of_lamp = (of_light != NO_LIGHT && !is_known).then_some(of_light);
        of_surface(arrays, &hit, share, of_lamp)
    } else {
        let light = from_sky(scene, direction) * share;
        let (light, largest) = (light.to_array(), light.length());
        RaySums { escaped: 1.0, light, largest, ..Default::default() }
    };
    sums
}

/// What a ray adds that hits a surface and has this transmittance; `of_lamp` is the light that the
/// surface belongs to if that is not sampled separately.
fn of_surface(arrays: &RayArrays, hit: &Hit, share: Vec3, of_lamp: Option<u32>) -> RaySums {
    let scene = arrays.scene;
    let sums = RaySums { inverse_distance: 1.0 / hit.distance, ..Default::default() };
    if !hit.front {
        return RaySums { back: 1.0, ..sums };
    }
    let exitance = of_lamp.map_or(Vec3::ZERO, |light| scene.lights[light as usize].exitance.into());
    let sums = RaySums { lamps: (exitance * share).to_array(), ..sums };
    let there = field_at(arrays, hit);
    let light = there.radiosity * share;
    let (light, largest) = (light.to_array(), light.length());
    match is_near(scene, hit, there.side) {
        true => RaySums { near: 1.0, near_light: light, near_largest: largest, ..sums },
        false => RaySums { light, largest, ..sums },
    }
}

/// Whether a light, occluded or not, lies along the ray.
fn is_towards(scene: &TracedArrays, ray: &Ray, light: &TracedLight) -> bool {
    let lamps = &scene.lamps[light.first as usize..(light.first + light.count) as usize];
    lamps.iter().any(|lamp| {
        let hit = intersect(scene, lamp.triangle, ray, FAR, 1.0);
        hit.triangle != NOTHING && hit.front
    })
}
