//! What the light of a bake misses at points, by paths: values closer to the truth, with the error
//! of each.
//!
//! ```text
//!      light ●╲            A ray from the point x meets a surface at y, whose radiosity the light
//!   path from y╲           knows, B̂(y), and a path from y finds without bias, B(y). The mean of
//!         ╭──── y          B − B̂ over rays with density cos θ / π is what the gathered irradiance
//!        ╱  B̂(y) known     misses at x: all of the error of the light, as it is seen from x.
//!       x
//! ```
//!
//! Paths from the points are the adjoint of the light that arrives there: they go where it comes
//! from, and nowhere else (importance: Smits, Arvo and Salesin 1992).
//!
//! With few paths the missed light of one point has more noise than the light has errors. But
//! errors of neighbours are alike, so each point takes from those around it what its own paths
//! leave open, over cells within cells (`nested_cells`), whose spread the paths estimate too. Where
//! the light is good, cells do not differ and few paths do; where it is not, the value goes to that
//! of the paths of the point alone. Points whose error is too large get twice as many paths until
//! it is not.

mod missed_light;
mod nested_cells;

use std::ops::ControlFlow;

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::accuracy::Measure;
use crate::error::{Error, ErrorKind};
use crate::gather::near_surface::is_near;
use crate::gather::two_sided::TwoSidedPoint;
use crate::gather::{GatherPoint, GatheredMesh, PointIrradiance, RadiosityField};
use crate::light::PathTracer;
use crate::sampling::hemisphere::cosine_direction;
use crate::sampling::random::random_numbers;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;
pub(crate) use missed_light::scales;
use missed_light::{Goal, PathOrigin, missed_light};

/// Edge of the finest cells, at least, over that of the box around all points: of a grid of a
/// million probes 1 000 a side are parted. Plain choice.
const FINEST_CELL: f64 = 1.0 / 1024.0;

/// What is known of values that paths have corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PathCorrection {
    /// Standard error of the mean of the values, W/m² per channel: what neighbours take from the
    /// same paths they have in common. Of harmonics that of the constant one.
    pub mean_error: Rgb,
    /// Root mean square of the correction over that of values, lengths over the channels.
    pub correction: f64,
    /// Paths in all.
    pub paths: usize,
    /// Whether every value has the error that was asked for.
    pub is_reached: bool,
}

/// Corrects the irradiance `values` that `light` causes at `points`
/// ([`irradiance_at`](crate::gather::irradiance_at)) by paths until 95 % of the values are
/// estimated to be off by less than the share `error` of themselves: until their standard errors
/// are half of that. These are standard errors against the true light of the scene then.
///
/// Points inside solids are left out. The same points give the same bits on any number of threads.
/// `progress` is called with the number of paths done and of those that will be at least, several
/// times a second; if it stops the work, the result is `None`, and values are as they were.
///
/// # Errors
/// [`ErrorKind::Setting`] for an `error` that is not above 0.
pub fn correct_by_paths(
    light: &GatheredMesh,
    points: &[GatherPoint],
    values: &mut [PointIrradiance],
    error: f64,
    progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<PathCorrection>, Error> {
    let missing = MissingLight::new(light);
    let open: Vec<usize> = (0..values.len()).filter(|&k| !values[k].is_buried()).collect();
    let gathered: Vec<PointIrradiance> = open.iter().map(|&k| values[k]).collect();
    let points: Vec<&GatherPoint> = open.iter().map(|&k| &points[k]).collect();
    let noise = moderate(&gathered);
    let value = |(k, point): (usize, &&GatherPoint)| NoisyValue {
        position: point.position,
        normal: point.normal,
        size: gathered[k].irradiance.length(),
        variance: noise[k].element_sum(),
    };
    let noisy: Vec<NoisyValue> = points.iter().enumerate().map(value).collect();
    let sample = |k: usize, path: usize| missing.irradiance(points[k], path).to_array();
    let Some((missed, mut correction)) = correct(&noisy, error, sample, progress)? else {
        return Ok(None);
    };
    for (k, &point) in open.iter().enumerate() {
        let [missed, variance] = [missed[k].value, missed[k].variance].map(Rgb::from_array);
        // Irradiance is not negative, and its correction is noisy.
        values[point].irradiance = (gathered[k].irradiance + missed).max(Rgb::ZERO);
        values[point].standard_error = (noise[k] + variance).map(f64::sqrt);
    }
    let of_gathers = noise.iter().sum::<Rgb>() / (open.len() as f64).max(1.0).powi(2);
    correction.mean_error =
        (correction.mean_error * correction.mean_error + of_gathers).map(f64::sqrt);
    Ok(Some(correction))
}

/// A point of a surface, and what was gathered there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GatheredPoint {
    pub point: TwoSidedPoint,
    /// Area that it stands for, scene unit squared.
    pub area: f64,
    /// Irradiance, W/m² per channel.
    pub irradiance: Rgb,
    /// See [`IrradianceSample::near_paths`](crate::gather::IrradianceSample::near_paths).
    pub near_paths: bool,
}

/// Irradiance at points of surfaces, corrected by paths.
pub(crate) struct CorrectedSurface {
    /// Irradiance of each, W/m² per channel.
    pub irradiance: Vec<Rgb>,
    /// Standard error of what paths added to each, W/m²: a length over the channels.
    pub standard_error: Vec<f64>,
    /// Root mean square over area of those standard errors, as shares.
    pub error: f64,
    /// Number of paths.
    pub paths: usize,
}

/// How exact light at points of surfaces is to be, and is without paths.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceGoal {
    /// Root mean square over area of the errors by what `light` misses, as shares.
    pub error: f64,
    /// The estimate of what is missed, and a bound on it, as shares.
    pub expected: [f64; 2],
    /// Points darker than this share of the mean count as that bright.
    pub floor: f64,
    /// Edge of the finest cells of points that share paths, scene unit.
    pub finest: f64,
}

/// Corrects what was gathered of `light` at `count` points, which `point` gives by number, until
/// the error of `goal` is reached or there are as many paths as can be. See [`correct_by_paths`]
/// for `progress`.
pub(crate) fn correct_surface(
    light: &GatheredMesh,
    count: usize,
    point: impl Fn(usize) -> GatheredPoint + Sync,
    goal: &SurfaceGoal,
    progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Option<CorrectedSurface> {
    let scales = scales((0..count).map(|k| point(k).irradiance.length()), goal.floor);
    let bounds = light.mesh.scene().bounds();
    let origin = |(k, &scale): (usize, &f64)| {
        let GatheredPoint { point, area, .. } = point(k);
        PathOrigin {
            position: (point.point.position - bounds.low) / bounds.diagonal(),
            normal: point.point.normal,
            scale,
            area,
        }
    };
    let origins: Vec<PathOrigin> = scales.iter().enumerate().map(origin).collect();
    let missing = MissingLight::new(light);
    let sample = |k: usize, path: usize| {
        let GatheredPoint { point, near_paths, .. } = point(k);
        missing.irradiance_two_sided(&point, near_paths, path).to_array()
    };
    let finest = goal.finest / bounds.diagonal();
    let (expected, error) = (goal.expected, Goal::Mean(goal.error));
    let found = missed_light(&origins, finest, expected, &error, sample, progress)?;
    let corrected = |(k, scale): (usize, &f64)| {
        // Irradiance is not negative, and its correction is noisy.
        (point(k).irradiance + *scale * Rgb::from_array(found.missed[k])).max(Rgb::ZERO)
    };
    Some(CorrectedSurface {
        irradiance: scales.iter().enumerate().map(corrected).collect(),
        standard_error: scales.iter().zip(&found.variance).map(|(s, v)| s * v.sqrt()).collect(),
        error: found.error,
        paths: found.paths,
    })
}

/// A value that paths correct: a number or more for each channel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoisyValue {
    pub position: DVec3,
    /// Zero where light arrives from all sides.
    pub normal: DVec3,
    /// The length of the value, over the channels and the numbers, W/m².
    pub size: f64,
    /// Its variance without what is missed, a sum over the channels and the numbers.
    pub variance: f64,
}

/// What a value of `M` numbers misses, W/m², and its variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MissedValue<const M: usize> {
    pub value: [f64; M],
    pub variance: [f64; M],
}

/// What each of `values` misses: `sample` gives that of a value by the number of a path, without
/// bias. See [`correct_by_paths`] for `error` and `progress`.
///
/// # Errors
/// [`ErrorKind::Setting`] for an `error` that is not above 0.
pub(crate) fn correct<const M: usize>(
    values: &[NoisyValue],
    error: f64,
    sample: impl Fn(usize, usize) -> [f64; M] + Sync,
    progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<(Vec<MissedValue<M>>, PathCorrection)>, Error> {
    if error.is_nan() || error <= 0.0 {
        let remedy = "give a share above 0, such as 0.05";
        return Err(Error::new(ErrorKind::Setting, "error of values", error.to_string(), remedy));
    }
    let scales = scales(values.iter().map(|value| value.size), Measure::default().floor);
    let origins = origins(values, &scales);
    let most = values.iter().zip(&scales);
    let most = most.map(|(v, scale)| (0.5 * error).powi(2) - v.variance / (scale * scale));
    let goal = Goal::Each(most.collect());
    // As many cells as points that are evenly spread, along a line too.
    let finest = (0.5 / (values.len() as f64).max(1.0)).max(FINEST_CELL);
    let unknown = [f64::INFINITY; 2];
    let Some(missed) = missed_light(&origins, finest, unknown, &goal, sample, progress) else {
        return Ok(None);
    };
    let mean_error = missed.shares.map(|share| (share * missed.mean_variance).sqrt());
    let value = |(k, scale): (usize, &f64)| MissedValue {
        value: missed.missed[k].map(|value| scale * value),
        variance: missed.shares.map(|share| scale * scale * share * missed.variance[k]),
    };
    let corrections: Vec<MissedValue<M>> = scales.iter().enumerate().map(value).collect();
    let added: f64 = corrections.iter().flat_map(|c| c.value).map(|x| x * x).sum();
    let all: f64 = values.iter().map(|value| value.size * value.size).sum();
    let correction = PathCorrection {
        mean_error: Rgb::from_slice(&mean_error),
        correction: if all > 0.0 { (added / all).sqrt() } else { 0.0 },
        paths: missed.paths,
        is_reached: missed.is_reached,
    };
    Ok(Some((corrections, correction)))
}

/// Where paths start from: positions over the longest edge of the box around all.
fn origins(values: &[NoisyValue], scales: &[f64]) -> Vec<PathOrigin> {
    let positions = values.iter().map(|value| value.position);
    let low = positions.clone().fold(DVec3::INFINITY, DVec3::min);
    let high = positions.fold(DVec3::NEG_INFINITY, DVec3::max);
    let edge = (high - low).max_element().max(f64::MIN_POSITIVE);
    let origin = |(value, &scale): (&NoisyValue, &f64)| PathOrigin {
        position: (value.position - low) / edge,
        normal: value.normal,
        scale,
        area: 1.0,
    };
    values.iter().zip(scales).map(origin).collect()
}

/// Variances of `values`, half-way to their mean over values as bright, by octaves, relative to the
/// values: each is that of few gathers, three degrees of freedom, and counts as much as a prior of
/// three from the others (Smyth 2004, equation 7).
fn moderate(values: &[PointIrradiance]) -> Vec<Rgb> {
    let square = |v: &PointIrradiance| v.irradiance.length_squared().max(f64::MIN_POSITIVE);
    let octave = |v: &PointIrradiance| (0.5 * libm::log2(square(v))).floor() as i64;
    let variance = |v: &PointIrradiance| v.standard_error * v.standard_error;
    let mut octaves = FxHashMap::<i64, (f64, Rgb)>::default();
    for value in values {
        let (count, sum) = octaves.entry(octave(value)).or_default();
        *count += 1.0;
        *sum += variance(value) / square(value);
    }
    let moderated = |value: &PointIrradiance| {
        let (count, sum) = octaves[&octave(value)];
        0.5 * (variance(value) + sum / count * square(value))
    };
    values.iter().map(moderated).collect()
}

/// The light that a field misses.
pub(crate) struct MissingLight<'a> {
    tracer: PathTracer<'static>,
    field: RadiosityField<'a>,
}

impl MissingLight<'_> {
    pub fn new(light: &GatheredMesh) -> MissingLight<'_> {
        let tracer = PathTracer::of_shared(light.mesh.shared_scene());
        MissingLight { tracer, field: light.radiosity_field() }
    }

    /// Irradiance that is missed at `point`, by path number `path`, W/m².
    fn irradiance(&self, point: &GatherPoint, path: usize) -> Rgb {
        self.irradiance_past(point, false, path)
    }

    /// Irradiance that is missed at a point of a surface, by path number `path`, W/m². With
    /// `near_paths` what near surfaces reflect is not the field's, as in
    /// [`IrradianceSample::near_paths`](crate::gather::IrradianceSample::near_paths).
    fn irradiance_two_sided(&self, point: &TwoSidedPoint, near_paths: bool, path: usize) -> Rgb {
        let [own, other] = point.shares();
        let front = own * self.irradiance_past(&point.point, near_paths, path);
        if other == Rgb::ZERO {
            return front;
        }
        front + other * self.irradiance_past(&point.other_side(), near_paths, path)
    }

    /// The same past near surfaces where `near_paths` have their light.
    fn irradiance_past(&self, point: &GatherPoint, near_paths: bool, path: usize) -> Rgb {
        let GatherPoint { position, normal, near } = *point;
        let mut rng = numbers_of(position, normal, path);
        let direction = cosine_direction(normal, [rng.f64(), rng.f64()]);
        let is_known = |hit: &Hit| !near_paths || !is_near(self.field.mesh, hit);
        let known = |hit: &Hit| self.field.reflected_at(hit.triangle, hit.u, hit.v);
        self.tracer.missed([position, direction], near, is_known, known, &mut rng)
    }

    /// What is missed of the radiosity that is seen from `position` along unit `direction`, further
    /// than `near`, by one path, W/m².
    pub fn radiosity(
        &self,
        position: DVec3,
        direction: DVec3,
        near: f64,
        rng: &mut fastrand::Rng,
    ) -> Rgb {
        let known = |hit: &Hit| self.field.reflected_at(hit.triangle, hit.u, hit.v);
        self.tracer.missed([position, direction], near, |_| true, known, rng)
    }
}

/// Random numbers of path number `path` from `position`, the same in any list of points.
pub(crate) fn numbers_of(position: DVec3, normal: DVec3, path: usize) -> fastrand::Rng {
    let [x, y, z] = position.to_array().map(f64::to_bits);
    let [u, v, w] = normal.to_array().map(f64::to_bits);
    random_numbers(&[x, y, z, u, v, w, path as u64])
}
