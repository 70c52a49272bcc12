//! The light of sun and sky from two measured numbers: direct normal and diffuse horizontal
//! irradiance.
//!
//! ```text
//!   ε = ((D + I)/D + κ Z³)/(1 + κ Z³),  κ = 1.041        clearness     (Perez et al. 1990, eq. 1)
//!   Δ = m D / I₀                                         brightness    (the same, eq. 2)
//!   m = 1/(cos Z + 0.50572 (96.07995° − Z)^−1.6364)      air mass      (Kasten and Young 1989)
//! ```
//!
//! D is the diffuse horizontal, I the direct normal irradiance, Z the angle from the zenith to the
//! sun and I₀ the irradiance outside of the atmosphere.

use std::f64::consts::FRAC_PI_2;

use super::sky_distribution::{SkyDistribution, clearness_class};

/// Irradiance of sun and sky, as weather files have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolarIrradiance {
    /// Of a surface that faces the sun, from the sun alone, W/m².
    pub direct_normal: f64,
    /// Of level ground, from the sky alone, W/m².
    pub diffuse_horizontal: f64,
    /// Angle from the zenith to the sun, radians. Beyond the horizon it counts as on it.
    pub sun_zenith: f64,
    /// Of a surface that faces the sun outside of the atmosphere, W/m².
    pub extraterrestrial: f64,
}

/// a, b, c and d of the diffuse and of the direct luminous efficacy, by class of clearness (Perez,
/// Ineichen, Seals, Michalsky and Stewart 1990, table 4).
const EFFICACY: [[[f64; 4]; 8]; 2] = [
    [
        [97.24, -0.46, 12.00, -8.91],
        [107.22, 1.15, 0.59, -3.95],
        [104.97, 2.96, -5.53, -8.77],
        [102.39, 5.59, -13.95, -13.90],
        [100.71, 5.94, -22.75, -23.74],
        [106.42, 3.83, -36.15, -28.83],
        [141.88, 1.90, -53.24, -14.03],
        [152.23, 0.35, -45.27, -7.98],
    ],
    [
        [57.20, -4.55, -2.98, 117.12],
        [98.99, -3.46, -1.21, 12.38],
        [109.83, -4.90, -1.71, -8.81],
        [110.34, -5.84, -1.99, -4.56],
        [106.36, -3.97, -1.75, -6.16],
        [107.19, -1.25, -1.51, -26.73],
        [105.75, 0.77, -1.26, -34.44],
        [101.18, 1.58, -1.10, -8.29],
    ],
];

/// Luminous efficacy of sun and sky, lm/W.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LuminousEfficacy {
    /// Of the direct normal irradiance.
    pub direct: f64,
    /// Of the diffuse horizontal irradiance.
    pub diffuse: f64,
}

impl SolarIrradiance {
    /// Irradiance outside of the atmosphere at the mean distance of the sun, W/m² (Gueymard 2018).
    pub const SOLAR_CONSTANT: f64 = 1361.1;

    /// The same on a day of the year, from 1 for 1 January: that of the distance then, within 0.2 %
    /// (Spencer 1971, first harmonic).
    pub fn extraterrestrial_on(day: u32) -> f64 {
        let turn = std::f64::consts::TAU * (f64::from(day) - 1.0) / 365.0;
        SolarIrradiance::SOLAR_CONSTANT
            * (1.00011 + 0.034221 * libm::cos(turn) + 0.00128 * libm::sin(turn))
    }

    fn zenith(&self) -> f64 {
        self.sun_zenith.min(FRAC_PI_2)
    }

    /// ε, from 1 under an overcast sky; infinite without any light from the sky.
    pub fn clearness(&self) -> f64 {
        let cube = 1.041 * self.zenith().powi(3);
        let all = 1.0 + self.direct_normal / self.diffuse_horizontal;
        (all + cube) / (1.0 + cube)
    }

    /// Δ: what the model is fitted to lies between 0.01 and 0.6, to which it is limited.
    pub fn brightness(&self) -> f64 {
        let beyond = 96.07995 - self.zenith().to_degrees();
        let air_mass = 1.0 / (libm::cos(self.zenith()) + 0.50572 * libm::pow(beyond, -1.6364));
        (air_mass * self.diffuse_horizontal / self.extraterrestrial).clamp(0.01, 0.6)
    }

    /// The sky of Perez, Seals and Michalsky (1993); none without light from the sky.
    pub fn distribution(&self) -> Option<SkyDistribution> {
        // Table 1 ends at 12.01.
        let clearness = self.clearness().min(12.01);
        SkyDistribution::perez(clearness, self.brightness(), self.zenith())
            .filter(|_| self.diffuse_horizontal > 0.0)
    }

    /// Luminous efficacy where the dew point is this many degrees Celsius: a measure of the water
    /// in the air, 2 cm at 11 °C (Wright, Perez and Michalsky 1989).
    pub fn efficacy(&self, dew_point: f64) -> LuminousEfficacy {
        let water = libm::exp(0.07 * dew_point - 0.075);
        let (zenith, brightness) = (self.zenith(), self.brightness());
        let class = clearness_class(self.clearness());
        let of = |[a, b, c, d]: [f64; 4], [x, y]: [f64; 2]| a + b * water + c * x + d * y;
        LuminousEfficacy {
            direct: of(EFFICACY[1][class], [libm::exp(5.73 * zenith - 5.0), brightness]).max(0.0),
            diffuse: of(EFFICACY[0][class], [libm::cos(zenith), libm::log(brightness)]).max(0.0),
        }
    }
}
