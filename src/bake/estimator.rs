//! Random points that observe how far off a result is.
//!
//! Points are spread over the groups of the scene, and over the reflecting area of each: a quarter
//! of them uniformly, a quarter uniformly over octaves of distance, and half in proportion to the
//! expected error of elements relative to their darkest corner, since a small area has most of the
//! squared error: by their residuals, or by a jump of the light between their corners. Each point
//! gathers the sources of the result twice, the second time 0.1 % of the element's size beside,
//! where rays and hemicubes have another rotation; and once the result itself. The
//! [statistics](super::error_estimate) of these are the estimate; the share of each vertex follows
//! the residuals of the elements around it.

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::accuracy::Measure;
use crate::accuracy::hidden::LitRegion;
use crate::accuracy::tail::trimmed;
use crate::bake::controller::TargetErrors;
use crate::bake::error_estimate::{
    self, AVERAGED_VARIANCE, Conditions, ErrorEstimate, ErrorSpread, Estimate, GroupError,
    Observation, Stratum,
};
use crate::bake::model;
use crate::bake::strata::{SampleCounts, SampledPart, strata_of};
use crate::error::Error;
use crate::gather::gather_points::{SurfaceOffset, outlook};
use crate::gather::refinement_indicator::RMS_OVER_JUMP;
use crate::gather::two_sided::{TwoSidedPoint, gather_both_two_sided, gather_two_sided};
use crate::gather::{Gather, GatheredMesh, IrradianceSample, RadiosityField};
use crate::light::{PathTracer, SurfacePoint as PathStart};
use crate::sampling::low_discrepancy::golden_ratio_order;
use crate::sampling::octaves::{Octaves, Part};
use crate::sampling::random::random_numbers;
use crate::sampling::rotation::CellRotation;
use crate::sampling::surface::{AreaSampler, SurfacePoint, shifted};
use crate::scene::{Rgb, Scene};
use crate::solver::Ledger;
use crate::visibility::ray_scene::Hit;
use crate::work::Batches;

/// Reflected radiosity at and below which there is none in `scene`, W/m²: 1e-12 of the largest
/// exitance, ten thousand times the rounding of their sum.
pub(super) fn negligible_reflection(scene: &Scene) -> f64 {
    let brightest = scene.materials().iter().map(|m| m.exitance.length()).fold(0.0, f64::max);
    (1e-12 * brightest).max(f64::MIN_POSITIVE)
}

/// Whether an estimate continues after `samples` points: of a bake that was stopped, up to the
/// minimum of any other; not where it `is_late`.
pub(super) fn goes_on(stopped: bool, is_late: bool, samples: usize) -> ControlFlow<()> {
    let enough = stopped && samples >= model::MIN_SAMPLES;
    if enough || is_late { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

/// A result whose error is to be estimated.
pub(super) struct ErrorEstimator<'a> {
    /// The result: what vertices gathered, or the elements' own light.
    pub light: &'a GatheredMesh,
    /// What vertices gathered it from; none if it is the elements' own light.
    pub lit_by: Option<RadiosityField<'a>>,
    /// What the middle of each element may be off by, up to a common factor, W/m².
    pub element_residual: &'a [f64],
    pub ledger: &'a Ledger,
    /// Bounces of what was shot that vertices have gathered.
    pub bounces: f64,
    /// Which errors count.
    pub measure: Measure,
    /// Where the light is.
    pub region: LitRegion,
    /// Over which points are spread.
    pub octaves: &'a Octaves,
    /// Reflected radiosity below which errors are relative to this instead, W/m²; replaced by that
    /// of the points.
    pub expected_floor: f64,
    /// Follows paths through the scene; not needed for the elements' own light.
    pub paths: Option<&'a PathTracer<'a>>,
}

/// The estimated error of a result.
#[derive(Clone)]
pub(super) struct EstimatedError {
    pub whole: ErrorEstimate,
    /// The whole, by light instead of area.
    pub by_light: ErrorEstimate,
    /// Group by group; those too small to have points of their own are not in it.
    pub groups: Vec<GroupError>,
    /// Standard error of each vertex, W/m².
    pub vertices: Vec<f64>,
}

/// Noise and floor by a few points, before any vertex has gathered.
pub(super) struct Pilot {
    /// Root mean square error, relative, of what vertices interpolate to because the gatherer casts
    /// so many rays and not more.
    pub sampling: f64,
    /// Reflected radiosity below which errors are relative to this instead, W/m².
    pub radiosity_floor: f64,
    /// The reflected radiosity that, if all surfaces had it, would have the least error, W/m² per
    /// channel.
    pub even: Rgb,
}

impl EstimatedError {
    /// The errors that are compared with a target.
    pub fn errors(&self) -> TargetErrors<'_> {
        TargetErrors { whole: &self.whole, by_light: &self.by_light, groups: &self.groups }
    }
}

/// A random point of the surface.
struct Sample {
    stratum: usize,
    /// Share of the stratum's area that it stands for.
    weight: f64,
    element: usize,
    albedo: Rgb,
    point: TwoSidedPoint,
    on_surface: PathStart,
    /// Step to the centroid of the face, scene unit.
    inward: DVec3,
    /// Reflected radiosity that the vertices interpolate to, W/m².
    interpolated: Rgb,
    /// Square root of the element's area, scene unit.
    size: f64,
    /// Rotation of the cell that the point is in, in [0, 1).
    rotation: f64,
}

/// What was gathered at a sample.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct SampleGathers {
    first: IrradianceSample,
    second: IrradianceSample,
    next: IrradianceSample,
    /// See [`Observation::later`].
    later: Rgb,
}

impl ErrorEstimator<'_> {
    /// Gathers at random points, and gives the estimate. `progress` gets the number of points done
    /// and in total, and may stop: the estimate is by those done.
    pub fn estimate(
        &self,
        counts: SampleCounts,
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<EstimatedError, Error> {
        let (mut strata, observations) = self.observe(counts, gatherer, progress)?;
        let radiosity_floor = self.floor(&observations, &strata);
        let unshot_bound = self.unshot(radiosity_floor, &mut strata);
        let conditions = Conditions {
            strata: &strata,
            floor: self.measure.floor,
            tail: self.measure.tail,
            radiosity_floor,
            mean_albedo: self.light.mesh.mean_albedo().max_element(),
            bounces: self.lit_by.map(|_| self.bounces),
            unshot_bound,
        };
        let estimate = error_estimate::estimate(&observations, &conditions);
        let vertices = self.vertex_errors(estimate.spread);
        let Estimate { whole, by_light, groups, .. } = estimate;
        Ok(EstimatedError { whole, by_light, groups, vertices })
    }

    /// What is observed at random points, and the strata that they stand for.
    fn observe(
        &self,
        counts: SampleCounts,
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<(Vec<Stratum>, Vec<Observation>), Error> {
        let floor = self.at_least_negligible(self.expected_floor);
        let (strata, samples) = self.samples(counts, floor);
        let gathers = self.gather(&samples, gatherer, progress)?;
        let observed = samples.iter().zip(&gathers);
        let observations = observed
            .filter_map(|(sample, gathers)| Some(sample.observation(self, gathers.as_ref()?)));
        let observations = observations.collect();
        Ok((strata, observations))
    }

    /// Noise and floor by `count` points.
    pub fn pilot(&self, count: usize, gatherer: &mut dyn Gather) -> Result<Pilot, Error> {
        let counts = SampleCounts { total: count, per_group: model::SAMPLES_PER_GROUP };
        let mut proceed = |_, _| ControlFlow::Continue(());
        let (strata, observations) = self.observe(counts, gatherer, &mut proceed)?;
        let radiosity_floor = self.floor(&observations, &strata);
        // Of Σ w |c − B|²/m², over the points, the minimum is at c = Σ w B/m² / Σ w/m².
        let (mut even, mut weights) = (Rgb::ZERO, 0.0);
        // Areas, light per area, and squared differences.
        let mut points = vec![];
        for observation in observations.iter().filter(|observation| !observation.excluded) {
            let [a, b] = observation.gathered;
            let mean = (a + b) / 2.0;
            let area = observation.weight * strata[observation.stratum].area;
            let weight = area / mean.length().max(radiosity_floor).powi(2);
            even += weight * mean;
            weights += weight;
            let light = a.length().max(observation.interpolated.length());
            let square = ((a - b) / light.max(radiosity_floor)).length_squared() / 2.0;
            points.push((area, light, square));
        }
        let errors: Vec<(f64, f64)> =
            points.iter().map(|&(area, _, square)| (area, square)).collect();
        let kept = trimmed(&errors, self.measure.tail).kept;
        // By area and by light: the larger, so that a dark plane does not hide a lit room.
        let mean = |weigh: fn(f64, f64) -> f64| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for (&(area, light, square), kept) in points.iter().zip(&kept) {
                let weight = weigh(kept * area, light);
                sum += weight * square;
                weights += weight;
            }
            if weights > 0.0 { sum / weights } else { 0.0 }
        };
        let square = mean(|area, _| area).max(mean(|area, light| area * light));
        let sampling = (AVERAGED_VARIANCE * square).sqrt();
        let even = if weights > 0.0 { even / weights } else { Rgb::ZERO };
        Ok(Pilot { sampling, radiosity_floor, even })
    }

    /// Reflected radiosity below which errors are relative to this instead, W/m²: by what was
    /// observed. Where next to nothing is reflected, rounding of what is emitted is no error.
    fn floor(&self, observations: &[Observation], strata: &[Stratum]) -> f64 {
        let observed = error_estimate::mean_reflected(observations, strata)
            .map(|mean| self.measure.floor * mean);
        self.at_least_negligible(observed.unwrap_or(self.expected_floor))
    }

    fn at_least_negligible(&self, floor: f64) -> f64 {
        floor.max(negligible_reflection(self.light.mesh.scene()))
    }

    /// What the middle of `element` may be off by, up to a common factor, W/m².
    fn residual(&self, element: usize) -> f64 {
        self.element_residual.get(element).copied().unwrap_or(0.0)
    }

    /// What lights the vertices.
    fn sources(&self) -> RadiosityField<'_> {
        self.lit_by.unwrap_or_else(|| self.light.radiosity_field())
    }

    /// Gathers at `samples` in an order whose first few are spread over all; none for those that
    /// are not reached.
    fn gather(
        &self,
        samples: &[Sample],
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Vec<Option<SampleGathers>>, Error> {
        let sources = self.sources();
        let mut gathers = vec![None; samples.len()];
        let order = golden_ratio_order(samples.len());
        let mut remaining = &order[..];
        // Three gathers a point, and paths.
        let mut batches = Batches::new((gatherer.preferred_batch_len() / 16).max(1));
        while !remaining.is_empty() {
            let (batch, found) = batches.try_next(&mut remaining, |batch| {
                let points: Vec<TwoSidedPoint> = batch.iter().map(|&k| samples[k].point).collect();
                let jittered: Vec<TwoSidedPoint> =
                    batch.iter().map(|&k| samples[k].jittered()).collect();
                let [first, next] = match self.lit_by {
                    Some(_) => {
                        let fields = [&sources, &self.light.radiosity_field()];
                        gather_both_two_sided(gatherer, fields, &points)?
                    }
                    None => {
                        let first = gather_two_sided(gatherer, &sources, &points)?;
                        [first.clone(), first]
                    }
                };
                let later: Vec<Rgb> =
                    batch.par_iter().map(|&k| self.later(&samples[k], k)).collect();
                let second = gather_two_sided(gatherer, &sources, &jittered)?;
                let of_point = |i: usize| SampleGathers {
                    first: first[i],
                    second: second[i],
                    next: next[i],
                    later: later[i],
                };
                Ok::<_, Error>((0..batch.len()).map(of_point).collect())
            })?;
            for (&k, found) in batch.iter().zip(found) {
                gathers[k] = Some(found);
            }
            if progress(samples.len() - remaining.len(), samples.len()).is_break() {
                break;
            }
        }
        Ok(gathers)
    }

    /// What bounces after the next one would add at the `k`th sample, by some paths, W/m²: with
    /// L = E + ρF S gathered from S they add Σ (ρF)ⁿ (L − S) over n ≥ 2.
    fn later(&self, sample: &Sample, k: usize) -> Rgb {
        let (Some(lit_by), Some(paths)) = (self.lit_by, self.paths) else { return Rgb::ZERO };
        let fields = [self.light.radiosity_field(), lit_by];
        let change = |hit: &Hit| {
            let [now, before] = fields.map(|field| field.reflected_at(hit.triangle, hit.u, hit.v));
            now - before
        };
        let mut rng = random_numbers(&[k as u64]);
        let path = |_| paths.later_bounces(change, &sample.on_surface, &mut rng);
        // Noise is averaged over all points.
        let paths_per_point = 16;
        (0..paths_per_point).map(path).sum::<Rgb>() / f64::from(paths_per_point)
    }

    /// Points spread over groups and over the faces of each that reflect, and the strata
    /// that they stand for. Residuals are relative to no less than `floor`, W/m².
    fn samples(&self, counts: SampleCounts, floor: f64) -> (Vec<Stratum>, Vec<Sample>) {
        let mut parts = self.parts(floor);
        let scene = self.light.mesh.scene();
        let placement = Placement {
            light: self.light,
            above: SurfaceOffset::new(scene),
            rotations: CellRotation::new(&scene.bounds()),
        };
        let (mut samples, mut strata) = (vec![], vec![]);
        for (k, stratum) in strata_of(&mut parts, counts).into_iter().enumerate() {
            let parts = &parts[stratum.parts];
            let sum = |of: fn(&SampledPart) -> f64| parts.iter().map(of).sum::<f64>();
            let (error, angular) = (sum(|part| part.error), sum(|part| part.part.angular));
            let density = |part: &SampledPart| {
                let by_area = part.part.area / stratum.area;
                let even = (by_area + part.part.angular / angular) / 2.0;
                if error > 0.0 { (even + part.error / error) / 2.0 } else { even }
            };
            let sampler = AreaSampler::new(parts.iter().map(density));
            let points = sampler.spread(stratum.samples, 0.5);
            samples.extend(points.filter_map(|SurfacePoint { triangle, barycentric }| {
                let part = &parts[triangle];
                let area = part.part.area / density(part);
                let weight = area / stratum.area / stratum.samples as f64;
                placement.sample(k, weight, part, barycentric)
            }));
            strata.push(Stratum { group: stratum.group, area: stratum.area, ambient: 0.0 });
        }
        (strata, samples)
    }

    /// The faces that reflect, in parts by octaves of distance; residuals are relative to no less
    /// than `floor`, W/m².
    fn parts(&self, floor: f64) -> Vec<SampledPart> {
        let faces = (0..self.light.surface.faces.len()).into_par_iter();
        let with_parts_of = |mut parts: Vec<SampledPart>, face: usize| {
            self.add_parts(&mut parts, face, floor);
            parts
        };
        faces.fold(Vec::new, with_parts_of).flatten_iter().collect()
    }

    /// Adds the parts of a `face`, if it reflects.
    fn add_parts(&self, parts: &mut Vec<SampledPart>, face: usize, floor: f64) {
        let (surface, mesh) = (&self.light.surface, &self.light.mesh);
        let element = surface.elements[face] as usize;
        let node = mesh.element(element);
        if !mesh.scatters(node) {
            return;
        }
        let light = self.light.corners[element].map(|v| self.light.reflected[v as usize]);
        let reflected = (light.iter().sum::<Rgb>() / 3.0).length();
        let [a, b, c] = light.map(Rgb::length);
        let (darkest, brightest) = (a.min(b).min(c), a.max(b).max(c));
        let jump = RMS_OVER_JUMP * (brightest - darkest);
        let expected = |residual: &f64| residual.max(jump) / darkest.max(floor);
        let error = self.element_residual.get(element).map_or(0.0, expected);
        let solid = mesh.solid_share(node);
        let mut add = |part: Part| {
            let (error, flux) = (part.area * error, part.area * reflected);
            let (face, group) = (face as u32, mesh.group(node));
            parts.push(SampledPart { face, group, part, error, flux });
        };
        let corners = surface.faces[face].map(|v| surface.positions[v as usize]);
        let [a, b, c] = corners;
        let area = solid * ((b - a).cross(c - a).length() / 2.0);
        self.octaves.for_each_part(corners, area, solid < 1.0, &mut add);
    }

    /// Fills in the mean square of the ambient term over the radiosity, or over `floor` (W/m²)
    /// where that is more, of each of `strata`; and gives [`ErrorEstimate::unshot_bound`].
    fn unshot(&self, floor: f64, strata: &mut [Stratum]) -> f64 {
        let sources = self.sources();
        let mesh = sources.mesh;
        let ambient_irradiance = self.ledger.add_ambient(mesh, &mut []);
        let groups = mesh.scene().groups().len().max(1);
        let (mut squares, mut areas) = (vec![0.0; groups], vec![0.0; groups]);
        let mut flux = Rgb::ZERO;
        let mut max_albedo = Rgb::ZERO;
        for e in 0..mesh.element_count() {
            let node = mesh.element(e);
            let material = mesh.material(node);
            if !mesh.scatters(node) {
                continue;
            }
            let corners = sources.corners[e].iter().map(|&v| sources.reflected[v as usize]);
            let reflected = corners.sum::<Rgb>() / 3.0;
            let (element_area, group) = (mesh.solid_area(node), mesh.group(node) as usize);
            let ambient = material.albedo() * ambient_irradiance;
            let scale = (reflected + ambient).length().max(floor);
            squares[group] += (ambient.length() / scale).powi(2) * element_area;
            areas[group] += element_area;
            let reflected = reflected * mesh.relative_reflectance(e);
            flux += (reflected + mesh.exitance(e)) * element_area;
            max_albedo = max_albedo.max(mesh.albedo(e));
        }
        let mean = |squares: f64, area: f64| if area > 0.0 { squares / area } else { 0.0 };
        let whole = mean(squares.iter().sum(), areas.iter().sum());
        for stratum in strata {
            let group = stratum.group.map(|g| g as usize);
            stratum.ambient = group.map_or(whole, |g| mean(squares[g], areas[g]));
        }
        // Every bounce keeps at most the largest albedo.
        let bound = self.ledger.unshot * max_albedo / (Rgb::ONE - max_albedo) / flux;
        if flux == Rgb::ZERO { 0.0 } else { bound.max_element() }
    }

    /// Standard error of each vertex of the surface, W/m²: that of the mesh by the residuals of the
    /// elements around it, weighted by area, and the others in proportion to its radiosity.
    fn vertex_errors(&self, spread: ErrorSpread) -> Vec<f64> {
        let surface = &self.light.surface;
        let mut sums = vec![(0.0, 0.0); surface.positions.len()];
        for (face, &e) in surface.faces.iter().zip(&surface.elements) {
            let (e, mesh) = (e as usize, &self.light.mesh);
            let area = mesh.weight(mesh.element(e));
            let residual =
                self.element_residual[e] * (mesh.relative_reflectance(e).element_sum() / 3.0);
            for &v in face {
                sums[v as usize].0 += area * residual.powi(2);
                sums[v as usize].1 += area;
            }
        }
        let vertex_error = |((sum, area), radiosity): ((f64, f64), &Rgb)| {
            let residual = if area > 0.0 { sum / area } else { 0.0 };
            let mesh = residual * spread.per_residual * spread.per_residual;
            let even = (spread.even * radiosity.length()).powi(2);
            // For 95 % of the vertices to be off by no more than twice this: the tails of errors
            // are heavier than normal (1.8), and estimates leave out the tail of the area (1.12).
            2.0 * (mesh + even).sqrt()
        };
        sums.into_iter().zip(&surface.radiosity).map(vertex_error).collect()
    }
}

/// Places samples on the faces of a result.
struct Placement<'a> {
    light: &'a GatheredMesh,
    above: SurfaceOffset,
    rotations: CellRotation,
}

impl Placement<'_> {
    /// The sample at, or next to, a `barycentric` point of `part`; none where that is in a hole.
    fn sample(
        &self,
        stratum: usize,
        weight: f64,
        part: &SampledPart,
        barycentric: [f64; 2],
    ) -> Option<Sample> {
        let (surface, mesh) = (&self.light.surface, &self.light.mesh);
        let element = surface.elements[part.face as usize] as usize;
        let face = &surface.faces[part.face as usize];
        let (node, corners) = (mesh.element(element), face.map(|v| surface.positions[v as usize]));
        let at = |[u, v]: [f64; 2]| move |[a, b, c]: [DVec3; 3]| a * (1.0 - u - v) + b * u + c * v;
        // Off the sides, where walls meet and what is seen is undefined.
        let inset = |point: [f64; 2]| point.map(|b| b + (1.0 / 3.0 - b) * 0.03);
        let in_face = |point| part.part.place(inset(point));
        let is_solid = |&point: &[f64; 2]| mesh.is_solid(node, at(point)(corners));
        let [u, v] = shifted(barycentric).map(in_face).find(is_solid)?;
        let mix = at([u, v]);
        let (material, size, position) =
            (mesh.material(node), mesh.area(node).sqrt(), mix(corners));
        // Next to a side, another surface may be nearer than what a point of this size sees.
        let inset = 3.0 * u.min(v).min(1.0 - u - v);
        let point = self.above.gather_point(position, mesh.normal(node), size * inset);
        let interpolated = |values: &[Rgb]| mix(face.map(|v| values[v as usize]));
        Some(Sample {
            stratum,
            weight,
            element,
            albedo: material.albedo(),
            point: TwoSidedPoint::new(point, material),
            on_surface: PathStart { triangle: mesh.triangle(node), position },
            inward: corners.iter().sum::<DVec3>() / 3.0 - position,
            // Of the light, whatever textures are.
            interpolated: match mesh.scene().has_textures() {
                true => material.albedo() * interpolated(&surface.irradiance),
                false => interpolated(&surface.radiosity) - material.exitance,
            },
            size,
            rotation: self.rotations.at(point.position, point.near),
        })
    }
}

impl Sample {
    /// Reflected radiosity of the point by what was gathered there, W/m².
    fn reflected(&self, gathered: &IrradianceSample) -> Rgb {
        self.albedo * gathered.irradiance
    }

    fn observation(&self, estimator: &ErrorEstimator, gathers: &SampleGathers) -> Observation {
        let SampleGathers { first, second, next, later } = gathers;
        Observation {
            stratum: self.stratum,
            weight: self.weight,
            interpolated: self.interpolated,
            gathered: [self.reflected(first), self.reflected(second)],
            next: self.reflected(next),
            later: *later,
            element_residual: estimator.residual(self.element),
            excluded: outlook(
                [first, second],
                self.point.point.normal,
                estimator.light.mesh.scene().sky(),
            )
            .is_hidden(&estimator.region, self.point.point.position),
            escaped: first.escaped,
        }
    }

    /// The point of the second gather.
    fn jittered(&self) -> TwoSidedPoint {
        self.point.beside(self.inward, self.size, self.rotation)
    }
}

#[cfg(test)]
mod tests;
