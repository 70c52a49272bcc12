//! Twin of `shaders/near_paths.wgsl`: light that near surfaces reflect, by paths.

use std::f32::consts::PI;

use glam::{Vec2, Vec3};

use super::field::field_at;
use super::gather_state::HalfSums;
use super::lights::{passed, ray_from, to_light};
use super::near_field::{is_covered, is_near};
use super::ray_arrays::RayArrays;
use super::shift::Shift;
use super::sky::{from_sky, towards_sun};
use super::trace::{Hit, Ray, is_hidden, nearest, nearest_but, turned};
use crate::backend::gpu::layout::{
    ANY_LIGHT, FAR, LIFT, MAX_SURVIVAL, MAX_VERTICES, NOTHING, PointState, ROW_OF_FLAGS,
    RankedLight, RaySums, TracedPoint, TracedTriangle,
};
use crate::backend::gpu::traced_scene::TracedArrays;
use crate::gather::lights::NO_LIGHT;

/// Random numbers of one path.
#[derive(Clone, Copy, Debug)]
pub struct Random(u32);

/// A hash of 32 bits: PCG-RXS-M-XS (Jarzynski and Olano 2020).
fn scrambled(bits: u32) -> u32 {
    let state = bits.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

impl Random {
    /// Of ray `k` from a point: of nothing but where the point is.
    pub fn of_ray(point: &TracedPoint, k: u32) -> Random {
        let [x, y, z] = point.position.map(f32::to_bits);
        Random(scrambled(scrambled(scrambled(scrambled(x) ^ y) ^ z) ^ k))
    }

    /// The next one in (0, 1).
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        ((scrambled(self.0) >> 8) as f32 + 0.5) * 2f32.powi(-24)
    }
}

/// What ray `k` from a point adds: the light that a near surface reflects along it, by one path, if
/// paths find it in that half.
pub fn ray(
    arrays: &RayArrays,
    point: &TracedPoint,
    state: &PointState,
    k: u32,
    shift: Shift,
) -> HalfSums {
    let half = if state.pending == 3 && k < state.ray_count / 2 { 0 } else { 1 };
    if !covered_halves(state)[half] {
        return HalfSums::default();
    }
    let light = near_light(arrays, point, state, k, shift);
    let (light, largest) = (light.to_array(), light.length());
    HalfSums { rays: RaySums { light, largest, ..Default::default() }, ..Default::default() }
}

/// Of which halves paths find the light of near surfaces.
pub fn covered_halves(state: &PointState) -> [bool; 2] {
    let half = if state.pending == 3 { state.ray_count / 2 } else { state.ray_count };
    state.rays.map(|sums| is_covered(sums.near, half as f32))
}

/// Light that near surfaces reflect along ray `k`.
fn near_light(
    arrays: &RayArrays,
    point: &TracedPoint,
    state: &PointState,
    k: u32,
    shift: Shift,
) -> Vec3 {
    let direction = shift.direction(arrays.direction(k, point.normal, point.rotation));
    let ray = ray_from(&shift.point(*point), direction);
    let hit = nearest(arrays.scene, &ray);
    if hit.triangle == NOTHING || !hit.front {
        return Vec3::ZERO;
    }
    let there = field_at(arrays, &hit);
    if !is_near(arrays.scene, &hit, there.side) {
        return Vec3::ZERO;
    }
    let passed = passed(arrays.scene, &ray, hit.distance);
    let path = Path { arrays, state, shift, random: Random::of_ray(point, k) };
    passed * path.light(hit, there.reflectance)
}

struct Path<'a> {
    arrays: &'a RayArrays<'a>,
    state: &'a PointState,
    shift: Shift,
    random: Random,
}

impl Path<'_> {
    /// Radiosity that a front with this reflectance reflects at a hit, without its emission.
    fn light(mut self, mut hit: Hit, mut reflectance: Vec3) -> Vec3 {
        let scene = self.arrays.scene;
        let mut sum = Vec3::ZERO;
        let mut throughput = Vec3::ONE;
        for vertex in 1..=MAX_VERTICES {
            let t = &scene.triangles[hit.triangle as usize];
            let through = transmittance(scene, t, reflectance);
            if vertex > 1 {
                let survival = (reflectance + through).max_element().min(MAX_SURVIVAL);
                if self.random.next() >= survival {
                    return sum;
                }
                throughput /= survival;
            }
            let (side, leaves) = self.choose_side(reflectance, through);
            throughput *= leaves;
            let at = self.shift.point(on_triangle(t, hit.u, hit.v, side));
            sum += throughput * self.irradiance_of_lights(&at);
            if scene.info.has_sun != 0 {
                sum += throughput * self.irradiance_of_sun(&at);
            }
            let (square, turn) = (self.random.next(), self.random.next());
            let local = Vec3::new(square.sqrt(), 0.0, (1.0 - square).sqrt());
            let direction = self.shift.direction(turned(local, at.normal.into(), turn));
            let ray = ray_from(&at, direction);
            hit = nearest_but(scene, &ray, t.index);
            if hit.triangle == NOTHING {
                return sum + throughput * passed(scene, &ray, FAR) * from_sky(scene, direction);
            }
            if !hit.front {
                return sum;
            }
            throughput *= passed(scene, &ray, hit.distance);
            sum += throughput * self.exitance_met(&at, &ray, &hit);
            let there = field_at(self.arrays, &hit);
            if vertex == MAX_VERTICES || !is_near(scene, &hit, there.side) {
                return sum + throughput * there.radiosity;
            }
            reflectance = there.reflectance;
        }
        sum
    }

    /// The side that a path goes on from, 1 for the front and -1 for the back, in proportion to the
    /// light that leaves there, and what of the light leaves, over the probability of the choice.
    fn choose_side(&mut self, reflectance: Vec3, through: Vec3) -> (f32, Vec3) {
        let sum_through = through.element_sum();
        if sum_through == 0.0 {
            return (1.0, reflectance);
        }
        let chance = sum_through / (sum_through + reflectance.element_sum());
        match self.random.next() < chance {
            true => (-1.0, through / chance),
            false => (1.0, reflectance / (1.0 - chance)),
        }
    }

    /// Exitance at the hit of a ray from a vertex, with the share that the balance leaves to it.
    fn exitance_met(&self, at: &TracedPoint, ray: &Ray, hit: &Hit) -> Vec3 {
        let scene = self.arrays.scene;
        let t = &scene.triangles[hit.triangle as usize];
        if t.light == NO_LIGHT {
            return Vec3::ZERO;
        }
        let light = &scene.lights[t.light as usize];
        let facing = (-normal_of(t).dot(ray.direction)).max(0.0);
        let above = Vec3::from(at.normal).dot(ray.direction).max(0.0);
        let factor = light.area * facing * above / (PI * hit.distance * hit.distance);
        Vec3::from(light.exitance) * balance(factor, chance_of(scene, self.state, t.light))
    }

    /// Irradiance at a vertex from one point of a light, with the share that the balance leaves to
    /// it.
    fn irradiance_of_lights(&mut self, at: &TracedPoint) -> Vec3 {
        let scene = self.arrays.scene;
        if scene.info.lights == 0 {
            return Vec3::ZERO;
        }
        let number = choose_light(scene, self.state, self.random.next());
        let at_square = Vec2::new(self.random.next(), self.random.next());
        let light = &scene.lights[number as usize];
        let to = to_light(scene, light, at, self.shift.moved(at_square));
        if to.factor <= 0.0 || !to.is_solid || is_hidden(scene, &to.ray, to.distance, ANY_LIGHT) {
            return Vec3::ZERO;
        }
        let share = balance(to.factor, chance_of(scene, self.state, number));
        passed(scene, &to.ray, to.distance) * Vec3::from(light.exitance) * share
    }

    /// Irradiance at a vertex from one point of the sun.
    fn irradiance_of_sun(&mut self, at: &TracedPoint) -> Vec3 {
        let scene = self.arrays.scene;
        let at_square = Vec2::new(self.random.next(), self.random.next());
        let direction = self.shift.direction(towards_sun(scene, at_square));
        let cosine = Vec3::from(at.normal).dot(direction);
        let ray = ray_from(at, direction);
        if cosine <= 0.0 || is_hidden(scene, &ray, FAR, ANY_LIGHT) {
            return Vec3::ZERO;
        }
        passed(scene, &ray, FAR) * Vec3::from(scene.info.sun) * cosine
    }
}

/// What of the light that arrives at a triangle leaves its other side, where it has this
/// reflectance.
fn transmittance(scene: &TracedArrays, t: &TracedTriangle, reflectance: Vec3) -> Vec3 {
    let row = (t.flags >> ROW_OF_FLAGS) as usize;
    if row == 0 {
        return Vec3::ZERO;
    }
    let whole = Vec3::from(scene.lights[row].exitance);
    let relative = reflectance / whole.max(Vec3::splat(1e-37));
    let relative = Vec3::select(whole.cmpgt(Vec3::ZERO), relative, Vec3::ONE);
    Vec3::from(scene.lights[row - 1].exitance) * relative
}

fn normal_of(t: &TracedTriangle) -> Vec3 {
    let edge = |edge: [f32; 3]| Vec3::from(edge) / t.extent;
    edge(t.edge_u).cross(edge(t.edge_v)).normalize()
}

/// A point on a side of a triangle: the front is 1, the back -1.
fn on_triangle(t: &TracedTriangle, u: f32, v: f32, side: f32) -> TracedPoint {
    let normal = side * normal_of(t);
    let [corner, corner_low, edge_u, edge_v] =
        [t.corner, t.corner_low, t.edge_u, t.edge_v].map(Vec3::from);
    let along = edge_u * u + edge_v * v + normal * LIFT;
    let position = corner + along;
    let low = (along - (position - corner)) + corner_low;
    TracedPoint {
        position: position.to_array(),
        near: 0.25 * LIFT,
        position_low: low.to_array(),
        normal: normal.to_array(),
        ..Default::default()
    }
}

/// Share of a sample of one of two densities in their sum.
fn balance(factor: f32, chance: f32) -> f32 {
    let bounded = factor.min(1e30);
    bounded / (bounded + chance).max(1e-37)
}

/// How much a light counts among those of a gather point.
fn weight_of(scene: &TracedArrays, ranked: &RankedLight) -> f32 {
    ranked.factor * Vec3::from(scene.lights[ranked.light as usize].exitance).max_element()
}

fn weight_of_ranked(scene: &TracedArrays, state: &PointState) -> f32 {
    state.ranked().iter().map(|ranked| weight_of(scene, ranked)).sum()
}

/// The probability that [`choose_light`] chooses a light.
pub fn chance_of(scene: &TracedArrays, state: &PointState, light: u32) -> f32 {
    let ends = |light: u32| scene.lights[light as usize].power_end;
    let by_power = ends(light) - if light > 0 { ends(light - 1) } else { 0.0 };
    let all = weight_of_ranked(scene, state);
    if all <= 0.0 {
        return by_power;
    }
    let ranked = state.ranked().iter().find(|ranked| ranked.light == light);
    0.5 * (by_power + ranked.map_or(0.0, |ranked| weight_of(scene, ranked) / all))
}

/// A light: half of the time one of the gather point's, otherwise any, in proportion to its power.
pub fn choose_light(scene: &TracedArrays, state: &PointState, at: f32) -> u32 {
    let all = weight_of_ranked(scene, state);
    let mut remaining = at;
    if all > 0.0 {
        if at < 0.5 {
            let mut weight = 2.0 * at * all;
            let passes = |ranked: &&RankedLight| {
                weight -= weight_of(scene, ranked);
                weight < 0.0
            };
            let chosen = state.ranked().iter().find(passes).or(state.ranked().last());
            return chosen.map_or(0, |ranked| ranked.light);
        }
        remaining = 2.0 * at - 1.0;
    }
    let last = scene.info.lights - 1;
    (0..last).find(|&k| scene.lights[k as usize].power_end > remaining).unwrap_or(last)
}
