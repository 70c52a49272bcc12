//! Doubles the number of rays until halves of them agree.
//!
//! ```text
//! error = max(|E_first − E_second|, c_max / n) / 2
//! ```
//!
//! E_first and E_second are the irradiances of the two halves of the rays, and c_max / n the
//! largest contribution of one of n rays: both halves may miss the same small source, or see as
//! many rays of the same strip of a lamp. (By quarters in place of halves errors are known better,
//! but bakes of a hall and a castle took 12 % longer, for the same error.)

use std::ops::Range;

use crate::scene::Rgb;

/// Sums over some rays.
pub(super) trait RaySums {
    /// Adds the sums over other rays.
    fn add(&mut self, other: &Self);

    /// The irradiance, if these are `count` rays.
    fn mean(&self, count: u32) -> Rgb;

    /// The largest contribution of one ray that may as well be another one, if these are `count`
    /// rays, W/m².
    fn largest(&self, count: u32) -> f64;
}

/// Sums over rays, and the function that casts more.
pub(super) struct Doubled<S, T> {
    sums: S,
    trace: T,
    count: u32,
    max: u32,
    error: f64,
}

impl<S: RaySums, T: Fn(Range<u32>) -> S> Doubled<S, T> {
    /// Starts with the first of `limits`; the second is the maximum. `trace` casts the rays of a
    /// range.
    pub fn new([min, max]: [u32; 2], trace: T) -> Doubled<S, T> {
        let sums = trace(0..min / 2);
        let mut doubled = Doubled { sums, trace, count: min / 2, max, error: f64::INFINITY };
        doubled.add_half();
        doubled
    }

    /// Doubles the number of rays; false at the maximum.
    pub fn double(&mut self) -> bool {
        let has_more = self.count < self.max;
        if has_more {
            self.add_half();
        }
        has_more
    }

    fn add_half(&mut self) {
        let half = self.count;
        let second = (self.trace)(half..2 * half);
        let difference = self.sums.mean(half).distance(second.mean(half));
        self.sums.add(&second);
        self.count = 2 * half;
        self.error = difference.max(self.sums.largest(self.count)) / 2.0;
    }

    /// The irradiance by all rays.
    pub fn mean(&self) -> Rgb {
        self.sums.mean(self.count)
    }

    /// Estimated error of the mean.
    pub fn error(&self) -> f64 {
        self.error
    }

    pub fn sums(&self) -> &S {
        &self.sums
    }

    pub fn count(&self) -> u32 {
        self.count
    }
}
