//! RefinementSettings with rays on the CPU: a second opinion, and what runs without a GPU.

use std::f64::consts::PI;
use std::ops::Range;

use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::gather::light_projection::LightProjection;
use crate::gather::lights::{Light, Lights, NO_LIGHT};
use crate::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use crate::mesh::Mesh;
use crate::sampling::hemisphere::{self, HemisphereSamples};
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::rotation::CellRotation;
use crate::scene::Scene;
use crate::visibility::offset;
use crate::visibility::ray_scene::{Hit, RayScene};

/// Gathers by casting cosine-distributed rays, and rays to points on each light.
///
/// Every ray carries the same share of the hemisphere, so what reflected light it finds has the
/// error of an average over n stratified samples. A light's irradiance is its closed form times the
/// share of it that a quarter as many rays find visible, weighted by their form factors.
#[derive(Debug)]
pub struct RayGather {
    rays: RayScene,
    lights: Lights,
    turns: CellRotation,
    fan: HemisphereSamples,
    /// RayScene a place: at least and at most.
    least: u32,
    most: u32,
    /// How much half of the rays may differ from all, as a share of the irradiance, and the irradiance
    /// that is taken for none.
    noise: f64,
    dim: f64,
}

/// RayScene for a place where they disagree, for one where they do not.
const MORE: u32 = 16;

/// RayScene over the hemisphere for one to a light.
const A_LIGHT: u32 = 4;

impl RayGather {
    /// About `count` rays a place over the triangles of `mesh`'s scene: the nearest power of two.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(mesh: &Mesh, count: u32) -> Result<RayGather, Error> {
        if count == 0 || count > hemisphere::MAX_RAYS {
            let place = format!("{count} rays a place");
            let remedy = format!("use 1 to {}", hemisphere::MAX_RAYS);
            return Err(Error::new(ErrorKind::Setting, place, "not usable", remedy));
        }
        let least = 1 << f64::from(count).log2().round().max(1.0) as u32;
        let (rays, lights) = (RayScene::of_scene(mesh.scene()), Lights::new(mesh.shared_scene()));
        let (fan, noise, dim) = (HemisphereSamples::progressive(least), f64::INFINITY, 0.0);
        let turns = CellRotation::new(&mesh.scene().bounds());
        Ok(RayGather { rays, lights, turns, fan, least, most: least, noise, dim })
    }

    /// Twice as many rays where half of them find more or less than all by over a share `noise` of the
    /// irradiance, or of `dim` (W/m²) where there is less, or where half of what the luckiest ray found
    /// is as much; and so on, up to 16 times as many. That is for seldom places, such as those that see
    /// a bright spot through a gap.
    pub fn with_noise(self, noise: f64, dim: f64) -> RayGather {
        let most = if noise.is_finite() {
            (self.least * MORE).min(hemisphere::MAX_RAYS)
        } else {
            self.least
        };
        RayGather { fan: HemisphereSamples::progressive(most), most, noise, dim, ..self }
    }

    fn at(&self, sources: &RadiosityField, place: &GatherPoint) -> IrradianceSample {
        let mut apart = self.lights.importance_ranked(place);
        // Without a closed form, what reaches far around is seen better by the rays over the hemisphere
        // than by points spread over its area.
        apart.retain(|&(light, _)| {
            let light = &self.lights.lights[light as usize];
            let corner = |&t: &u32| sources.mesh.scene().corners(t as usize);
            light.convex
                || LightProjection::new(place, light.triangles.iter().map(corner)).is_some()
        });
        let look = |range| self.look(sources, place, &apart, range);
        let (mut count, mut known) = (self.least, look(0..self.least / 2));
        loop {
            let more = look(count / 2..count);
            let [half, other] = [&known, &more].map(|seen| self.found(seen, &apart, count / 2));
            known.add(&more);
            let all = self.found(&known, &apart, count);
            // Stratified halves may miss the same; then by as much as one ray finds.
            let off = half.irradiance.distance(other.irradiance).max(known.most / f64::from(count));
            if off / 2.0 <= self.noise * all.irradiance.length().max(self.dim) || count == self.most
            {
                return all;
            }
            count *= 2;
        }
    }

    /// What a part of the rays see.
    fn look(
        &self,
        sources: &RadiosityField,
        place: &GatherPoint,
        apart: &[(u32, f64)],
        range: Range<u32>,
    ) -> RaySums {
        let turn = self.turns.at(place.position, place.near);
        let is_apart = |light: u32| apart.iter().any(|&(k, _)| k == light);
        let mut seen = RaySums::default();
        let out = &mut seen.around;
        for direction in self.fan.directions_in(range.clone(), place.normal, turn) {
            let Some(hit) = self.rays.closest_hit(place.position, direction, place.near, None)
            else {
                out.escaped += 1.0;
                continue;
            };
            out.inverse_distance += 1.0 / hit.distance;
            if !hit.front {
                out.backface += 1.0;
                continue;
            }
            let reflected = sources.reflected_at(hit.triangle, hit.u, hit.v);
            out.irradiance += reflected;
            seen.most = seen.most.max(reflected.length());
            let light = self.lights.of_triangle[hit.triangle];
            if light != NO_LIGHT && !is_apart(light) {
                out.irradiance += self.lights.lights[light as usize].exitance;
            }
        }
        let range = range.start / A_LIGHT..range.end.div_ceil(A_LIGHT);
        let visible = |&(light, _): &(u32, f64)| {
            self.visible(sources.mesh.scene(), place, light, range.clone(), turn)
        };
        seen.lights = apart.iter().map(visible).collect();
        seen
    }

    /// What was found by `count` rays.
    fn found(&self, seen: &RaySums, apart: &[(u32, f64)], count: u32) -> IrradianceSample {
        let (share, mut out) = (1.0 / f64::from(count), seen.around);
        out.irradiance *= share;
        [&mut out.escaped, &mut out.backface, &mut out.inverse_distance]
            .into_iter()
            .for_each(|x| *x *= share);
        for (&(light, factor), visible) in apart.iter().zip(&seen.lights) {
            let light = &self.lights.lights[light as usize];
            let share = match light.convex {
                true => factor / visible.all.max(1e-300),
                false => 1.0 / visible.points.max(1.0),
            };
            out.direct += light.exitance * visible.seen * share;
        }
        out.irradiance += out.direct;
        out
    }

    /// The form factor from `place` to what is visible of a light, and to all of it as if nothing
    /// were in between, both by the same points on it: those of `range`.
    fn visible(
        &self,
        scene: &Scene,
        place: &GatherPoint,
        light: u32,
        range: Range<u32>,
        turn: f64,
    ) -> Visible {
        let Light { triangles, surface, .. } = &self.lights.lights[light as usize];
        let area = surface.total_area();
        let mut out = Visible { points: f64::from(range.end - range.start), ..Default::default() };
        for i in range {
            let [x, y] = sobol_02_point(i);
            let (k, across) = surface.locate(x);
            let triangle = triangles[k] as usize;
            let [a, b, c] = scene.corners(triangle);
            // Uniform over a triangle (Pharr, Jakob, Humphreys 2016, 13.6.5).
            let (root, v) = (across.sqrt(), (y + turn).fract());
            let point = a * (1.0 - root) + (b * (1.0 - v) + c * v) * root;
            let to = point - place.position;
            let facing = -scene.normal(triangle).dot(to);
            let above = place.normal.dot(to);
            if facing <= 0.0 || above <= 0.0 {
                continue;
            }
            let r2 = to.length_squared();
            let factor = area * facing * above / (PI * r2 * r2);
            out.all += factor;
            // What is met first may be another part of the light, which is as good.
            let near = place.near / r2.sqrt();
            let other = |h: &Hit| !(self.lights.of_triangle[h.triangle] == light && h.front);
            let blocked =
                self.rays.occluded(place.position, to, near..1.0 - offset::SEGMENT_END, other);
            out.seen += if blocked { 0.0 } else { factor };
        }
        out
    }
}

/// Sums over rays.
#[derive(Debug, Default)]
struct RaySums {
    around: IrradianceSample,
    /// The brightest that a ray found, W/m².
    most: f64,
    lights: Vec<Visible>,
}

/// Sums of form factors over points on a light.
#[derive(Debug, Default)]
struct Visible {
    points: f64,
    /// To those that are visible.
    seen: f64,
    /// To all that are above the horizon and face the place.
    all: f64,
}

impl RaySums {
    fn add(&mut self, other: &RaySums) {
        let (sum, more) = (&mut self.around, &other.around);
        sum.irradiance += more.irradiance;
        sum.escaped += more.escaped;
        sum.backface += more.backface;
        sum.inverse_distance += more.inverse_distance;
        self.most = self.most.max(other.most);
        for (sum, more) in self.lights.iter_mut().zip(&other.lights) {
            sum.points += more.points;
            sum.seen += more.seen;
            sum.all += more.all;
        }
    }
}

impl Gather for RayGather {
    fn gather(
        &mut self,
        sources: &RadiosityField,
        places: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        Ok(places.par_iter().map(|p| self.at(sources, p)).collect())
    }
}
