//! Upper bounds of intensity by the angle from an axis.
//!
//! ```text
//!   I ▲▇▇                 Street lamps are bright below and dark along the street: what a far one
//!     │▇▇▇▇               sends to the ground is a thousandth of what its peak intensity would.
//!     │▇▇▇▇▇▇___          Bin k bounds angles of k π / 32 to (k + 1) π / 32.
//!     └──────────► angle
//! ```

use std::f64::consts::PI;

use glam::DVec3;

use super::cone::angle;

const BINS: usize = 32;

/// Upper bounds of intensity by the angle from an axis.
#[derive(Clone, Debug)]
pub(crate) struct Profile {
    /// Unit length.
    axis: DVec3,
    /// W/sr, summed over the channels.
    bins: [f64; BINS],
}

impl Profile {
    /// Around a unit `axis`, where `peak` is the largest intensity between two angles, W/sr summed
    /// over the channels.
    pub fn new(axis: DVec3, peak: impl Fn([f64; 2]) -> f64) -> Profile {
        Profile { axis, bins: std::array::from_fn(|k| peak(edges(k))) }
    }

    /// Largest intensity in directions within `view` of a unit `direction`.
    pub fn peak(&self, direction: DVec3, view: f64) -> f64 {
        let between = angle(self.axis, direction);
        self.peak_between([between - view - ROUNDING, between + view + ROUNDING])
    }

    /// Of both together, about the axis of this one.
    pub fn joined(&self, other: &Profile) -> Profile {
        let apart = angle(self.axis, other.axis);
        let bin = |k: usize| {
            let [low, high] = edges(k);
            // Profiles about the same axis keep their bins.
            let angles = [low - apart + ROUNDING, high + apart - ROUNDING];
            self.bins[k] + other.peak_between(angles)
        };
        Profile { axis: self.axis, bins: std::array::from_fn(bin) }
    }

    fn peak_between(&self, [low, high]: [f64; 2]) -> f64 {
        let bin = |angle: f64| ((angle * BINS as f64 / PI).max(0.0) as usize).min(BINS - 1);
        let (first, last) = (bin(low), bin(high));
        self.bins[first..=last].iter().copied().fold(0.0, f64::max)
    }
}

/// Above the rounding of an angle by its cosine, √ε = 1.5e-8.
const ROUNDING: f64 = 1e-7;

/// The angles that a bin is for.
fn edges(bin: usize) -> [f64; 2] {
    [bin, bin + 1].map(|k| k as f64 * PI / BINS as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::low_discrepancy::r2_point;

    /// Two beams that cross, each of cosⁿ: no direction of a cone is brighter than its bound, and
    /// behind both there is nothing.
    #[test]
    fn no_direction_is_brighter_than_its_bound() {
        let beams = [(DVec3::Z, 3.0, 2), (DVec3::new(0.6, 0.0, 0.8), 1.0, 40)];
        let value = |angle: f64, peak: f64, n: i32| peak * angle.cos().max(0.0).powi(n);
        let profile =
            |(axis, peak, n): (DVec3, f64, i32)| Profile::new(axis, |[low, _]| value(low, peak, n));
        let both = profile(beams[0]).joined(&profile(beams[1]));
        let unit = |k: usize, shift: f64| {
            let [x, y] = r2_point(k, shift);
            let z = 2.0 * x - 1.0;
            let (sine, cosine) = (2.0 * PI * y).sin_cos();
            DVec3::new((1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, z)
        };
        let (mut bounds, mut values) = (0.0, 0.0);
        for k in 0..10_000 {
            let axis = unit(k, 0.3);
            let near = (axis + 0.3 * unit(7 * k, 0.6)).normalize();
            let view = angle(axis, near);
            let sum: f64 = beams.map(|(at, peak, n)| value(angle(at, near), peak, n)).iter().sum();
            let bound = both.peak(axis, view);
            assert!(sum <= bound * (1.0 + 1e-9), "{axis} {near}: {sum} {bound}");
            (bounds, values) = (bounds + bound, values + sum);
        }
        assert!(bounds < 3.0 * values, "{bounds} {values}");
        assert_eq!(both.peak(DVec3::new(-0.3, 0.0, -1.0).normalize(), 0.1), 0.0);
    }
}
