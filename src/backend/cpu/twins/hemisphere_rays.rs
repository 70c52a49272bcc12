//! Twin of `shaders/hemisphere_rays.wgsl`: cosine-distributed rays from points.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3, Vec4};

use super::field::{OnElement, field_at};
use super::gather_state::{PointState, RaySums, Visible, added_up};
use super::lights::{passed, ray_from};
use super::near_field::is_near;
use super::sky::from_sky;
use super::trace::{Hit, Ray, intersect, nearest, turned};
use crate::backend::gpu::layout::{FAR, GatherSettings, LANES, NOTHING, TracedLight, TracedPoint};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::gather::lights::{MAX_EXPLICIT_LIGHTS, NO_LIGHT};

/// Bindings of the shader.
#[derive(Clone, Copy, Debug)]
pub struct HemisphereRays<'a> {
    pub scene: &'a TracedArrays,
    pub quadtrees: &'a [u32],
    pub elements: &'a [[f32; 4]],
    /// Coordinates along two tangents and the normal, ray by ray.
    pub directions: &'a [[f32; 4]],
}

/// Results of rays, for wide lights by their index among those of the point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RayResult {
    pub sums: RaySums,
    pub lights: [Visible; MAX_EXPLICIT_LIGHTS],
}

impl RayResult {
    pub fn add(&mut self, other: &RayResult) {
        let largest = self.sums.largest.max(other.sums.largest);
        let near_largest = self.sums.near_largest.max(other.sums.near_largest);
        let terms = bytemuck::cast_slice::<RayResult, f32>(std::slice::from_ref(other));
        let sums = bytemuck::cast_slice_mut::<RayResult, f32>(std::slice::from_mut(self));
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        (self.sums.largest, self.sums.near_largest) = (largest, near_largest);
    }
}

/// Range of rays of a pass over a point in `state` that has cast `total` of them before: in the
/// first pass all of them, in two halves; then the same number again, as the second half. Start,
/// start of the second half, and end.
pub fn range(total: u32, state: &PointState, settings: &GatherSettings) -> [u32; 3] {
    let [start, middle, end] =
        if state.pending == 3 { [0, total / 2, total] } else { [total, total, 2 * total] };
    let from = start + settings.first;
    [from, middle, (from + settings.pass_rays).min(end)]
}

impl HemisphereRays<'_> {
    /// The rays of one pass from a point.
    pub fn cast_rays(
        &self,
        point: &TracedPoint,
        settings: &GatherSettings,
        state: &mut PointState,
    ) {
        let [from, middle, to] = range(state.ray_count, state, settings);
        let mut lanes = [[RayResult::default(); LANES as usize]; 2];
        for k in from..to {
            let result = self.cast_ray(point, self.direction(k, point), state);
            let half = usize::from(k >= middle);
            lanes[half][((k - from) % LANES) as usize].add(&result);
        }
        for (half, lanes) in lanes.into_iter().enumerate() {
            let sum = |of: &dyn Fn(&RayResult) -> Vec4| added_up(lanes.each_ref().map(of));
            let vector = |v: [f32; 3], last: f32| Vec3::from(v).extend(last);
            let light = sum(&|f| vector(f.sums.light, f.sums.escaped));
            let emitted = sum(&|f| vector(f.sums.lamps, f.sums.back));
            let near = sum(&|f| vector(f.sums.near_light, f.sums.near));
            let rest = sum(&|f| vector([f.sums.inverse_distance, 0.0, 0.0], 0.0));
            let out = &mut state.rays[half];
            out.light = (Vec3::from(out.light) + light.truncate()).to_array();
            out.escaped += light.w;
            out.lamps = (Vec3::from(out.lamps) + emitted.truncate()).to_array();
            out.back += emitted.w;
            out.inverse_distance += rest.x;
            let largest = |of: fn(&RaySums) -> f32, start: f32| {
                lanes.iter().map(|result| of(&result.sums)).fold(start, f32::max)
            };
            out.largest = largest(|sums| sums.largest, out.largest);
            out.near_largest = largest(|sums| sums.near_largest, out.near_largest);
            out.near += near.w;
            out.near_light = (Vec3::from(out.near_light) + near.truncate()).to_array();
            for k in 0..state.light_count as usize {
                if state.lights[k].is_wide != 0 {
                    let of_light = sum(&|f| vector(f.lights[k].seen, f.lights[k].all));
                    let out = &mut state.visible[half][k];
                    out.seen = (Vec3::from(out.seen) + of_light.truncate()).to_array();
                    out.all += of_light.w;
                }
            }
        }
    }

    /// The direction of ray `k`.
    pub fn direction(&self, k: u32, point: &TracedPoint) -> Vec3 {
        let local = Vec4::from(self.directions[k as usize]).truncate();
        turned(local, point.normal.into(), point.rotation)
    }

    /// The field at a hit.
    pub fn field_at(&self, hit: &Hit) -> OnElement {
        let index = self.scene.triangles[hit.triangle as usize].index;
        field_at(self.quadtrees, self.elements, index, Vec2::new(hit.u, hit.v))
    }

    /// The result of one ray.
    pub fn cast_ray(&self, point: &TracedPoint, direction: Vec3, state: &PointState) -> RayResult {
        let scene = self.scene;
        let ray = ray_from(point, direction);
        let hit = nearest(scene, &ray);
        let is_surface = hit.triangle != NOTHING;
        let share = passed(scene, &ray, if is_surface { hit.distance } else { FAR });
        let mut result = RayResult::default();
        let mut of_light = NO_LIGHT;
        if is_surface && hit.front {
            of_light = scene.triangles[hit.triangle as usize].light;
        }
        let mut is_known = false;
        for (ranked, visible) in state.ranked().iter().zip(&mut result.lights) {
            let is_hit = ranked.light == of_light;
            is_known |= is_hit;
            if ranked.is_wide != 0 {
                if is_hit {
                    visible.seen = share.to_array();
                }
                let light = &scene.lights[ranked.light as usize];
                visible.all = f32::from(is_hit || is_towards(scene, &ray, light));
            }
        }
        let sums = &mut result.sums;
        if !is_surface {
            let light = from_sky(scene, direction) * share;
            sums.escaped = 1.0;
            sums.light = light.to_array();
            sums.largest = light.length();
            return result;
        }
        sums.inverse_distance = 1.0 / hit.distance;
        if !hit.front {
            sums.back = 1.0;
            return result;
        }
        let there = self.field_at(&hit);
        let light = there.radiosity * share;
        if is_near(scene, &hit, there.side) {
            sums.near = 1.0;
            sums.near_light = light.to_array();
            sums.near_largest = light.length();
        } else {
            sums.light = light.to_array();
            sums.largest = light.length();
        }
        if of_light != NO_LIGHT && !is_known {
            let exitance = Vec3::from(scene.lights[of_light as usize].exitance);
            sums.lamps = (exitance * share).to_array();
        }
        result
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
