//! Twin of `shaders/settle.wgsl`: evaluates the rays of a point, and decides whether it casts more.

use glam::{Vec2, Vec3};

use super::gather_state::{PointState, RaySums, SUN, Visible};
use super::near_field::is_covered;
use crate::backend::cpu::gather::RAYS_PER_SHADOW_RAY;
use crate::backend::gpu::layout::{GatherSettings, Sample, TracedPoint};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::scene::Sun;

/// Visibilities by light and sun.
type Visibilities = [Visible; SUN + 1];

/// The sample of a point, and values that only tests need, to judge how close decisions are.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    pub sample: Sample,
    pub ray_error: f32,
    pub shadow_error: f32,
    /// Allowed noise.
    pub allowed: f32,
}

/// The irradiance of the lights of one kind, by the visible part of each.
fn of_lights(
    scene: &TracedArrays,
    state: &PointState,
    seen: &Visibilities,
    is_wide: bool,
    points: f32,
) -> Vec3 {
    let of_kind = state.ranked().iter().zip(seen).filter(|(r, _)| (r.is_wide != 0) == is_wide);
    let mut irradiance = Vec3::ZERO;
    for (ranked, visible) in of_kind {
        let light = &scene.lights[ranked.light as usize];
        let share = match light.is_convex != 0 {
            true => ranked.factor / visible.all.max(1e-37),
            false => 1.0 / points.max(1.0),
        };
        irradiance += Vec3::from(light.exitance) * Vec3::from(visible.seen) * share;
    }
    irradiance
}

fn together(a: &Visibilities, b: &Visibilities) -> Visibilities {
    std::array::from_fn(|k| Visible {
        seen: (Vec3::from(a[k].seen) + Vec3::from(b[k].seen)).to_array(),
        all: a[k].all + b[k].all,
    })
}

fn of_sun(scene: &TracedArrays, normal: Vec3, sun: &Visible, points: f32) -> Vec3 {
    let info = &scene.info;
    if info.has_sun == 0 {
        return Vec3::ZERO;
    }
    let (irradiance, seen) = (Vec3::from(info.sun), Vec3::from(sun.seen));
    let cosine = normal.dot(info.sun_middle.into());
    match cosine >= Sun::SINE as f32 {
        true => irradiance * cosine * seen / sun.all.max(1e-37),
        false => irradiance * seen / points.max(1.0),
    }
}

/// Evaluates a point, unless it is finished. Its new `pending` selects what it casts next: nothing,
/// rays over the hemisphere, or rays to lights.
pub fn settle(
    scene: &TracedArrays,
    point: &TracedPoint,
    settings: &GatherSettings,
    state: &mut PointState,
) -> Option<Settled> {
    let pending = state.pending;
    if pending == 0 {
        return None;
    }
    let normal = Vec3::from(point.normal);
    let ray_count = state.ray_count * if pending == 1 { 2 } else { 1 };
    let shadow_count = state.shadow_count * if pending == 2 { 2 } else { 1 };
    let mut halves = state.rays;
    let seen = state.visible;
    let all_seen = together(&seen[0], &seen[1]);
    let (rays, shadow_rays) = (ray_count as f32, shadow_count as f32);
    let mut covered = state.covered;
    for half in &mut halves {
        if is_covered(half.near, 0.5 * rays) {
            covered = 1;
        } else {
            half.light = (Vec3::from(half.light) + Vec3::from(half.near_light)).to_array();
            half.largest = half.largest.max(half.near_largest);
        }
    }
    let vectors = |of: fn(&RaySums) -> [f32; 3]| halves.each_ref().map(|h| Vec3::from(of(h)));
    let (light, lamps) = (vectors(|h| h.light), vectors(|h| h.lamps));
    let ray_means = [0, 1].map(|h| {
        (light[h] + lamps[h]) / (0.5 * rays) + of_lights(scene, state, &seen[h], true, 0.0)
    });
    let shadow_means = [0, 1].map(|h| {
        of_lights(scene, state, &seen[h], false, 0.5 * shadow_rays)
            + of_sun(scene, normal, &seen[h][SUN], 0.5 * shadow_rays)
    });
    let (light, emitted) = (light[0] + light[1], lamps[0] + lamps[1]);
    let largest = halves[0].largest.max(halves[1].largest);
    let of_wide = of_lights(scene, state, &all_seen, true, 0.0);
    let of_shadows = of_lights(scene, state, &all_seen, false, shadow_rays)
        + of_sun(scene, normal, &all_seen[SUN], shadow_rays);
    let mut ray_error = state.ray_error;
    if pending & 1 != 0 {
        ray_error = ray_means[0].distance(ray_means[1]).max(largest / rays) / 2.0;
    }
    let mut shadow_error = state.shadow_error;
    if pending & 2 != 0 {
        shadow_error = shadow_means[0].distance(shadow_means[1]) / 2.0;
    }
    let direct = emitted / rays + of_wide + of_shadows + Vec3::from(point.luminaires);
    let irradiance = light / rays + direct;
    let sum = |of: fn(&RaySums) -> f32| of(&halves[0]) + of(&halves[1]);
    let [escaped, back, inverse_distance] =
        [sum(|h| h.escaped), sum(|h| h.back), sum(|h| h.inverse_distance)];
    let sample = Sample {
        irradiance: irradiance.to_array(),
        noise: Vec2::new(ray_error, shadow_error).length(),
        direct: direct.to_array(),
        escaped: escaped / rays,
        back: back / rays,
        inverse_distance: inverse_distance / rays,
        rays: ray_count,
        shadow_rays: shadow_count,
        covered,
        padding: [0; 3],
    };
    let allowed = settings.noise * irradiance.length().max(settings.dim);
    state.pending = 0;
    if sample.noise > allowed {
        let shadows_left = shadow_count < (settings.max_rays / RAYS_PER_SHADOW_RAY).max(2);
        let rays_left = ray_count < settings.max_rays;
        state.pending = match (shadow_error > ray_error, shadows_left, rays_left) {
            (true, true, _) | (false, true, false) => 2,
            (false, _, true) | (true, false, true) => 1,
            (_, false, false) => 0,
        };
    }
    if state.pending != 0 {
        state.ray_count = ray_count;
        state.shadow_count = shadow_count;
        state.ray_error = ray_error;
        state.shadow_error = shadow_error;
        state.covered = covered;
        state.rays = [
            RaySums {
                light: light.to_array(),
                escaped,
                lamps: emitted.to_array(),
                back,
                inverse_distance,
                largest,
                ..RaySums::default()
            },
            RaySums::default(),
        ];
        state.visible = [all_seen, Visibilities::default()];
    }
    Some(Settled { sample, ray_error, shadow_error, allowed })
}
