//! Cosine-weighted directions over a hemisphere.
//!
//! Malley's method: points spread evenly over a unit disc are projected up onto the hemisphere.
//! Each direction then has the same form factor, so that a form factor is a count of rays.
//!
//! ```text
//! unit square   →   unit disc                   →   hemisphere
//! (x, y)            radius √x, azimuth 2π y         height √(1 − x) above the disc
//! ```
//!
//! A rotation of the whole set about the normal adds to the azimuth.

use std::f64::consts::TAU;
use std::ops::Range;

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::sampling::low_discrepancy::{radical_inverse, sobol_02_point};

/// Directions spread over a hemisphere in proportion to the cosine, so that each has the same form
/// factor: Malley's method (Pharr, Jakob, Humphreys 2016, 13.6.3) on low-discrepancy points.
#[derive(Debug)]
pub(crate) struct HemisphereSamples {
    /// Unit vectors, by components along two tangents and the normal.
    directions: Vec<[f64; 3]>,
}

/// The direction of a hemisphere about unit `normal` for a point of the unit square, in proportion
/// to the cosine.
pub(crate) fn cosine_direction(normal: DVec3, [radius2, turn]: [f64; 2]) -> DVec3 {
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let (sin, cos) = libm::sincos(TAU * turn);
    radius2.sqrt() * (tangent * cos + bitangent * sin) + normal * (1.0 - radius2).sqrt()
}

/// Maximum number of rays of a set: some 24 MiB of directions.
pub(crate) const MAX_RAYS: u32 = 1 << 20;

impl HemisphereSamples {
    /// `count` directions, on Hammersley's points.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above [`MAX_RAYS`].
    pub fn new(count: u32) -> Result<HemisphereSamples, Error> {
        if count == 0 || count > MAX_RAYS {
            let place = format!("{count} rays");
            let remedy = format!("use 1 to {MAX_RAYS}");
            return Err(Error::new(ErrorKind::Setting, place, "not usable", remedy));
        }
        Ok(HemisphereSamples::from_points(count, |k| {
            [(f64::from(k) + 0.5) / f64::from(count), radical_inverse(k)]
        }))
    }

    /// `count` directions, clamped to 1 to [`MAX_RAYS`], on Sobol's (0,2)-sequence: of a power of
    /// two, the first half, quarter and so on are evenly spread sets of their own, and so is the
    /// second half.
    pub fn progressive(count: u32) -> HemisphereSamples {
        HemisphereSamples::from_points(count.clamp(1, MAX_RAYS), sobol_02_point)
    }

    /// The same with the first `block` directions (a power of two) in the middle of their rings
    /// instead of at the inner rims. Each further block, up to twice the number, already fills the
    /// middles; so no power of two of them has the bias 1/(2n) of n directions towards the normal.
    pub fn centred(count: u32, block: u32) -> HemisphereSamples {
        HemisphereSamples::from_points(count.clamp(1, MAX_RAYS), |k| {
            let [x, y] = sobol_02_point(k);
            [if k < block { x + 0.5 / f64::from(block) } else { x }, y]
        })
    }

    fn from_points(count: u32, point: impl Fn(u32) -> [f64; 2]) -> HemisphereSamples {
        let direction = |k: u32| {
            let [radius2, phi] = point(k);
            let (sin, cos) = libm::sincos(TAU * phi);
            [cos * radius2.sqrt(), sin * radius2.sqrt(), (1.0 - radius2).sqrt()]
        };
        HemisphereSamples { directions: (0..count).map(direction).collect() }
    }

    /// All of them, by components along two tangents and the normal.
    pub fn local(&self) -> &[[f64; 3]] {
        &self.directions
    }

    /// All unit directions above a surface with unit `normal`, rotated about it by `rotation`, in
    /// turns.
    pub fn directions(&self, normal: DVec3, rotation: f64) -> impl Iterator<Item = DVec3> + '_ {
        self.directions_in(0..self.directions.len() as u32, normal, rotation)
    }

    /// Those of [`HemisphereSamples::directions`] with the indices in `range`.
    pub fn directions_in(
        &self,
        range: Range<u32>,
        normal: DVec3,
        rotation: f64,
    ) -> impl Iterator<Item = DVec3> + '_ {
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = libm::sincos(TAU * rotation);
        let (x, y) = (x * cos + y * sin, y * cos - x * sin);
        let directions = &self.directions[range.start as usize..range.end as usize];
        directions.iter().map(move |d| x * d[0] + y * d[1] + normal * d[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centred_directions_have_no_bias_to_the_normal() {
        // The mean of the cosine is 2/3. With directions at the rims of rings it is 1/(2 n) too
        // large; in their middles only the error of the ring at the horizon is left, where √(1 − x)
        // is steep: less than a tenth of (1/n)^1.5.
        for count in [64, 128, 256, 512] {
            let mean = |samples: HemisphereSamples| {
                let all = samples.directions_in(0..count, DVec3::Z, 0.0);
                all.map(|d| d.z).sum::<f64>() / f64::from(count) - 2.0 / 3.0
            };
            let n = f64::from(count);
            assert!((mean(HemisphereSamples::progressive(512)) * 2.0 * n - 1.0).abs() < 0.1);
            let off = mean(HemisphereSamples::centred(512, 64));
            assert!(off.abs() < 0.1 * 64f64.powf(-1.5), "{count}: {off}");
        }
    }

    #[test]
    fn directions_have_cosine_moments() {
        // Means over a cosine-weighted hemisphere: n·d is 2/3, x² is 1/4, x is 0. Stratified points
        // are off by less than 2/√n here, and by far less in the first.
        let samples = HemisphereSamples::new(4096).unwrap();
        let normal = DVec3::new(0.36, -0.48, 0.8);
        let x = normal.any_orthonormal_vector();
        for rotation in [0.0, 0.1, 0.77] {
            let mean = |f: &dyn Fn(DVec3) -> f64| {
                samples.directions(normal, rotation).map(f).sum::<f64>() / 4096.0
            };
            assert!((mean(&|d| d.length()) - 1.0).abs() < 1e-12);
            assert!((mean(&|d| d.dot(normal)) - 2.0 / 3.0).abs() < 1e-4);
            assert!((mean(&|d| d.dot(x).powi(2)) - 0.25).abs() < 1e-3);
            assert!(mean(&|d| d.dot(x)).abs() < 1e-3);
            assert!(samples.directions(normal, rotation).all(|d| d.dot(normal) > 0.0));
        }
        assert!(
            HemisphereSamples::new(0).is_err() && HemisphereSamples::new(MAX_RAYS + 1).is_err()
        );
    }
}
