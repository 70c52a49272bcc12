//! Daylight coefficients of a point, by paths in batches.

use std::f64::consts::PI;

use fastrand::Rng;

use super::patches::PATCHES;
use super::year::{BATCHES, Batches, DaylightYear, LitHour};
use crate::gather::GatherPoint;
use crate::light::{PathTracer, Visit};
use crate::sampling::hemisphere::cosine_direction;
use crate::sampling::low_discrepancy::sobol_02_point;
use crate::sampling::random::random_numbers;
use crate::scene::{Sun, luminance};

/// Rays to suns of the year from each surface that a path meets: as many as take about the time of
/// the path itself.
const SUNS: usize = 8;

/// Rays to the rim of a sun. A straight edge between two of them hides at most
/// (θ − sin θ)/2π = 0.16 % of it, θ = 2π/16.
const RIM: u32 = 16;

/// Rays to all of the disc, where those to the rim differ: steps of 1.6 %.
const DISC: u32 = 64;

/// Illuminance at a point by unit luminance of each patch of the sky, and by unit illuminance of
/// suns in each as it is reflected.
#[derive(Clone, Debug)]
pub(super) struct DaylightCoefficients {
    sky: Vec<Batches>,
    sun: Vec<Batches>,
    /// Paths of each batch.
    pub paths: usize,
    backs: usize,
}

impl DaylightCoefficients {
    /// Without any path.
    pub fn new() -> DaylightCoefficients {
        let none = vec![[0.0; BATCHES]; PATCHES];
        DaylightCoefficients { sky: none.clone(), sun: none, paths: 0, backs: 0 }
    }

    /// Share of paths that meet backs first.
    pub fn backs(&self) -> f64 {
        self.backs as f64 / (self.paths * BATCHES).max(1) as f64
    }

    /// Traces until each batch has `paths`.
    pub fn trace(
        &mut self,
        tracer: &PathTracer,
        year: &DaylightYear,
        point: &GatherPoint,
        paths: usize,
    ) {
        let keep = self.paths as f32 / paths as f32;
        for batches in [&mut self.sky, &mut self.sun] {
            batches.iter_mut().flatten().for_each(|x| *x *= keep);
        }
        let place = point.position.to_array().map(f64::to_bits);
        for batch in 0..BATCHES {
            let numbers =
                |path: usize| random_numbers(&[&place[..], &[batch as u64, path as u64]].concat());
            let mut shift = numbers(usize::MAX);
            let shift = [shift.f64(), shift.f64()];
            for path in self.paths..paths {
                // Even over the hemisphere, and each batch in its own way.
                let [u, v] = sobol_02_point(path as u32);
                let square = [(u + shift[0]).fract(), (v + shift[1]).fract()];
                let direction = cosine_direction(point.normal, square);
                let mut add = |visit: Visit, rng: &mut Rng| {
                    self.add(tracer, year, visit, [batch, paths], rng);
                };
                tracer.walk(point.position, direction, point.near, &mut numbers(path), &mut add);
            }
        }
        self.paths = paths;
    }

    /// Adds what a path of a batch of so many meets.
    fn add(
        &mut self,
        tracer: &PathTracer,
        year: &DaylightYear,
        visit: Visit,
        [batch, paths]: [usize; 2],
        rng: &mut Rng,
    ) {
        let each = 1.0 / paths as f64;
        match visit {
            Visit::Sky { direction, share } => {
                if let Some(patch) = year.patches.of(direction) {
                    self.sky[patch][batch] += (each * PI * luminance(share)) as f32;
                }
            }
            Visit::Back { is_first } => self.backs += usize::from(is_first),
            Visit::Surface { at, share } if !year.suns.is_empty() => {
                for k in 0..SUNS {
                    let chosen = year.choose((k as f64 + rng.f64()) / SUNS as f64);
                    let sun = chosen.sun(rng.f64());
                    let found = luminance(share * tracer.irradiance_of_sun(&at, sun, rng));
                    let value = each * found / (SUNS as f64 * chosen.chance);
                    self.sun[chosen.patch][batch] += value as f32;
                }
            }
            Visit::Surface { .. } => {}
        }
    }

    /// The same as if light were even over each of Tregenza's patches.
    pub fn widened(&self, year: &DaylightYear) -> DaylightCoefficients {
        let [sky, sun] = year.widened([&self.sky, &self.sun]);
        DaylightCoefficients { sky, sun, ..*self }
    }

    /// Illuminance of an hour without the sun's direct light, lx.
    pub fn indirect(&self, hour: &LitHour) -> Batches {
        let mut sums = [0.0; BATCHES];
        for (luminance, coefficients) in hour.sky.iter().zip(&self.sky) {
            for (sum, coefficient) in sums.iter_mut().zip(coefficients) {
                *sum += luminance * coefficient;
            }
        }
        if let Some(sun) = &hour.sun {
            for (sum, coefficient) in sums.iter_mut().zip(&self.sun[sun.patch]) {
                *sum += sun.illuminance as f32 * coefficient;
            }
        }
        sums
    }
}

/// Illuminance at `point` by the direct light of `sun`, lx for an illuminance of 1.
pub(super) fn direct(tracer: &PathTracer, point: &GatherPoint, sun: &Sun) -> f64 {
    let GatherPoint { position, normal, near } = *point;
    let ray = |place: [f64; 2]| {
        let direction = sun.towards(place);
        let cosine = normal.dot(direction);
        let passed = || luminance(tracer.passed_beyond(position, direction, near));
        if cosine > 0.0 { cosine * passed() } else { 0.0 }
    };
    let rim: Vec<f64> = (0..RIM).map(|k| ray([1.0, f64::from(k) / f64::from(RIM)])).collect();
    let is_dark = rim.iter().all(|&x| x == 0.0);
    if is_dark || rim.iter().all(|&x| x > 0.0) {
        return rim.iter().sum::<f64>() / f64::from(RIM);
    }
    (0..DISC).map(|k| ray(sobol_02_point(k))).sum::<f64>() / f64::from(DISC)
}
