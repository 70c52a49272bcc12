//! Emission of a black body, in total and by wavelength band.

use std::f64::consts::PI;

/// Stefan's and Boltzmann's constant σ, W/(m² K⁴) (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670374419e-8;

/// Second radiation constant c₂ = h c / k, µm K (CODATA 2018).
const SECOND_RADIATION: f64 = 14387.76877;

/// ∫ z³/(e^z − 1) dz from 0 to infinity is π⁴/15.
const WHOLE: f64 = PI * PI * PI * PI / 15.0;

/// Share of a black body's emission below `wavelength` (µm) at `temperature` (K), 0 to 1.
///
/// 15/π⁴ Σ e^−nz (z³ + 3z²/n + 6z/n² + 6/n³)/n with z = c₂/λT (S. L. Chang, K. T. Rhee, "Blackbody
/// radiation functions", Int. Comm. Heat Mass Transfer 11, 1984); for small z a power series. Both
/// have an error of 1e-15.
pub fn share_below(wavelength: f64, temperature: f64) -> f64 {
    Split::at(wavelength * temperature).below
}

/// Above this z, e^−z counts as 0.
const NO_SHORTER_WAVES: f64 = 700.0;

/// The emission of a black body, split at a wavelength.
#[derive(Clone, Copy)]
struct Split {
    /// Share at shorter wavelengths.
    below: f64,
    /// Share at longer ones.
    above: f64,
}

impl Split {
    /// For a product of wavelength and temperature, µm K.
    fn at(product: f64) -> Split {
        let z = SECOND_RADIATION / product;
        if product <= 0.0 || z > NO_SHORTER_WAVES {
            return Split { below: 0.0, above: 1.0 };
        }
        if z < 1.5 {
            let above = power_series(z) / WHOLE;
            return Split { below: 1.0 - above, above };
        }
        // Terms fall by e^−z ≤ 0.223: term 30 is 1e-19 of the first.
        let term = |n: f64| {
            libm::exp(-n * z) * (((z + 3.0 / n) * z + 6.0 / (n * n)) * z + 6.0 / (n * n * n)) / n
        };
        let below = (1..=30).rev().map(|n| term(f64::from(n))).sum::<f64>() / WHOLE;
        Split { below, above: 1.0 - below }
    }

    fn between(self, longer: Split) -> f64 {
        // The difference of the smaller ones, which have more significant digits.
        if longer.below < 0.5 { longer.below - self.below } else { self.above - longer.above }
    }
}

/// ∫ t³/(e^t − 1) dt from 0 to z: z³ Σ B_k z^k / ((k + 3) k!), with Bernoulli's numbers B_k.
fn power_series(z: f64) -> f64 {
    // B_k / k! for k = 2, 4, …: with z < 1.5 the first omitted term is 5e-16 of the sum.
    const TERMS: [f64; 11] = [
        1.0 / 12.0,
        -1.0 / 720.0,
        1.0 / 30_240.0,
        -1.0 / 1_209_600.0,
        1.0 / 47_900_160.0,
        -691.0 / 1_307_674_368_000.0,
        1.0 / 74_724_249_600.0,
        -3617.0 / 10_670_622_842_880_000.0,
        43_867.0 / 5_109_094_217_170_944_000.0,
        -174_611.0 / 802_857_662_698_291_200_000.0,
        77_683.0 / 14_101_100_039_391_805_440_000.0,
    ];
    let squared = z * z;
    let even = TERMS
        .iter()
        .enumerate()
        .rev()
        .fold(0.0, |sum, (k, term)| (sum + term / (2 * k + 5) as f64) * squared);
    z.powi(3) * (1.0 / 3.0 - z / 8.0 + even)
}

/// Emission of a black body in each band.
pub(super) struct Bands<'a> {
    /// Wavelengths between them, µm.
    pub edges: &'a [f64],
}

impl Bands<'_> {
    pub fn count(&self) -> usize {
        self.edges.len() + 1
    }

    /// Emission M in each band, W/m², of a black body with total emission `all` (σT⁴).
    pub fn emission(&self, all: f64, of_band: &mut [f64]) {
        let temperature = temperature(all);
        let mut shorter = Split { below: 0.0, above: 1.0 };
        for (band, emission) in of_band.iter_mut().enumerate() {
            let longer = match self.edges.get(band) {
                Some(edge) => Split::at(edge * temperature),
                None => Split { below: 1.0, above: 0.0 },
            };
            *emission = all * shorter.between(longer).max(0.0);
            shorter = longer;
        }
    }

    /// The derivative of the emission in each band by the total emission: the shares, and λT/4
    /// times the derivative of the share below λ at either end.
    pub fn slopes(&self, all: f64, of_band: &mut [f64]) {
        if all <= 0.0 {
            // Towards 0 K all emission is in the band of the longest waves.
            of_band.fill(0.0);
            of_band[self.edges.len()] = 1.0;
            return;
        }
        let temperature = temperature(all);
        let mut shorter = (Split { below: 0.0, above: 1.0 }, 0.0);
        for (band, slope) in of_band.iter_mut().enumerate() {
            let longer = match self.edges.get(band) {
                Some(edge) => {
                    let z = SECOND_RADIATION / (edge * temperature);
                    let moved = if z > NO_SHORTER_WAVES {
                        0.0
                    } else {
                        z.powi(4) / libm::expm1(z) / WHOLE / 4.0
                    };
                    (Split::at(edge * temperature), moved)
                }
                None => (Split { below: 1.0, above: 0.0 }, 0.0),
            };
            *slope = shorter.0.between(longer.0).max(0.0) + longer.1 - shorter.1;
            shorter = longer;
        }
    }
}

/// Temperature of a black body that emits `all`, K; 0 if `all` is zero or negative.
pub(super) fn temperature(all: f64) -> f64 {
    (all.max(0.0) / STEFAN_BOLTZMANN).sqrt().sqrt()
}

/// Total emission of a black body of this temperature, W/m².
pub(super) fn emission(temperature: f64) -> f64 {
    STEFAN_BOLTZMANN * temperature.powi(4)
}
