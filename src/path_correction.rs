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
//! s² being the variance of D by the scatter of its paths. Where the light is good, τ is small and
//! few paths do; where it is not, w goes to 1 and the value to that of the paths alone. Points
//! whose error is too large get twice as many paths until it is not.

mod shrinkage;

use std::ops::ControlFlow;

use rayon::prelude::*;

use crate::error::{Error, ErrorKind};
use crate::gather::{GatherPoint, GatheredMesh, PointIrradiance, RadiosityField};
use crate::light::PathTracer;
use crate::progress::BatchSizer;
use crate::sampling::random::random_numbers;
use crate::scene::Rgb;
use crate::visibility::ray_scene::Hit;
use shrinkage::{Missed, Shrinkage};

/// Paths of a point in the first round. Fewer leave the scatter of a point's paths unknown.
const FIRST_PATHS: usize = 256;

/// Maximum number of paths of a point: brings a scatter of ten times the mean to 1 % of it.
const MAX_PATHS: usize = 1 << 20;

/// Values darker than this share of their mean are as exact as if they were that bright.
const FLOOR: f64 = 0.05;

/// Values at points, corrected.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct PathCorrection {
    /// Standard error that all values have in common, W/m² per channel: it is in the errors of
    /// values, and in that of their mean as a whole.
    pub common_error: Rgb,
    /// Root mean square of the correction over that of values, lengths over the channels.
    pub correction: f64,
    /// Paths in all.
    pub paths: usize,
    /// Whether every value has the error that was asked for.
    pub is_reached: bool,
}

/// Corrects the irradiance `values` that `light` causes at `points` ([`crate::gather::irradiance_at`])
/// by paths until 95 % of the values are estimated to be off by less than the share `error` of
/// themselves: until their standard errors are half of that. These are standard errors against the
/// true light of the scene then.
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
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Option<PathCorrection>, Error> {
    if !(error > 0.0) {
        let remedy = "give a share above 0, such as 0.05";
        return Err(Error::new(ErrorKind::Setting, "error of values", error.to_string(), remedy));
    }
    let tracer = PathTracer::of_shared(light.mesh.shared_scene());
    let field = light.radiosity_field();
    let counts: Vec<usize> = (0..values.len()).filter(|&k| !values[k].is_buried()).collect();
    let mut missed = vec![Missed::default(); counts.len()];
    let scale = mean_length(counts.iter().map(|&k| values[k].irradiance));
    let allowed = |k: usize| 0.5 * error * values[k].irradiance.length().max(FLOOR * scale);
    let mut open: Vec<usize> = (0..counts.len()).collect();
    let mut paths = FIRST_PATHS;
    let (mut done, mut of) = (0, 0);
    let estimate = loop {
        of += open.iter().map(|&j| paths - missed[j].paths).sum::<usize>();
        let (mut remaining, mut batches) = (&open[..], BatchSizer::new(16));
        while !remaining.is_empty() {
            let traced = batches.next(&mut remaining, |batch| {
                let trace = |&j: &usize| {
                    let more = missed[j].more(paths, &mut |first| {
                        sample(&tracer, &field, &points[counts[j]], first)
                    });
                    (j, more)
                };
                batch.par_iter().map(trace).collect::<Vec<_>>()
            });
            for (j, more) in traced {
                done += more.paths - missed[j].paths;
                missed[j] = more;
            }
            if progress(done, of).is_break() {
                return Ok(None);
            }
        }
        let estimate = Shrinkage::new(&missed);
        let is_open = |&j: &usize| {
            let gathered = values[counts[j]].standard_error.length_squared();
            let error = (gathered + estimate.variance(&missed[j]).element_sum()).sqrt();
            error > allowed(counts[j])
        };
        open = (0..counts.len()).filter(is_open).collect();
        if open.is_empty() || 2 * paths > MAX_PATHS {
            break estimate;
        }
        paths *= 2;
        // Points that were done before have fewer.
        open.retain(|&j| missed[j].paths < paths);
    };
    let mut squares = [0.0; 2];
    for (&k, missed) in counts.iter().zip(&missed) {
        let (correction, value) = (estimate.missed(missed), &mut values[k]);
        squares[0] += correction.length_squared();
        squares[1] += value.irradiance.length_squared();
        // Irradiance is not negative, and its correction is noisy.
        value.irradiance = (value.irradiance + correction).max(Rgb::ZERO);
        let variance = value.standard_error * value.standard_error + estimate.variance(missed);
        value.standard_error = variance.map(f64::sqrt);
    }
    Ok(Some(PathCorrection {
        common_error: estimate.common_variance().map(f64::sqrt),
        correction: if squares[1] > 0.0 { (squares[0] / squares[1]).sqrt() } else { 0.0 },
        paths: done,
        is_reached: open.is_empty(),
    }))
}

/// What the light misses at `point` by path number `path`, W/m².
fn sample(tracer: &PathTracer, field: &RadiosityField, point: &GatherPoint, path: usize) -> Rgb {
    let [x, y, z] = point.position.to_array().map(f64::to_bits);
    let [u, v, w] = point.normal.to_array().map(f64::to_bits);
    let mut rng = random_numbers(&[x, y, z, u, v, w, path as u64]);
    let GatherPoint { position, normal, near } = *point;
    let known = |hit: &Hit| field.reflected_at(hit.triangle, hit.u, hit.v);
    tracer.missed(position, normal, near, known, &mut rng)
}

fn mean_length(values: impl Iterator<Item = Rgb>) -> f64 {
    let (count, sum) = values.fold((0, 0.0), |(count, sum), v| (count + 1, sum + v.length()));
    sum / f64::from(count).max(1.0)
}
