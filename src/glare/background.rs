//! The background luminance: what the eye receives besides the sources, by paths from it.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use rayon::prelude::*;

use super::Observer;
use crate::light::PathTracer;
use crate::sampling::hemisphere::cosine_direction;
use crate::sampling::random::random_numbers;
use crate::scene::luminance;

/// L_b of CIE 117: the luminance of an even surround with the illuminance at the eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Background {
    /// cd/m².
    pub luminance: f64,
    /// Its standard error by the scatter of paths, cd/m².
    pub standard_error: f64,
    /// Paths that it is the mean of.
    pub paths: usize,
}

/// Paths between two looks at the error.
const ROUND: usize = 1 << 14;

/// Maximum number of paths: a scatter of 20 times the mean is brought to 1 % of it.
const MAX_PATHS: usize = 1 << 22;

/// Standard error that is enough, as a share: 0.02 of UGR, whose steps are 1 (EN 12464-1 rounds to
/// those of 3).
const ENOUGH: f64 = 0.005;

impl Background {
    /// As `observer` sees it; none where `progress` stopped it.
    pub(super) fn of(
        tracer: &PathTracer<'_>,
        observer: &Observer,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Option<Background> {
        let (mut sum, mut squares, mut paths) = (0.0, 0.0, 0);
        loop {
            let sample = |k: usize| {
                let mut rng = random_numbers(&[0x0067_1a2e, k as u64]);
                let direction = cosine_direction(observer.direction, [rng.f64(), rng.f64()]);
                luminance(tracer.reflected_towards(observer.eye, direction, &mut rng)) / PI
            };
            // Blocks of a fixed size, summed in order: the same bits on any number of threads.
            let block = |b: usize| {
                let values = (0..256).map(|k| sample(paths + 256 * b + k));
                values.fold([0.0, 0.0], |[s, q], x| [s + x, q + x * x])
            };
            let blocks: Vec<[f64; 2]> = (0..ROUND / 256).into_par_iter().map(block).collect();
            for [s, q] in blocks {
                sum += s;
                squares += q;
            }
            paths += ROUND;
            let count = paths as f64;
            let mean = sum / count;
            let variance = (squares / count - mean * mean).max(0.0) / (count - 1.0);
            let found = Background { luminance: mean, standard_error: variance.sqrt(), paths };
            if found.standard_error <= ENOUGH * mean || paths >= MAX_PATHS {
                return Some(found);
            }
            if progress(paths, MAX_PATHS).is_break() {
                return None;
            }
        }
    }
}
