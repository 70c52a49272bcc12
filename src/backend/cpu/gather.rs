//! Irradiance gathered with rays on the CPU: a second opinion, and the backend without a GPU.
//!
//! ```text
//!                ┌ rays over the hemisphere ─► reflected light, escaped, backface, 1/distance
//! point ─ trace ─┤
//!                ├ shadow rays to each light ─► visible share × closed form = direct light
//!                └ shadow rays to luminaires ─► see `LuminaireLight`
//! ```
//!
//! The number of rays doubles until halves of them agree, or the most is reached:
//!
//! ```text
//! error = max(|E_first − E_second|, c_max / n) / 2   ≤   noise · max(E, dim) ?
//! ```
//!
//! E_first and E_second being those of the two halves of the rays, and c_max the largest
//! contribution of one ray: both halves may miss the same small source.

mod point_rows;

use std::f64::consts::PI;
use std::ops::Range;

use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::gather::light_projection::LightProjection;
use crate::gather::lights::{Light, Lights, NO_LIGHT};
use crate::gather::luminaire_light::LuminaireLight;
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::mesh::Mesh;
use crate::sampling::hemisphere::{self, HemisphereSamples};
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::rotation::CellRotation;
use crate::scene::{Rgb, Scene, Sun};
use crate::visibility::offset;
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::{Hit, RayScene};

/// Gathers by casting cosine-distributed rays, and rays to points on each light.
///
/// Every ray carries the same share of the hemisphere, so what reflected light it finds has the
/// error of an average over n stratified samples. A light's irradiance is its closed form times the
/// share of it that a quarter as many rays find visible, weighted by their form factors.
#[derive(Debug)]
pub struct RayGather {
    scene: RayScene,
    panes: Panes,
    lights: Lights,
    rotations: CellRotation,
    samples: HemisphereSamples,
    /// Rays a point: at least and at most.
    min_rays: u32,
    max_rays: u32,
    /// Error that is allowed, as a share of the irradiance; none where infinite.
    noise: f64,
    /// Irradiance below which the error is a share of this instead, W/m².
    dim: f64,
}

/// Rays at most for one where all agree. Chosen by hand; no measurement kept.
const MAX_OVERSAMPLING: u32 = 16;

/// Rays over the hemisphere for one shadow ray to each light. Chosen by hand; no measurement kept.
const RAYS_PER_SHADOW_RAY: u32 = 4;

/// The second rotation is the rest of the first behind its 16 leading bits.
const SECOND_ROTATION: f64 = (1u32 << 16) as f64;

impl RayGather {
    /// About `count` rays a point over the triangles of `mesh`'s scene: the nearest power of two.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(mesh: &Mesh, count: u32) -> Result<RayGather, Error> {
        if count == 0 || count > hemisphere::MAX_RAYS {
            let place = format!("{count} rays a place");
            let remedy = format!("use 1 to {}", hemisphere::MAX_RAYS);
            return Err(Error::new(ErrorKind::Setting, place, "not usable", remedy));
        }
        let min_rays = 1 << f64::from(count).log2().round().max(1.0) as u32;
        Ok(RayGather {
            scene: RayScene::of_scene(mesh.scene()),
            panes: Panes::of_scene(mesh.scene()),
            lights: Lights::new(mesh.shared_scene()),
            rotations: CellRotation::new(&mesh.scene().bounds()),
            samples: samples(mesh.scene(), min_rays, min_rays),
            min_rays,
            max_rays: min_rays,
            noise: f64::INFINITY,
            dim: 0.0,
        })
    }

    /// Adaptive: doubles the number of rays, up to 16 times, until the error estimate is below
    /// `noise`·max(E, `dim`), E being the irradiance and `dim` in W/m². The estimate is half the
    /// larger of: the difference between the irradiance of both halves of the rays, and the largest
    /// contribution of one ray. Few points need more rays, such as those that see a bright spot
    /// through a gap.
    pub fn with_noise(self, noise: f64, dim: f64) -> RayGather {
        let max_rays = if noise.is_finite() {
            (self.min_rays * MAX_OVERSAMPLING).min(hemisphere::MAX_RAYS)
        } else {
            self.min_rays
        };
        let samples = samples(self.lights.scene(), max_rays, self.min_rays);
        RayGather { samples, max_rays, noise, dim, ..self }
    }

    /// Mean of 1/distance over the hemisphere above `point`, per scene unit, by as many rays as it
    /// gathers with at least; directions that see nothing count 0. No light is looked up.
    pub(crate) fn inverse_distance(&self, point: &GatherPoint) -> f64 {
        let rotation = self.rotations.at(point.position, point.near);
        let directions = self.samples.directions_in(0..self.min_rays, point.normal, rotation);
        let mut sum = 0.0;
        self.scene.closest_hits(point.position, directions, point.near, None, |_, hit| {
            sum += hit.map_or(0.0, |hit| 1.0 / hit.distance);
        });
        sum / f64::from(self.min_rays)
    }

    /// What arrives at `point` from each of `fields`, all of one scene, with the same rays: as many
    /// as the first takes.
    fn irradiance<const FIELDS: usize>(
        &self,
        fields: [&RadiosityField; FIELDS],
        point: &GatherPoint,
    ) -> [IrradianceSample; FIELDS] {
        let scene = fields[0].mesh.scene();
        let lights = self.sampled_lights(scene, point);
        let sun = scene.sky().sun();
        let luminaires = LuminaireLight {
            luminaires: scene.luminaires(),
            rays: &self.scene,
            panes: &self.panes,
            rotations: &self.rotations,
        };
        let of_luminaires = luminaires.irradiance(point);
        let trace = |range| self.trace(fields, point, &lights, range);
        let sample = |sums: &RaySums<FIELDS>, count| {
            self.samples_of(sums, of_luminaires, (point, &lights, sun), count)
        };
        let mut count = self.min_rays;
        let mut sums = trace(0..count / 2);
        loop {
            let second = trace(count / 2..count);
            let [a, b] = [&sums, &second].map(|half| sample(half, count / 2)[0].irradiance);
            sums.add(&second);
            let all = sample(&sums, count);
            let largest_share = sums.max_contribution / f64::from(count);
            let difference = a.distance(b).max(largest_share);
            let allowed = self.noise * all[0].irradiance.length().max(self.dim);
            if difference / 2.0 <= allowed || count == self.max_rays {
                return all;
            }
            count *= 2;
        }
    }

    /// The lights that rays are sent to from `point`, each with its unoccluded form factor. A light
    /// without a closed form that reaches far around is not among them: it is sampled better by
    /// rays over the hemisphere than by points spread over its area.
    fn sampled_lights(&self, scene: &Scene, point: &GatherPoint) -> Vec<(u32, f64)> {
        let mut lights = self.lights.importance_ranked(point);
        lights.retain(|&(light, _)| {
            let light = &self.lights.lights[light as usize];
            let corner = |&t: &u32| scene.corners(t as usize);
            light.convex
                || LightProjection::new(point, light.triangles.iter().map(corner)).is_some()
        });
        lights
    }

    /// Sums over the rays of `range`.
    fn trace<const FIELDS: usize>(
        &self,
        fields: [&RadiosityField; FIELDS],
        point: &GatherPoint,
        lights: &[(u32, f64)],
        range: Range<u32>,
    ) -> RaySums<FIELDS> {
        let scene = fields[0].mesh.scene();
        let rotation = self.rotations.at(point.position, point.near);
        let has_shadow_rays = |light: u32| lights.iter().any(|&(k, _)| k == light);
        let mut sums = RaySums::default();
        let sky = scene.sky();
        let out = &mut sums.hemisphere;
        let directions = self.samples.directions_in(range.clone(), point.normal, rotation);
        self.scene.closest_hits(point.position, directions, point.near, None, |direction, hit| {
            let Some(hit) = hit else {
                out.escaped += 1.0;
                let reach = point.near..f64::INFINITY;
                let passed = self.panes.transmittance(point.position, direction, reach);
                let radiosity = PI * sky.radiance(direction) * passed;
                out.irradiance += radiosity;
                sums.max_contribution = sums.max_contribution.max(radiosity.length());
                return;
            };
            out.inverse_distance += 1.0 / hit.distance;
            if !hit.front {
                out.backface += 1.0;
                return;
            }
            let reach = point.near..hit.distance;
            let passed = self.panes.transmittance(point.position, direction, reach);
            let reflected =
                fields.map(|field| field.reflected_at(hit.triangle, hit.u, hit.v) * passed);
            sums.max_contribution = sums.max_contribution.max(reflected[0].length());
            for (sum, reflected) in sums.reflected.iter_mut().zip(reflected) {
                *sum += reflected;
            }
            let light = self.lights.of_triangle[hit.triangle];
            if light != NO_LIGHT && !has_shadow_rays(light) {
                out.irradiance += self.lights.lights[light as usize].exitance * passed;
            }
        });
        let range = shadow_range(range);
        let visible = |&(light, _): &(u32, f64)| {
            self.shadow_rays(scene, point, light, range.clone(), rotation)
        };
        sums.lights = lights.iter().map(visible).collect();
        if let Some(sun) = sky.sun() {
            sums.sun = self.rays_to_sun(point, sun, range, rotation);
        }
        sums
    }

    /// The irradiance from each field by sums over `count` rays, and from luminaires.
    fn samples_of<const FIELDS: usize>(
        &self,
        sums: &RaySums<FIELDS>,
        of_luminaires: Rgb,
        (point, lights, sun): (&GatherPoint, &[(u32, f64)], Option<&Sun>),
        count: u32,
    ) -> [IrradianceSample; FIELDS] {
        let (share, mut out) = (1.0 / f64::from(count), sums.hemisphere);
        out.direct = of_luminaires;
        out.irradiance *= share;
        out.escaped *= share;
        out.backface *= share;
        out.inverse_distance *= share;
        for (&(light, factor), visible) in lights.iter().zip(&sums.lights) {
            let light = &self.lights.lights[light as usize];
            let share = visible.share_of(light.convex.then_some(factor));
            out.direct += light.exitance * visible.seen * share;
        }
        if let Some(sun) = sun {
            let Visible { points, seen, all } = sums.sun;
            out.direct += match sun.unoccluded(point.normal.dot(sun.direction)) {
                Some(irradiance) => irradiance * (seen / all.max(f64::MIN_POSITIVE)),
                None => sun.irradiance * (seen / points.max(1.0)),
            };
        }
        out.irradiance += out.direct;
        sums.reflected.map(|reflected| {
            let irradiance = out.irradiance + reflected * share;
            IrradianceSample { irradiance, ..out }
        })
    }

    /// The cosines at `point` of points spread over the sun: of those of `range` that are seen, and
    /// of all above the horizon.
    fn rays_to_sun(
        &self,
        point: &GatherPoint,
        sun: &Sun,
        range: Range<u32>,
        rotation: f64,
    ) -> Visible {
        let mut out = Visible { points: f64::from(range.end - range.start), ..Default::default() };
        let second_rotation = (rotation * SECOND_ROTATION).fract();
        for [x, y] in range.map(sobol_02_point) {
            let direction = sun.towards([(x + second_rotation).fract(), (y + rotation).fract()]);
            let cosine = point.normal.dot(direction).max(0.0);
            let reach = point.near..f64::INFINITY;
            out.all += cosine;
            let (from, any) = (point.position, |_: &Hit| true);
            if cosine > 0.0 && !self.scene.occluded(from, direction, reach.clone(), any) {
                out.seen += cosine * self.panes.transmittance(from, direction, reach);
            }
        }
        out
    }

    /// The form factor from `point` to what is visible of a light, and to all of it as if nothing
    /// were in between, both by the same points on it: those of `range`.
    fn shadow_rays(
        &self,
        scene: &Scene,
        point: &GatherPoint,
        light: u32,
        range: Range<u32>,
        rotation: f64,
    ) -> Visible {
        let Light { triangles, surface, .. } = &self.lights.lights[light as usize];
        let area = surface.total_area();
        let mut out = Visible { points: f64::from(range.end - range.start), ..Default::default() };
        // Both coordinates are rotated: where only a strip of the light is seen, points that are
        // the same for all places would be off in the same direction everywhere.
        let second_rotation = (rotation * SECOND_ROTATION).fract();
        for i in range {
            let [x, y] = sobol_02_point(i);
            let (k, across) = surface.locate((x + second_rotation).fract());
            let triangle = triangles[k] as usize;
            let [a, b, c] = scene.corners(triangle);
            // Uniform over a triangle (Pharr, Jakob, Humphreys 2016, 13.6.5).
            let (root, v) = (across.sqrt(), (y + rotation).fract());
            let target = a * (1.0 - root) + (b * (1.0 - v) + c * v) * root;
            let is_hole = !scene.is_solid(triangle, [root * (1.0 - v), root * v]);
            let to = target - point.position;
            let facing = -scene.normal(triangle).dot(to);
            let above = point.normal.dot(to);
            if facing <= 0.0 || above <= 0.0 {
                continue;
            }
            let r2 = to.length_squared();
            let factor = area * facing * above / (PI * r2 * r2);
            out.all += factor;
            // What is met first may be another part of the light, which is as good.
            let near = point.near / r2.sqrt();
            let other = |h: &Hit| !(self.lights.of_triangle[h.triangle] == light && h.front);
            let reach = near..1.0 - offset::SEGMENT_END;
            if !is_hole && !self.scene.occluded(point.position, to, reach.clone(), other) {
                out.seen += factor * self.panes.transmittance(point.position, to, reach);
            }
        }
        out
    }
}

/// Directions of `max_rays` rays in `scene`, of which `min_rays` are cast at least. Under a sky
/// that is brighter above than at its sides all places would be off alike by rays that are nearer
/// to the normal than they should.
fn samples(scene: &Scene, max_rays: u32, min_rays: u32) -> HemisphereSamples {
    match scene.sky().uniform_radiance() {
        Some(_) => HemisphereSamples::progressive(max_rays),
        None => HemisphereSamples::centred(max_rays, min_rays),
    }
}

/// Sums over rays.
#[derive(Debug)]
struct RaySums<const FIELDS: usize> {
    /// Without what surfaces reflect.
    hemisphere: IrradianceSample,
    /// What surfaces reflect, by field.
    reflected: [Rgb; FIELDS],
    /// The largest radiosity that one ray found, reflected by the first field or the sky's, W/m².
    max_contribution: f64,
    lights: Vec<Visible>,
    /// Cosines instead of form factors.
    sun: Visible,
}

/// Sums of form factors over points on a light.
#[derive(Debug, Default)]
struct Visible {
    points: f64,
    /// To those that are visible; per channel, what panes let through.
    seen: Rgb,
    /// To all that are above the horizon and face the point.
    all: f64,
}

impl<const FIELDS: usize> Default for RaySums<FIELDS> {
    fn default() -> RaySums<FIELDS> {
        RaySums {
            hemisphere: IrradianceSample::default(),
            reflected: [Rgb::ZERO; FIELDS],
            max_contribution: 0.0,
            lights: vec![],
            sun: Visible::default(),
        }
    }
}

impl<const FIELDS: usize> RaySums<FIELDS> {
    fn add(&mut self, other: &RaySums<FIELDS>) {
        let (sum, term) = (&mut self.hemisphere, &other.hemisphere);
        sum.irradiance += term.irradiance;
        sum.escaped += term.escaped;
        sum.backface += term.backface;
        sum.inverse_distance += term.inverse_distance;
        for (sum, term) in self.reflected.iter_mut().zip(other.reflected) {
            *sum += term;
        }
        self.max_contribution = self.max_contribution.max(other.max_contribution);
        for (sum, term) in self.lights.iter_mut().zip(&other.lights) {
            sum.add(term);
        }
        self.sun.add(&other.sun);
    }
}

/// The shadow rays that go with the rays of `range`.
fn shadow_range(range: Range<u32>) -> Range<u32> {
    range.start / RAYS_PER_SHADOW_RAY..range.end.div_ceil(RAYS_PER_SHADOW_RAY)
}

impl Visible {
    /// What one unit of `seen` counts: a share of the form factor of all of the light where that is
    /// known by closed form, else of the points.
    fn share_of(&self, unoccluded: Option<f64>) -> f64 {
        match unoccluded {
            Some(factor) => factor / self.all.max(1e-300),
            None => 1.0 / self.points.max(1.0),
        }
    }

    fn add(&mut self, other: &Visible) {
        self.points += other.points;
        self.seen += other.seen;
        self.all += other.all;
    }
}

impl Gather for RayGather {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        Ok(places.par_iter().map(|p| self.irradiance([sources], p)[0]).collect())
    }

    fn gather_both(
        &mut self,
        sources: [&RadiosityField; 2],
        places: &[GatherPoint],
    ) -> Result<[Vec<IrradianceSample>; 2], Error> {
        let both = places.par_iter().map(|p| self.irradiance(sources, p).into());
        let (first, second) = both.unzip::<IrradianceSample, IrradianceSample, _, _>();
        Ok([first, second])
    }
}
