//! Real spherical harmonics to order 2, and the directions for projecting irradiance onto them.
//!
//! | index | l, m | Y_lm (Ramamoorthi and Hanrahan 2001, equation 3) |
//! |---|---|---|
//! | 0 | 0, 0 | ½ √(1/π) |
//! | 1, 2, 3 | 1, −1 to 1 | ½ √(3/π) · (y, z, x) |
//! | 4, 5, 7 | 2, −2, −1, 1 | ½ √(15/π) · (xy, yz, xz) |
//! | 6 | 2, 0 | ¼ √(5/π) · (3z² − 1) |
//! | 8 | 2, 2 | ¼ √(15/π) · (x² − y²) |
//!
//! They are orthonormal over the sphere: ∫ Y_i Y_j dω = δ_ij, without the phase (−1)^m.

use std::f64::consts::{FRAC_PI_4, PI};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::scene::Rgb;

/// Number of coefficients per channel.
pub const COUNT: usize = 9;

/// A function of direction by its harmonics to order 2, three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Harmonics {
    /// Coefficients c_lm with f(n) = Σ c_lm Y_lm(n): (l, m) = (0, 0), (1, −1), (1, 0), (1, 1),
    /// (2, −2), …, (2, 2), in the unit of f.
    pub coefficients: [Rgb; COUNT],
}

impl Harmonics {
    /// The function's value in unit direction `n`.
    pub fn at(&self, n: DVec3) -> Rgb {
        self.coefficients.iter().zip(basis(n)).map(|(c, y)| *c * y).sum()
    }

    /// The radiance, W/(m² sr), whose irradiance this is: L_lm = E_lm / Â_l.
    pub fn radiance_of_irradiance(&self) -> Harmonics {
        let mut coefficients = self.coefficients;
        for (c, factor) in coefficients.iter_mut().zip(COSINE_LOBE) {
            *c /= factor;
        }
        Harmonics { coefficients }
    }

    /// The irradiance of radiance that arrives along `direction` (towards its source, unit length)
    /// alone, by its integral over directions, W/m²: E_lm = Â_l Y_lm.
    pub(super) fn irradiance_of_direction(direction: DVec3, radiance: Rgb) -> Harmonics {
        let basis = basis(direction);
        let coefficients = std::array::from_fn(|k| radiance * (COSINE_LOBE[k] * basis[k]));
        Harmonics { coefficients }
    }

    /// The projection of a function given in the [`DIRECTIONS`], in their order:
    /// c_lm = 4π Σ w_k f(n_k) Y_lm(n_k).
    ///
    /// Exact for functions of order 5 at most, as the rule is exact to degree 7. Irradiance has no
    /// odd orders above the first, and its factor of order 6 is 1/64 of that of order 0.
    pub(super) fn of_values(values: impl Iterator<Item = Rgb>) -> Harmonics {
        let mut harmonics = Harmonics::default();
        for (direction, value) in DIRECTIONS.iter().zip(values) {
            let share = 4.0 * PI * direction.weight * value;
            for (c, y) in harmonics.coefficients.iter_mut().zip(basis(direction.unit())) {
                *c += share * y;
            }
        }
        harmonics
    }
}

/// Â_l = π, 2π/3, π/4 of order l (Ramamoorthi and Hanrahan 2001, equation 8).
const COSINE_LOBE: [f64; COUNT] = {
    let [zero, one, two] = [PI, 2.0 * PI / 3.0, FRAC_PI_4];
    [zero, one, one, one, two, two, two, two, two]
};

/// A point of the unit square as a direction, uniform over the sphere.
pub(super) fn uniform_direction([height, turn]: [f64; 2]) -> DVec3 {
    let z = 1.0 - 2.0 * height;
    let (sine, cosine) = libm::sincos(2.0 * PI * turn);
    let across = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(across * cosine, across * sine, z)
}

/// Y_lm in unit direction `n`.
fn basis(n: DVec3) -> [f64; COUNT] {
    let [x, y, z] = n.to_array();
    let (first, second) = ((3.0 / PI).sqrt() / 2.0, (15.0 / PI).sqrt() / 2.0);
    [
        (1.0 / PI).sqrt() / 2.0,
        first * y,
        first * z,
        first * x,
        second * x * y,
        second * y * z,
        (5.0 / PI).sqrt() / 4.0 * (3.0 * z * z - 1.0),
        second * x * z,
        second / 2.0 * (x * x - y * y),
    ]
}

/// A direction of a rule that integrates over the sphere.
#[derive(Clone, Copy, Debug)]
pub(super) struct Direction {
    /// Each −1, 0 or 1.
    towards: [f64; 3],
    /// Fraction of the sphere.
    pub weight: f64,
}

impl Direction {
    /// Unit vector.
    pub fn unit(&self) -> DVec3 {
        DVec3::from_array(self.towards).normalize()
    }
}

/// Lebedev's rule of 26 points, exact to degree 7 (V. I. Lebedev 1975, "Values of the nodes and
/// weights of quadrature formulas of Gauss–Markov type for a sphere"): to the middles of a cube's
/// sides, its edges and its corners.
///
/// Noise σ that is independent in each direction becomes 3 √(Σ w²) σ = 0.595 σ in what is rebuilt
/// to order 2, root mean square over the sphere.
pub(super) const DIRECTIONS: [Direction; 26] = directions();

const fn directions() -> [Direction; 26] {
    let mut all = [Direction { towards: [0.0; 3], weight: 0.0 }; 26];
    let (mut cell, mut next) = (0, 0);
    while cell < 27 {
        let towards = [cell % 3 - 1, cell / 3 % 3 - 1, cell / 9 - 1];
        let nonzero = towards[0] * towards[0] + towards[1] * towards[1] + towards[2] * towards[2];
        if nonzero > 0 {
            let towards = [towards[0] as f64, towards[1] as f64, towards[2] as f64];
            // Of the middles of sides, edges and corners.
            all[next] = Direction {
                towards,
                weight: [1.0 / 21.0, 4.0 / 105.0, 9.0 / 280.0][nonzero as usize - 1],
            };
            next += 1;
        }
        cell += 1;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of x^a y^b z^c over the sphere: (a−1)!! (b−1)!! (c−1)!! / (a+b+c+1)!! for even
    /// powers, else 0.
    fn mean_of_monomial(powers: [i32; 3]) -> f64 {
        let odd_factorial = |n: i32| (1..=n).rev().step_by(2).map(f64::from).product::<f64>();
        if powers.iter().any(|p| p % 2 == 1) {
            return 0.0;
        }
        powers.map(|p| odd_factorial(p - 1)).iter().product::<f64>()
            / odd_factorial(powers.iter().sum::<i32>() + 1)
    }

    #[test]
    fn rule_is_exact_to_degree_seven() {
        let mut is_exact_at_eight = true;
        for a in 0..=8 {
            for b in 0..=8 - a {
                for c in 0..=8 - a - b {
                    let term = |d: &Direction| {
                        let n = d.unit();
                        d.weight * n.x.powi(a) * n.y.powi(b) * n.z.powi(c)
                    };
                    let off =
                        DIRECTIONS.iter().map(term).sum::<f64>() - mean_of_monomial([a, b, c]);
                    let exact = off.abs() < 1e-15;
                    if a + b + c < 8 {
                        assert!(exact, "{a} {b} {c}: {off}");
                    } else {
                        is_exact_at_eight &= exact;
                    }
                }
            }
        }
        assert!(!is_exact_at_eight, "the test tells degrees apart");
        let noise = 3.0 * DIRECTIONS.iter().map(|d| d.weight * d.weight).sum::<f64>().sqrt();
        assert!((noise - 0.595).abs() < 5e-4, "{noise}");
    }

    #[test]
    fn harmonics_are_projected_onto_themselves() {
        for k in 0..COUNT {
            let mut one = Harmonics::default();
            one.coefficients[k] = Rgb::new(1.0, 2.0, 3.0);
            let found = Harmonics::of_values(DIRECTIONS.iter().map(|d| one.at(d.unit())));
            for (c, want) in found.coefficients.iter().zip(one.coefficients) {
                assert!((*c - want).length() < 1e-14, "{k}: {found:?}");
            }
        }
    }

    /// max(0, n·s) is the irradiance of light from direction s alone, with radiance Y_lm(s).
    #[test]
    fn cosine_lobe_is_what_irradiance_keeps_of_radiance() {
        let s = DVec3::new(0.48, -0.6, 0.64);
        let lobe = |n: DVec3| Rgb::splat(n.dot(s).max(0.0));
        let found = Harmonics::of_values(DIRECTIONS.iter().map(|d| lobe(d.unit())));
        let radiance = found.radiance_of_irradiance();
        for (k, (c, y)) in radiance.coefficients.iter().zip(basis(s)).enumerate() {
            // Order 6 and above, of which the rule sees the wrong part: Â_6 √13 √5 / √4π over Â_2
            // at most for order 2.
            assert!((c.x - y).abs() < 0.15, "{k}: {} {y}", c.x);
        }
        // At its brightest, 1/4 + 1/2 + 5/16 of it: order 2 is 1/16 too bright there.
        assert!((found.at(s).x - 17.0 / 16.0).abs() < 0.05, "{}", found.at(s).x);
    }
}
