//! Direct light from lights and the sun, by rays to points on them.
//!
//! The irradiance of lights is their closed form times their visible share by rays.

use std::ops::Range;

use glam::DVec3;

use super::doubled::RaySums;
use super::scene_rays::{SceneRays, shadow_rays};
use super::wide_light::WideLight;
use crate::gather::GatherPoint;
use crate::gather::light_samples::{LightRay, LightSample, LightSamples, LightSums};
use crate::gather::light_tree::patch::Patch;
use crate::gather::visible::Visible;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::scene::{Rgb, Sun};
use crate::visibility::ray_scene::Hit;

/// The lights and the sun that rays are sent to from one point.
pub(super) struct DirectLight<'a> {
    scene: &'a SceneRays,
    point: &'a GatherPoint,
    lights: LightSamples<'a, Patch>,
    /// Lights for which rays over the hemisphere are more accurate.
    wide: Vec<WideLight<'a>>,
    sun: Option<&'a Sun>,
    rotation: f64,
    /// Of the unoccluded irradiance of `lights`, W/m².
    error: f64,
}

/// Results of a range of rays for the lights and the sun.
pub(super) struct ShadowRays<'a> {
    light: &'a DirectLight<'a>,
    lights: LightSums,
    /// Cosines instead of form factors.
    sun: Visible,
}

impl<'a> DirectLight<'a> {
    /// A light that subtends a large angle at `point` is sampled better by rays over the hemisphere
    /// than by points spread over its area: those are [`WideLight`]s.
    ///
    /// `min_rays` is the minimum number of rays over the hemisphere, and `max_bound` the largest
    /// error of a light's unoccluded irradiance as a share of that of all.
    pub fn new(
        rays: &'a SceneRays,
        min_rays: u32,
        point: &'a GatherPoint,
        max_bound: f64,
    ) -> DirectLight<'a> {
        let mut cut = rays.lights.cut(point, max_bound);
        let mut wide = vec![];
        cut.nodes.retain(|node| {
            let patch = rays.lights.exact_leaf(node);
            let light =
                patch.and_then(|patch| WideLight::new(patch, node.irradiance, point, min_rays));
            let is_wide = light.is_some();
            wide.extend(light);
            !is_wide
        });
        let rotation = rays.rotations.at(point.position, point.near);
        let first_half = shadow_rays(min_rays) / 2;
        let lights = LightSamples::new(&rays.lights, cut.nodes, point, rotation, first_half);
        let sun = rays.scene.sky().sun();
        DirectLight { scene: rays, point, lights, wide, sun, rotation, error: cut.error }
    }

    /// Whether rays are sent to lights.
    pub fn has_lights(&self) -> bool {
        !self.lights.is_empty()
    }

    /// Error of the lights' irradiance where nothing is in the way, W/m².
    pub fn error(&self) -> f64 {
        self.error
    }

    /// The lights sampled by rays over the hemisphere.
    pub fn wide(&self) -> &[WideLight<'a>] {
        &self.wide
    }

    /// Counts a ray over the hemisphere in the `visible` sums of each wide light: in a `direction`,
    /// with its first hit, if any, and the transmittance of panes up to a distance.
    pub fn add_to_wide(
        &self,
        visible: &mut [Visible],
        direction: DVec3,
        hit: Option<Hit>,
        passed: impl Fn(f64) -> Rgb,
    ) {
        let front = hit.filter(|hit| hit.front);
        for (wide, visible) in self.wide.iter().zip(visible) {
            let hit = front.filter(|hit| wide.has(hit.triangle));
            wide.add_ray(direction, hit.map(|hit| passed(hit.distance)), visible);
        }
    }

    /// Casts the rays of `range`.
    pub fn cast(&self, range: Range<u32>) -> ShadowRays<'_> {
        let sun = |sun: &Sun| self.rays_to_sun(sun, range.clone());
        ShadowRays {
            light: self,
            sun: self.sun.map_or_else(Visible::default, sun),
            lights: self.lights.cast(range, |_| true, |sample| self.passed(sample)),
        }
    }

    /// Sums of cosines at the point, over points of `range` spread over the sun: of the visible
    /// ones, and of all above the horizon.
    pub fn rays_to_sun(&self, sun: &Sun, range: Range<u32>) -> Visible {
        let SceneRays { surfaces, panes, .. } = self.scene;
        Visible::of_sun(sun, self.point, self.rotation, range, surfaces, panes)
    }

    /// Materials of the lights that the rays of `range` see, and what is visible of them: form
    /// factors.
    pub fn emitters(&self, range: Range<u32>) -> Vec<(u32, f64)> {
        let mut rays: Vec<(LightRay<Patch>, f64)> = vec![];
        self.lights.visit(
            range,
            |_| true,
            |ray| {
                let passed = self.passed(&ray.sample).element_sum() / 3.0;
                rays.push((ray, passed));
            },
        );
        let irradiance: Vec<Rgb> = self.lights.irradiance_of_strata().collect();
        let mut weights = vec![0.0; irradiance.len()];
        for (ray, _) in &rays {
            weights[ray.stratum] += ray.weight.element_sum();
        }
        let seen = rays.iter().filter(|(_, passed)| *passed > 0.0);
        let emitter = |(ray, passed): &(LightRay<Patch>, f64)| {
            let share = ray.weight.element_sum() / weights[ray.stratum];
            let all = irradiance[ray.stratum].element_sum() / ray.leaf.exitance.element_sum();
            (ray.leaf.material, all * share * passed)
        };
        seen.map(emitter).collect()
    }

    /// The share per channel of the light of a point of a light that arrives.
    fn passed(&self, sample: &LightSample) -> Rgb {
        let (rays, point) = (self.scene, self.point);
        let to = sample.position - point.position;
        let reach = point.near / to.length()..1.0 - COINCIDENCE_TOLERANCE;
        let (own, is_solid) = sample.surface.map_or((u32::MAX, true), |(triangle, barycentric)| {
            (triangle, rays.scene.is_solid(triangle as usize, barycentric))
        });
        let other = |hit: &Hit| !(hit.triangle as u32 == own && hit.front);
        if !is_solid || rays.surfaces.occluded(point.position, to, reach.clone(), other) {
            return Rgb::ZERO;
        }
        rays.panes.transmittance(point.position, to, reach)
    }
}

impl ShadowRays<'_> {
    /// The irradiance of the sun, W/m² per channel.
    pub fn of_sun(&self) -> Rgb {
        let DirectLight { point, sun, .. } = self.light;
        sun.map_or(Rgb::ZERO, |sun| self.sun.irradiance_of_sun(sun, point))
    }
}

impl RaySums for ShadowRays<'_> {
    fn add(&mut self, other: &ShadowRays) {
        self.lights.add(&other.lights);
        self.sun.add(&other.sun);
    }

    fn mean(&self, _: u32) -> Rgb {
        self.light.lights.irradiance(&self.lights) + self.of_sun()
    }

    fn largest(&self, count: u32) -> f64 {
        let sun = match self.sun.is_partial() {
            true => self.light.sun.map_or(0.0, |sun| sun.irradiance.length()) / f64::from(count),
            false => 0.0,
        };
        self.light.lights.of_one_ray(&self.lights).max(sun)
    }
}
