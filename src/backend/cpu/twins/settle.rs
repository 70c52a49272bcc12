//! Twin of `shaders/settle.wgsl`: evaluates the rays of a point, and decides whether it casts more.

use glam::{Vec2, Vec3};

use super::gather_state::{HalfSums, SUN};
use super::near_field::is_covered;
use crate::backend::cpu::gather::RAYS_PER_SHADOW_RAY;
use crate::backend::gpu::layout::{
    GatherSettings, PointState, RaySums, Sample, TracedPoint, Visible,
};
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

/// Lights and the sun at a point, by what is visible of them.
struct Direct<'a> {
    scene: &'a TracedArrays,
    state: &'a PointState,
    normal: Vec3,
}

impl Direct<'_> {
    /// The irradiance of the lights of one kind, by the visible part of each.
    fn of_lights(&self, seen: &Visibilities, is_wide: bool, points: f32) -> Vec3 {
        let lights = self.state.ranked().iter().zip(seen);
        let mut irradiance = Vec3::ZERO;
        for (ranked, visible) in lights.filter(|(r, _)| (r.is_wide != 0) == is_wide) {
            let light = &self.scene.lights[ranked.light as usize];
            let share = match light.is_convex != 0 {
                true => ranked.factor / visible.all.max(1e-37),
                false => 1.0 / points.max(1.0),
            };
            irradiance += Vec3::from(light.exitance) * Vec3::from(visible.seen) * share;
        }
        irradiance
    }

    fn of_sun(&self, sun: &Visible, points: f32) -> Vec3 {
        let info = &self.scene.info;
        if info.has_sun == 0 {
            return Vec3::ZERO;
        }
        let (irradiance, seen) = (Vec3::from(info.sun), Vec3::from(sun.seen));
        let cosine = self.normal.dot(info.sun_middle.into());
        match cosine >= Sun::SINE as f32 {
            true => irradiance * cosine * seen / sun.all.max(1e-37),
            false => irradiance * seen / points.max(1.0),
        }
    }

    /// The irradiance by this number of rays to each light and to the sun.
    fn by_shadow_rays(&self, seen: &Visibilities, rays: f32) -> Vec3 {
        self.of_lights(seen, false, rays) + self.of_sun(&seen[SUN], rays)
    }

    /// The irradiance by `rays` rays over the hemisphere.
    fn by_rays(&self, sums: &HalfSums, rays: f32) -> Vec3 {
        let RaySums { light, lamps, .. } = sums.rays;
        (Vec3::from(light) + Vec3::from(lamps)) / rays + self.of_lights(&sums.visible, true, 0.0)
    }

    /// Errors by rays over the hemisphere and by rays to lights, from two halves of each number;
    /// those that were not cast now keep theirs.
    fn errors(&self, halves: &[HalfSums; 2], rays: f32, shadow_rays: f32) -> [f32; 2] {
        let PointState { pending, ray_error, shadow_error, .. } = *self.state;
        let [a, b] = halves.each_ref().map(|half| self.by_rays(half, 0.5 * rays));
        let [c, d] = halves.each_ref().map(|h| self.by_shadow_rays(&h.visible, 0.5 * shadow_rays));
        let largest = halves[0].rays.largest.max(halves[1].rays.largest);
        let of_rays = a.distance(b).max(largest / rays) / 2.0;
        [
            if pending & 1 != 0 { of_rays } else { ray_error },
            if pending & 2 != 0 { c.distance(d) / 2.0 } else { shadow_error },
        ]
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
    if state.pending == 0 {
        return None;
    }
    let ray_count = state.ray_count * if state.pending == 1 { 2 } else { 1 };
    let shadow_count = state.shadow_count * if state.pending == 2 { 2 } else { 1 };
    let (rays, shadow_rays) = (ray_count as f32, shadow_count as f32);
    let (halves, is_covered) = with_near_light(state, 0.5 * rays);
    let mut all = halves[0];
    all.add(halves[1]);
    let direct = Direct { scene, state, normal: point.normal.into() };
    let [ray_error, shadow_error] = direct.errors(&halves, rays, shadow_rays);
    let direct = Vec3::from(all.rays.lamps) / rays
        + direct.of_lights(&all.visible, true, 0.0)
        + direct.by_shadow_rays(&all.visible, shadow_rays)
        + Vec3::from(point.luminaires);
    let irradiance = Vec3::from(all.rays.light) / rays + direct;
    let sample = Sample {
        irradiance: irradiance.to_array(),
        noise: Vec2::new(ray_error, shadow_error).length(),
        direct: direct.to_array(),
        escaped: all.rays.escaped / rays,
        back: all.rays.back / rays,
        inverse_distance: all.rays.inverse_distance / rays,
        rays: ray_count,
        shadow_rays: shadow_count,
        covered: state.covered | u32::from(is_covered),
        ..Default::default()
    };
    let allowed = settings.noise * irradiance.length().max(settings.dim);
    let settled = Settled { sample, ray_error, shadow_error, allowed };
    state.pending = settled.next_rays(settings);
    if state.pending != 0 {
        (state.ray_count, state.shadow_count) = (ray_count, shadow_count);
        (state.ray_error, state.shadow_error) = (ray_error, shadow_error);
        state.covered = sample.covered;
        let sums = RaySums { near: 0.0, near_largest: 0.0, near_light: [0.0; 3], ..all.rays };
        state.rays = [sums, RaySums::default()];
        state.visible = [all.visible, Visibilities::default()];
    }
    Some(settled)
}

/// The sums of both halves, of `rays` rays each, with the light of near surfaces by the field where
/// paths have not found it; and whether they have in any.
fn with_near_light(state: &PointState, rays: f32) -> ([HalfSums; 2], bool) {
    let mut halves = [0, 1].map(|half| HalfSums::of(state, half));
    let mut any_covered = false;
    for HalfSums { rays: sums, .. } in &mut halves {
        if is_covered(sums.near, rays) {
            any_covered = true;
        } else {
            sums.light = (Vec3::from(sums.light) + Vec3::from(sums.near_light)).to_array();
            sums.largest = sums.largest.max(sums.near_largest);
        }
    }
    (halves, any_covered)
}

impl Settled {
    /// The rays to be doubled, those with the larger error first: 1 for those over the hemisphere,
    /// 2 for those to lights, 0 for none.
    fn next_rays(&self, settings: &GatherSettings) -> u32 {
        let Settled { sample, ray_error, shadow_error, allowed } = self;
        if sample.noise <= *allowed {
            return 0;
        }
        let max_shadow_rays = (settings.max_rays / RAYS_PER_SHADOW_RAY).max(2);
        let shadows_left = sample.shadow_rays < max_shadow_rays;
        let rays_left = sample.rays < settings.max_rays;
        match (shadow_error > ray_error, shadows_left, rays_left) {
            (true, true, _) | (false, true, false) => 2,
            (false, _, true) | (true, false, true) => 1,
            (_, false, false) => 0,
        }
    }
}
