//! A fan of rays: directions over a hemisphere, as many as there is form factor.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::error::{Error, ErrorKind};

/// Directions spread over a hemisphere in proportion to the cosine, so that each stands for the same
/// form factor: Malley's method (Pharr, Jakob, Humphreys 2016, 13.6.3) on Hammersley's points.
#[derive(Debug)]
pub(crate) struct Fan {
    /// Along two tangents and the normal.
    directions: Vec<[f64; 3]>,
}

/// Rays that a fan can have at most.
const MOST: u32 = 1 << 20;

impl Fan {
    /// `count` rays.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(count: u32) -> Result<Fan, Error> {
        if count == 0 || count > MOST {
            let place = format!("{count} rays");
            let remedy = format!("use 1 to {MOST}");
            return Err(Error::new(ErrorKind::Setting, place, "not usable", remedy));
        }
        let direction = |k: u32| {
            let radius2 = (f64::from(k) + 0.5) / f64::from(count);
            let (sin, cos) = (TAU * radical_inverse(k)).sin_cos();
            [cos * radius2.sqrt(), sin * radius2.sqrt(), (1.0 - radius2).sqrt()]
        };
        Ok(Fan { directions: (0..count).map(direction).collect() })
    }

    /// Unit directions above a surface with unit `normal`, the fan turned about it by `turn` of a full
    /// turn.
    pub fn above(&self, normal: DVec3, turn: f64) -> impl Iterator<Item = DVec3> + '_ {
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = (TAU * turn).sin_cos();
        let (x, y) = (x * cos + y * sin, y * cos - x * sin);
        self.directions.iter().map(move |d| x * d[0] + y * d[1] + normal * d[2])
    }
}

/// The second coordinate of Hammersley's points, in [0, 1).
pub(crate) fn radical_inverse(k: u32) -> f64 {
    f64::from(k.reverse_bits()) / 2f64.powi(32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fan_has_the_moments_of_a_cosine_however_it_is_turned() {
        // Means over a cosine-weighted hemisphere: n·d is 2/3, x² is 1/4, x is 0. Stratified points
        // are off by less than 2/√n here, and by far less in the first.
        let fan = Fan::new(4096).unwrap();
        let normal = DVec3::new(0.36, -0.48, 0.8);
        let x = normal.any_orthonormal_vector();
        for turn in [0.0, 0.1, 0.77] {
            let mean =
                |f: &dyn Fn(DVec3) -> f64| fan.above(normal, turn).map(f).sum::<f64>() / 4096.0;
            assert!((mean(&|d| d.length()) - 1.0).abs() < 1e-12);
            assert!((mean(&|d| d.dot(normal)) - 2.0 / 3.0).abs() < 1e-4);
            assert!((mean(&|d| d.dot(x).powi(2)) - 0.25).abs() < 1e-3);
            assert!(mean(&|d| d.dot(x)).abs() < 1e-3);
            assert!(fan.above(normal, turn).all(|d| d.dot(normal) > 0.0));
        }
        assert!(Fan::new(0).is_err() && Fan::new(MOST + 1).is_err());
    }
}
