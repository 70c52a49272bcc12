//! Direct light from lights and the sun, by rays to points on them.
//!
//! A light's irradiance is its closed form times its visible share by rays, weighted by form
//! factors.

use std::ops::Range;

use glam::DVec3;

use super::doubled::RaySums;
use super::point_on::{PointOn, point_on};
use super::scene_rays::SceneRays;
use super::wide_light::WideLight;
use crate::gather::GatherPoint;
use crate::gather::visible::Visible;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::polygon::clip;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::rotation::second_rotation;
use crate::scene::{Rgb, Sun};
use crate::visibility::ray_scene::Hit;

/// The lights and the sun that rays are sent to from one point.
pub(super) struct DirectLight<'a> {
    scene: &'a SceneRays,
    point: &'a GatherPoint,
    /// Each with its unoccluded form factor.
    lights: Vec<(u32, f64)>,
    /// Lights for which rays over the hemisphere are more accurate.
    wide: Vec<WideLight>,
    sun: Option<&'a Sun>,
    rotation: f64,
}

/// Whether the part of a light above the horizon of `point` is within 60° of its mean direction, so
/// that points on it sample it well (plain choice); false if there is none.
fn is_within_cone(point: &GatherPoint, triangles: impl Iterator<Item = [DVec3; 3]>) -> bool {
    let mut directions = vec![];
    for corners in triangles {
        let [a, b, c] = corners.map(|p| p - point.position);
        if (b - a).cross(c - a).dot(a) < 0.0 {
            directions.extend(clip(&[a, b, c], DVec3::ZERO, point.normal));
        }
    }
    let axis = directions.iter().map(|d| d.normalize_or_zero()).sum::<DVec3>().try_normalize();
    let is_within = |axis: DVec3| directions.iter().all(|d| d.dot(axis) > 0.5 * d.length());
    axis.is_some_and(is_within)
}

/// Results of a range of rays for each light and the sun.
pub(super) struct ShadowRays<'a> {
    light: &'a DirectLight<'a>,
    lights: Vec<Visible>,
    /// Cosines instead of form factors.
    sun: Visible,
}

impl<'a> DirectLight<'a> {
    /// A light that subtends a large angle at `point` is sampled better by rays over the hemisphere
    /// than by points spread over its area: those with a closed form are [`WideLight`]s, and the
    /// others are treated like any surface.
    ///
    /// `min_rays` is the minimum number of rays over the hemisphere.
    pub fn new(rays: &'a SceneRays, min_rays: u32, point: &'a GatherPoint) -> DirectLight<'a> {
        let scene = rays.lights.scene();
        let mut lights = rays.lights.importance_ranked(point);
        lights.retain(|&(light, _)| {
            let light = &rays.lights.lights[light as usize];
            let corner = |&t: &u32| scene.corners(t as usize);
            light.convex || is_within_cone(point, light.triangles.iter().map(corner))
        });
        let all = &rays.lights.lights;
        let (wide, lights): (Vec<_>, Vec<_>) = lights.into_iter().partition(|&(light, factor)| {
            WideLight::is_wide(&all[light as usize], factor, scene, point, min_rays)
        });
        let wide = wide.into_iter().map(|(light, factor)| {
            WideLight::new(&all[light as usize], light, factor, scene, point)
        });
        let wide = wide.collect();
        let rotation = rays.rotations.at(point.position, point.near);
        DirectLight { scene: rays, point, lights, wide, sun: scene.sky().sun(), rotation }
    }

    /// The lights, each with its unoccluded form factor.
    pub fn lights(&self) -> &[(u32, f64)] {
        &self.lights
    }

    /// The lights sampled by rays over the hemisphere.
    pub fn wide(&self) -> &[WideLight] {
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
            let is_hit = |hit: &Hit| self.scene.lights.of_triangle[hit.triangle] == wide.light;
            wide.add_ray(direction, front.filter(is_hit).map(|hit| passed(hit.distance)), visible);
        }
    }

    /// Whether the direct light of `light` is counted separately from reflected light.
    pub fn samples(&self, light: u32) -> bool {
        self.lights.iter().any(|&(k, _)| k == light) || self.wide.iter().any(|w| w.light == light)
    }

    /// Casts the rays of `range`.
    pub fn cast(&self, range: Range<u32>) -> ShadowRays<'_> {
        let visible = |&(light, _): &(u32, f64)| self.rays_to(light, range.clone());
        let sun = |sun: &Sun| self.rays_to_sun(sun, range.clone());
        ShadowRays {
            light: self,
            lights: self.lights.iter().map(visible).collect(),
            sun: self.sun.map_or_else(Visible::default, sun),
        }
    }

    /// Sums of cosines at the point, over points of `range` spread over the sun: of the visible
    /// ones, and of all above the horizon.
    pub fn rays_to_sun(&self, sun: &Sun, range: Range<u32>) -> Visible {
        let SceneRays { surfaces, panes, .. } = self.scene;
        Visible::of_sun(sun, self.point, self.rotation, range, surfaces, panes)
    }

    /// Form factors from the point to the visible part of a light, and to all of it unoccluded,
    /// both by the same points on it: those of `range`.
    pub fn rays_to(&self, light: u32, range: Range<u32>) -> Visible {
        let (rays, point) = (self.scene, self.point);
        let (lights, scene) = (&rays.lights, rays.lights.scene());
        let mut out = Visible { points: f64::from(range.end - range.start), ..Default::default() };
        // Both coordinates are rotated: where only a strip of the light is visible, the same points
        // everywhere would cause an error in the same direction everywhere.
        let second_rotation = second_rotation(self.rotation);
        for i in range {
            let [x, y] = sobol_02_point(i);
            let at = [(x + second_rotation).fract(), (y + self.rotation).fract()];
            let PointOn { to, factor, is_hole } =
                point_on(&lights.lights[light as usize], scene, point, at);
            if factor <= 0.0 {
                continue;
            }
            out.all += factor;
            // A first hit on another part of the light counts as visible.
            let near = point.near / to.length();
            let other = |h: &Hit| !(lights.of_triangle[h.triangle] == light && h.front);
            let reach = near..1.0 - COINCIDENCE_TOLERANCE;
            if !is_hole && !rays.surfaces.occluded(point.position, to, reach.clone(), other) {
                out.seen += factor * rays.panes.transmittance(point.position, to, reach);
            }
        }
        out
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
        for (sum, term) in self.lights.iter_mut().zip(&other.lights) {
            sum.add(term);
        }
        self.sun.add(&other.sun);
    }

    fn mean(&self, _: u32) -> Rgb {
        let DirectLight { scene, lights, .. } = self.light;
        let mut irradiance = Rgb::ZERO;
        for (&(light, factor), visible) in lights.iter().zip(&self.lights) {
            let light = &scene.lights.lights[light as usize];
            let share = visible.share_of(light.convex.then_some(factor));
            irradiance += light.exitance * visible.seen * share;
        }
        irradiance + self.of_sun()
    }

    /// 0: all rays to a light contribute to its occlusion.
    fn largest(&self) -> f64 {
        0.0
    }
}
