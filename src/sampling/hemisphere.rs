//! A fan of rays: directions over a hemisphere, as many as there is form factor.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::sampling::low_discrepancy::{radical_inverse, sobol_02_point};

/// Directions spread over a hemisphere in proportion to the cosine, so that each stands for the same
/// form factor: Malley's method (Pharr, Jakob, Humphreys 2016, 13.6.3) on Hammersley's points.
#[derive(Debug)]
pub(crate) struct HemisphereSamples {
    /// Along two tangents and the normal.
    directions: Vec<[f64; 3]>,
}

/// RayScene that a fan can have at most.
pub(crate) const MOST: u32 = 1 << 20;

impl HemisphereSamples {
    /// `count` rays.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(count: u32) -> Result<HemisphereSamples, Error> {
        if count == 0 || count > MOST {
            let place = format!("{count} rays");
            let remedy = format!("use 1 to {MOST}");
            return Err(Error::new(ErrorKind::Setting, place, "not usable", remedy));
        }
        Ok(HemisphereSamples::of(count, |k| {
            [(f64::from(k) + 0.5) / f64::from(count), radical_inverse(k)]
        }))
    }

    /// As many rays, of which the first half, quarter and so on are fans of their own if `count` is a
    /// power of two, and what they lack of the whole is too.
    pub fn progressive(count: u32) -> HemisphereSamples {
        HemisphereSamples::of(count.clamp(1, MOST), sobol_02_point)
    }

    fn of(count: u32, point: impl Fn(u32) -> [f64; 2]) -> HemisphereSamples {
        let direction = |k: u32| {
            let [radius2, phi] = point(k);
            let (sin, cos) = (TAU * phi).sin_cos();
            [cos * radius2.sqrt(), sin * radius2.sqrt(), (1.0 - radius2).sqrt()]
        };
        HemisphereSamples { directions: (0..count).map(direction).collect() }
    }

    /// Unit directions above a surface with unit `normal`, the fan turned about it by `turn` of a full
    /// turn.
    pub fn directions(&self, normal: DVec3, turn: f64) -> impl Iterator<Item = DVec3> + '_ {
        self.directions_in(0..self.directions.len() as u32, normal, turn)
    }

    /// Some of those.
    pub fn directions_in(
        &self,
        range: Range<u32>,
        normal: DVec3,
        turn: f64,
    ) -> impl Iterator<Item = DVec3> + '_ {
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = (TAU * turn).sin_cos();
        let (x, y) = (x * cos + y * sin, y * cos - x * sin);
        let directions = &self.directions[range.start as usize..range.end as usize];
        directions.iter().map(move |d| x * d[0] + y * d[1] + normal * d[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_has_the_moments_of_a_cosine_however_it_is_turned() {
        // Means over a cosine-weighted hemisphere: n·d is 2/3, x² is 1/4, x is 0. Stratified points
        // are off by less than 2/√n here, and by far less in the first.
        let fan = HemisphereSamples::new(4096).unwrap();
        let normal = DVec3::new(0.36, -0.48, 0.8);
        let x = normal.any_orthonormal_vector();
        for turn in [0.0, 0.1, 0.77] {
            let mean = |f: &dyn Fn(DVec3) -> f64| {
                fan.directions(normal, turn).map(f).sum::<f64>() / 4096.0
            };
            assert!((mean(&|d| d.length()) - 1.0).abs() < 1e-12);
            assert!((mean(&|d| d.dot(normal)) - 2.0 / 3.0).abs() < 1e-4);
            assert!((mean(&|d| d.dot(x).powi(2)) - 0.25).abs() < 1e-3);
            assert!(mean(&|d| d.dot(x)).abs() < 1e-3);
            assert!(fan.directions(normal, turn).all(|d| d.dot(normal) > 0.0));
        }
        assert!(HemisphereSamples::new(0).is_err() && HemisphereSamples::new(MOST + 1).is_err());
    }
}
