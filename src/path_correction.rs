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
//! With few paths the missed light D(x) of one point has more noise than the light has errors. But
//! errors of neighbours are alike, so each point takes from the others what it lacks itself. Its
//! missed light is estimated as normally distributed over the points, with mean μ and variance τ²,
//! which are estimated too (empirical Bayes: Efron and Morris 1973):
//!
//! ```text
//!   missed = μ + w (D − μ),   w = τ²/(τ² + s²),    variance = w s² + (1 − w)² var(μ)
//! ```
//!
//! for each channel, s² being the variance of D by the scatter of its paths. Where the light is
//! good, τ is small and few paths do; where it is not, w goes to 1 and the value to that of the
//! paths alone. Points whose error is too large get twice as many paths until it is not.

#[cfg(feature = "light-map")]
mod nested_cells;
mod shrinkage;
#[cfg(feature = "light-map")]
mod surface;

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::gather::near_surface::is_near;
use crate::gather::{GatherPoint, GatheredMesh, PointIrradiance, RadiosityField};
use crate::light::PathTracer;
use crate::progress::BatchSizer;
use crate::sampling::hemisphere::cosine_direction;
use crate::sampling::random::random_numbers;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;
use shrinkage::{Missed, Shrinkage};
#[cfg(feature = "light-map")]
pub(crate) use surface::{PathOrigin, missed_light};

/// Paths of all points in the first round: bring what they miss in common to 1 % of itself where
/// paths scatter by 2.5 times their mean.
const FIRST_PATHS: usize = 1 << 16;

/// Minimum and maximum of those of a point. Fewer leave the scatter of its paths unknown.
const FIRST_PATHS_OF_POINT: [usize; 2] = [16, 256];

/// Maximum number of paths of a point: brings a scatter of ten times the mean to 1 % of it.
const MAX_PATHS: usize = 1 << 20;

/// Values darker than this share of their mean are as exact as if they were that bright.
const FLOOR: f64 = 0.05;

/// What is known of values that paths have corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PathCorrection {
    /// Standard error that all values have in common, W/m² per channel: it is in the errors of
    /// values, and in that of their mean as a whole. Of harmonics that of the constant one.
    pub common_error: Rgb,
    /// Root mean square of the correction over that of values, lengths over the channels.
    pub correction: f64,
    /// Paths in all.
    pub paths: usize,
    /// Whether every value has the error that was asked for.
    pub is_reached: bool,
}

/// A value of `N` numbers a channel, such as irradiance or its harmonics.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoisyValue<const N: usize> {
    pub value: [Rgb; N],
    pub variance: [Rgb; N],
}

impl<const N: usize> NoisyValue<N> {
    /// The length of the value, over the channels and the numbers.
    fn size(&self) -> f64 {
        self.value.iter().map(|v| v.length_squared()).sum::<f64>().sqrt()
    }
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
    let noisy = |&k: &usize| NoisyValue {
        value: [values[k].irradiance],
        variance: [values[k].standard_error.map(|x| x * x)],
    };
    let mut corrected: Vec<NoisyValue<1>> = open.iter().map(noisy).collect();
    let sample = |j: usize, path: usize| [missing.irradiance(&points[open[j]], path)];
    let correction = correct(&mut corrected, error, sample, progress)?;
    for (k, corrected) in open.into_iter().zip(corrected) {
        // Irradiance is not negative, and its correction is noisy.
        values[k].irradiance = corrected.value[0].max(Rgb::ZERO);
        values[k].standard_error = corrected.variance[0].map(f64::sqrt);
    }
    Ok(correction)
}

/// Corrects `values` by what each misses: `sample` gives that of a value by the number of a path,
/// without bias. See [`correct_by_paths`] for `error` and `progress`.
///
/// # Errors
/// [`ErrorKind::Setting`] for an `error` that is not above 0.
pub(crate) fn correct<const N: usize>(
    values: &mut [NoisyValue<N>],
    error: f64,
    sample: impl Fn(usize, usize) -> [Rgb; N] + Sync,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<PathCorrection>, Error> {
    if error.is_nan() || error <= 0.0 {
        let remedy = "give a share above 0, such as 0.05";
        return Err(Error::new(ErrorKind::Setting, "error of values", error.to_string(), remedy));
    }
    moderate(values);
    let mean = values.iter().map(NoisyValue::size).sum::<f64>() / (values.len() as f64).max(1.0);
    let allowed: Vec<f64> =
        values.iter().map(|v| (0.5 * error * v.size().max(FLOOR * mean)).powi(2)).collect();
    let mut missed = vec![Missed::default(); values.len()];
    let mut open: Vec<usize> = (0..values.len()).collect();
    let [least, most] = FIRST_PATHS_OF_POINT;
    let first = (FIRST_PATHS / values.len().max(1)).clamp(least, most);
    let (mut paths, mut done) = (first.next_power_of_two(), 0);
    let estimate = loop {
        let all = done + open.iter().map(|&k| paths - missed[k].paths).sum::<usize>();
        let report = |more: usize| progress(done + more, all);
        if trace(&open, &mut missed, paths, &sample, report).is_break() {
            return Ok(None);
        }
        done = all;
        let estimate = Shrinkage::new(&missed);
        let is_open = |&k: &usize| {
            let variances = values[k].variance.iter().zip(estimate.variance(&missed[k]));
            variances.map(|(a, b)| (*a + b).element_sum()).sum::<f64>() > allowed[k]
        };
        open = (0..values.len()).filter(is_open).collect();
        if open.is_empty() || paths == MAX_PATHS {
            break estimate;
        }
        paths *= 2;
    };
    Ok(Some(PathCorrection {
        common_error: estimate.common_variance()[0].map(f64::sqrt),
        correction: add(&estimate, &missed, values),
        paths: done,
        is_reached: open.is_empty(),
    }))
}

/// Adds what is missed, and its variance, to `values`; the root mean square of what is added over
/// that of the values.
fn add<const N: usize>(
    estimate: &Shrinkage<N>,
    missed: &[Missed<N>],
    values: &mut [NoisyValue<N>],
) -> f64 {
    let (mut added, mut all) = (0.0, 0.0);
    for (value, missed) in values.iter_mut().zip(missed) {
        let (correction, variance) = (estimate.missed(missed), estimate.variance(missed));
        added += correction.iter().map(|c| c.length_squared()).sum::<f64>();
        all += value.size().powi(2);
        for j in 0..N {
            value.value[j] += correction[j];
            value.variance[j] += variance[j];
        }
    }
    if all > 0.0 { (added / all).sqrt() } else { 0.0 }
}

/// Traces until the points `open` have `paths`. `progress` gets the number of those done.
fn trace<const N: usize>(
    open: &[usize],
    missed: &mut [Missed<N>],
    paths: usize,
    sample: &(impl Fn(usize, usize) -> [Rgb; N] + Sync),
    mut progress: impl FnMut(usize) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let (mut remaining, mut batches, mut done) = (open, BatchSizer::new(16), 0);
    while !remaining.is_empty() {
        let traced = batches.next(&mut remaining, |batch| {
            let more = |&k: &usize| (k, missed[k].more(paths, |path| sample(k, path)));
            batch.par_iter().map(more).collect::<Vec<_>>()
        });
        for (k, more) in traced {
            done += more.paths - missed[k].paths;
            missed[k] = more;
        }
        progress(done)?;
    }
    ControlFlow::Continue(())
}

/// Draws the variances of `values` half-way to their mean, relative to the values: each is that of
/// few gathers, three degrees of freedom, and counts as much as a prior of three from all of them
/// (Smyth 2004, equation 7).
fn moderate<const N: usize>(values: &mut [NoisyValue<N>]) {
    let square = |v: &NoisyValue<N>| v.size().powi(2).max(f64::MIN_POSITIVE);
    let relative = |v: &NoisyValue<N>| v.variance.map(|variance| variance / square(v));
    let mut mean = [Rgb::ZERO; N];
    for value in values.iter() {
        let share = relative(value).map(|variance| variance / values.len() as f64);
        mean.iter_mut().zip(share).for_each(|(mean, share)| *mean += share);
    }
    for value in values {
        let all = square(value);
        for (variance, mean) in value.variance.iter_mut().zip(&mean) {
            *variance = 0.5 * (*variance + *mean * all);
        }
    }
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
