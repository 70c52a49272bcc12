//! Random points that observe how far off a result is.
//!
//! Points are spread evenly over the area of the result's faces. Each gathers twice what lit the
//! result, the second time from a hair beside, where rays and hemicubes are rotated otherwise; and
//! once the result itself. The [statistics](super::error_estimate) of that are the estimate; the
//! share of each vertex follows the residuals of the elements around it.

use std::ops::ControlFlow;

use glam::DVec3;

use crate::bake::error_estimate::{
    self, Conditions, ErrorEstimate, ErrorSpread, Observation, radiosity_floor,
};
use crate::bake::model;
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::gather::gather_points::{SurfaceOffset, is_buried};
use crate::gather::{Gather, GatherPoint, IrradianceSample};
use crate::progress::BatchSizer;
use crate::sampling::low_discrepancy::golden_ratio_order;
use crate::sampling::rotation::CellRotation;
use crate::sampling::surface::{AreaSampler, SurfacePoint};
use crate::scene::Rgb;
use crate::solver::Ledger;

/// Points that are gathered at before progress is reported first: a bake that is stopped uses
/// these.
const FIRST_BATCH: usize = 16;

/// How far beside a point it gathers again, in units of the element's size; up to 1.5 times as far.
/// Small enough that the light is the same, large enough to be another cell of the rotation.
const JITTER: f64 = 1e-3;

/// A result whose error is to be estimated.
pub(super) struct ErrorEstimator<'a> {
    /// The result: what vertices gathered, or the elements' own light.
    pub light: &'a GatheredMesh,
    /// What vertices gathered it from; none if it is the elements' own light.
    pub lit_by: Option<&'a GatheredMesh>,
    /// What the middle of each element may be off by, up to a common factor, W/m².
    pub element_residual: &'a [f64],
    pub ledger: &'a Ledger,
    /// Times that all vertices have gathered.
    pub gather_passes: u32,
}

/// A random point of the surface.
struct Sample {
    element: usize,
    reflectance: Rgb,
    point: GatherPoint,
    /// Radiosity that the vertices interpolate to, W/m².
    interpolated: Rgb,
    emitted: Rgb,
    /// Square root of the element's area, scene unit.
    size: f64,
    /// Rotation of the cell that the point is in, in [0, 1).
    rotation: f64,
}

/// What was gathered at a sample.
#[derive(Clone, Copy)]
struct SampleGathers {
    first: IrradianceSample,
    second: IrradianceSample,
    next: IrradianceSample,
}

impl ErrorEstimator<'_> {
    /// Gathers at `count` random points, and gives the estimate and the standard error of each
    /// vertex, W/m². `progress` is told how many points are done, and may stop: they are enough
    /// then.
    pub fn estimate(
        &self,
        count: usize,
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<(ErrorEstimate, Vec<f64>), Error> {
        let samples = self.samples(count);
        let gathers = self.gather(&samples, gatherer, progress)?;
        let observed = samples.iter().zip(&gathers);
        let observations: Vec<Observation> = observed
            .filter_map(|(sample, gathers)| Some(self.observation(sample, gathers.as_ref()?)))
            .collect();
        let reflected = observations.iter().map(|o| o.interpolated - o.emitted);
        let radiosity_floor = radiosity_floor(reflected);
        let (ambient, unshot_bound) = self.unshot(radiosity_floor);
        let conditions = Conditions {
            radiosity_floor,
            gap: model::GAP * self.light.mesh.scene().bounds().diagonal(),
            mean_reflectance: self.light.mesh.mean_reflectance().max_element(),
            gather_passes: self.lit_by.map(|_| self.gather_passes),
            ambient,
            unshot_bound,
        };
        let (estimate, spread) = error_estimate::estimate(&observations, &conditions);
        Ok((estimate, self.vertex_errors(spread)))
    }

    /// Root mean square error, relative, of what vertices interpolate to because `gatherer` casts
    /// so many rays and not more; by `count` points.
    pub fn sampling_error(&self, count: usize, gatherer: &mut dyn Gather) -> Result<f64, Error> {
        let samples = self.samples(count);
        let points: Vec<GatherPoint> = samples.iter().map(|s| s.point).collect();
        let jittered: Vec<GatherPoint> = samples.iter().map(Sample::jittered).collect();
        let sources = self.sources().radiosity_field();
        let first = gatherer.gather(&sources, &points)?;
        let second = gatherer.gather(&sources, &jittered)?;
        let floor = radiosity_floor(samples.iter().map(|s| s.interpolated - s.emitted));
        let mut sum = 0.0;
        for (sample, (first, second)) in samples.iter().zip(first.iter().zip(&second)) {
            let [a, b] = [first, second].map(|gathered| sample.radiosity(gathered));
            let scale = a.length().max(sample.interpolated.length()).max(floor);
            sum += ((a - b) / scale).length_squared() / 2.0;
        }
        Ok((model::HALF * (sum / samples.len().max(1) as f64)).sqrt())
    }

    /// What lights the vertices.
    fn sources(&self) -> &GatheredMesh {
        self.lit_by.unwrap_or(self.light)
    }

    /// Gathers at `samples` in an order whose first few are spread over all; none for those that
    /// are not reached.
    fn gather(
        &self,
        samples: &[Sample],
        gatherer: &mut dyn Gather,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<Vec<Option<SampleGathers>>, Error> {
        let sources = self.sources().radiosity_field();
        let mut gathers = vec![None; samples.len()];
        let order = golden_ratio_order(samples.len());
        let mut remaining = &order[..];
        let mut batches = BatchSizer::new(FIRST_BATCH);
        while !remaining.is_empty() {
            batches.next(&mut remaining, |batch| {
                let points: Vec<GatherPoint> = batch.iter().map(|&k| samples[k].point).collect();
                let jittered: Vec<GatherPoint> =
                    batch.iter().map(|&k| samples[k].jittered()).collect();
                let first = gatherer.gather(&sources, &points)?;
                let second = gatherer.gather(&sources, &jittered)?;
                let next = match self.lit_by {
                    Some(_) => gatherer.gather(&self.light.radiosity_field(), &points)?,
                    None => first.clone(),
                };
                for (i, &k) in batch.iter().enumerate() {
                    let (first, second, next) = (first[i], second[i], next[i]);
                    gathers[k] = Some(SampleGathers { first, second, next });
                }
                Ok::<_, Error>(())
            })?;
            if progress(samples.len() - remaining.len()).is_break() {
                break;
            }
        }
        Ok(gathers)
    }

    fn observation(&self, sample: &Sample, gathers: &SampleGathers) -> Observation {
        let SampleGathers { first, second, next } = gathers;
        let buried = [first, second, next].iter().any(|g| is_buried(g, sample.size));
        Observation {
            interpolated: sample.interpolated,
            emitted: sample.emitted,
            gathered: [sample.radiosity(first), sample.radiosity(second)],
            next: sample.radiosity(next),
            element_residual: self.element_residual[sample.element],
            excluded: buried || sample.reflectance == Rgb::ZERO,
            escaped: first.escaped,
            backface: first.backface,
            inverse_distance: first.inverse_distance,
        }
    }

    /// Points spread evenly over the area of the faces.
    fn samples(&self, count: usize) -> Vec<Sample> {
        let (surface, mesh) = (&self.light.surface, &self.light.mesh);
        let corners = |f: &[u32; 3]| f.map(|v| surface.positions[v as usize]);
        let area = |f: &[u32; 3]| {
            let [a, b, c] = corners(f);
            (b - a).cross(c - a).length() / 2.0
        };
        let above = SurfaceOffset::new(mesh.scene());
        let rotations = CellRotation::new(&mesh.scene().bounds());
        let sample = |place: SurfacePoint| {
            let face = &surface.faces[place.triangle];
            let [u, v] = place.barycentric;
            let mix = |[a, b, c]: [DVec3; 3]| a * (1.0 - u - v) + b * u + c * v;
            let element = surface.elements[place.triangle] as usize;
            let node = mesh.element(element);
            let material = mesh.material(node);
            let size = mesh.area(node).sqrt();
            let point = above.gather_point(mix(corners(face)), mesh.normal(node), size);
            Sample {
                element,
                reflectance: material.reflectance,
                point,
                interpolated: mix(face.map(|v| surface.radiosity[v as usize])),
                emitted: material.exitance,
                size,
                rotation: rotations.at(point.position, point.near),
            }
        };
        AreaSampler::new(surface.faces.iter().map(area)).spread(count, 0.5).map(sample).collect()
    }

    /// Root mean square of the ambient term over the radiosity, or over `floor` (W/m²) where that
    /// is more; and the bound of [`ErrorEstimate::unshot_bound`].
    fn unshot(&self, floor: f64) -> (f64, f64) {
        let sources = self.sources();
        let mesh = &sources.mesh;
        let mut ambient = vec![Rgb::ZERO; mesh.element_count()];
        self.ledger.add_ambient(mesh, &mut ambient);
        let (mut squares, mut area) = (0.0, 0.0);
        let mut flux = Rgb::ZERO;
        let mut max_reflectance = Rgb::ZERO;
        for (e, ambient) in ambient.iter().enumerate() {
            let node = mesh.element(e);
            let material = mesh.material(node);
            let reflected = sources.corners[e].iter().map(|&v| sources.reflected[v as usize]);
            let radiosity = material.exitance + reflected.sum::<Rgb>() / 3.0;
            let element_area = mesh.area(node);
            let scale = (radiosity + *ambient).length().max(floor);
            squares += (ambient.length() / scale).powi(2) * element_area;
            area += element_area;
            flux += radiosity * element_area;
            max_reflectance = max_reflectance.max(material.reflectance);
        }
        // Every bounce returns the largest reflectance of what is left, at most.
        let bound = self.ledger.unshot * max_reflectance / (Rgb::ONE - max_reflectance) / flux;
        let bound = if flux == Rgb::ZERO { 0.0 } else { bound.max_element() };
        ((squares / area).sqrt(), bound)
    }

    /// Standard error of each vertex of the surface, W/m²: that of the mesh by the residuals of the
    /// elements around it, weighted by area, and the others in proportion to its radiosity.
    fn vertex_errors(&self, spread: ErrorSpread) -> Vec<f64> {
        let surface = &self.light.surface;
        let mut sums = vec![(0.0, 0.0); surface.positions.len()];
        for (face, &e) in surface.faces.iter().zip(&surface.elements) {
            let area = self.light.mesh.area(self.light.mesh.element(e as usize));
            for &v in face {
                sums[v as usize].0 += area * self.element_residual[e as usize].powi(2);
                sums[v as usize].1 += area;
            }
        }
        let vertex_error = |((sum, area), radiosity): ((f64, f64), &Rgb)| {
            let residual = if area > 0.0 { sum / area } else { 0.0 };
            let mesh = residual * spread.per_residual * spread.per_residual;
            let even = (spread.even * radiosity.length()).powi(2);
            model::TAIL_FACTOR * (mesh + even).sqrt()
        };
        sums.into_iter().zip(&surface.radiosity).map(vertex_error).collect()
    }
}

impl Sample {
    /// Radiosity of the point by what was gathered there, W/m².
    fn radiosity(&self, gathered: &IrradianceSample) -> Rgb {
        self.emitted + self.reflectance * gathered.irradiance
    }

    /// A point a hair beside.
    fn jittered(&self) -> GatherPoint {
        let point = self.point;
        let (tangent, _) = point.normal.any_orthonormal_pair();
        let step = JITTER * self.size * (0.5 + self.rotation);
        GatherPoint { position: point.position + tangent * step, ..point }
    }
}
