//! Distributions of sky radiance, relative to the zenith.
//!
//! ```text
//!   L(Z, χ) / L_zenith = f(χ) φ(Z) / (f(Z_sun) φ(0))         Z: angle from the zenith
//!     φ(Z) = 1 + a exp(b / cos Z)                            χ: angle from the sun
//!     f(χ) = 1 + c (exp(d χ) − exp(d π/2)) + e cos² χ        (CIE S 011/E:2003)
//! ```

use std::f64::consts::FRAC_PI_2;

/// Distribution of the radiance of a sky, relative to that of its zenith.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyDistribution(Kind);

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    /// (1 + 2 cos Z) / 3.
    Traditional,
    /// a, b, c, d and e.
    Graded([f64; 5]),
}

/// a to e of the fifteen standard skies (CIE S 011/E:2003, table 1).
const STANDARD: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.80, 0.0, -1.0, 0.0],
    [1.1, -0.80, 2.0, -1.5, 0.15],
    [0.0, -1.00, 0.0, -1.0, 0.0],
    [0.0, -1.00, 2.0, -1.5, 0.15],
    [0.0, -1.00, 5.0, -2.5, 0.30],
    [0.0, -1.00, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// Four coefficients each of a, b, c, d and e (Perez, Seals and Michalsky 1993, table 1, with the
/// erratum).
const PEREZ: [[[f64; 4]; 5]; 8] = [
    [
        [1.3525, -0.2576, -0.2690, -1.4366],
        [-0.7670, 0.0007, 1.2734, -0.1233],
        [2.8000, 0.6004, 1.2375, 1.0000],
        [1.8734, 0.6297, 0.9738, 0.2809],
        [0.0356, -0.1246, -0.5718, 0.9938],
    ],
    [
        [-1.2219, -0.7730, 1.4148, 1.1016],
        [-0.2054, 0.0367, -3.9128, 0.9156],
        [6.9750, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.1080],
        [0.2624, 0.0672, -0.2190, -0.4285],
    ],
    [
        [-1.1000, -0.2515, 0.8952, 0.0156],
        [0.2782, -0.1812, -4.5000, 1.1766],
        [24.7219, -13.0812, -37.7000, 34.8438],
        [-5.0000, 1.5218, 3.9229, -2.6204],
        [-0.0156, 0.1597, 0.4199, -0.5562],
    ],
    [
        [-0.5484, -0.6654, -0.2672, 0.7117],
        [0.7234, -0.6219, -5.6812, 2.6297],
        [33.3389, -18.3000, -62.2500, 52.0781],
        [-3.5000, 0.0016, 1.1477, 0.1062],
        [0.4659, -0.3296, -0.0876, -0.0329],
    ],
    [
        [-0.6000, -0.3566, -2.5000, 2.3250],
        [0.2937, 0.0496, -5.6812, 1.8415],
        [21.0000, -4.7656, -21.5906, 7.2492],
        [-3.5000, -0.1554, 1.4062, 0.3988],
        [0.0032, 0.0766, -0.0656, -0.1294],
    ],
    [
        [-1.0156, -0.3670, 1.0078, 1.4051],
        [0.2875, -0.5328, -3.8500, 3.3750],
        [14.0000, -0.9999, -7.1406, 7.5469],
        [-3.4000, -0.1078, -1.0750, 1.5702],
        [-0.0672, 0.4016, 0.3017, -0.4844],
    ],
    [
        [-1.0000, 0.0211, 0.5025, -0.5119],
        [-0.3000, 0.1922, 0.7023, -1.6317],
        [19.0000, -5.0000, 1.2438, -1.9094],
        [-4.0000, 0.0250, 0.3844, 0.2656],
        [1.0468, -0.3788, -2.4517, 1.4656],
    ],
    [
        [-1.0500, 0.0289, 0.4260, 0.3590],
        [-0.3250, 0.1156, 0.7781, 0.0025],
        [31.0625, -14.5000, -46.1148, 55.3750],
        [-7.2312, 0.4050, 13.3500, 0.6234],
        [1.5000, -0.6426, 1.8564, 0.5636],
    ],
];

/// The class of a clearness, from 0 to 7 (Perez et al. 1990, table 1).
pub(super) fn clearness_class(clearness: f64) -> usize {
    [1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2].partition_point(|&least| least <= clearness)
}

impl SkyDistribution {
    /// The overcast sky, 1 + 2 sin of the elevation (Moon and Spencer 1942): a third of the zenith
    /// at the horizon. The irradiance of open ground is 7π/9 times the zenith's radiance.
    pub const OVERCAST: SkyDistribution = SkyDistribution(Kind::Traditional);

    /// One of the standard skies of the CIE (S 011/E:2003), by its number: 1 overcast, steep, 5
    /// uniform, 7 partly cloudy with the sun behind, 12 clear, 13 clear and polluted, and so on to
    /// 15. None for other numbers.
    pub fn cie(number: u32) -> Option<SkyDistribution> {
        let index = usize::try_from(number).ok()?.checked_sub(1)?;
        STANDARD.get(index).map(|&all| SkyDistribution(Kind::Graded(all)))
    }

    /// The all-weather sky of Perez, Seals and Michalsky (1993, equation 1): `clearness` ε from 1,
    /// overcast, to 12 or so; `brightness` Δ from 0.01 to 0.6 or so; `sun_zenith` is the angle from
    /// the zenith to the sun, radians.
    ///
    /// None for a clearness below 1, or another number that is negative or not finite.
    pub fn perez(clearness: f64, brightness: f64, sun_zenith: f64) -> Option<SkyDistribution> {
        let all = [clearness - 1.0, brightness, sun_zenith];
        if !all.iter().all(|x| x.is_finite() && *x >= 0.0) {
            return None;
        }
        let line = clearness_class(clearness);
        // The range of the model's fit.
        let brightness = if line > 0 && line < 5 { brightness.max(0.2) } else { brightness };
        let linear =
            |[p, q, r, s]: [f64; 4]| p + q * sun_zenith + brightness * (r + s * sun_zenith);
        let [a, b, mut c, mut d, e] = PEREZ[line].map(linear);
        if line == 0 {
            let [[c1, c2, c3, c4], [d1, d2, d3, d4]] = [PEREZ[0][2], PEREZ[0][3]];
            c = libm::exp(libm::pow(brightness * (c1 + c2 * sun_zenith), c3)) - c4;
            d = -libm::exp(brightness * (d1 + d2 * sun_zenith)) + d3 + brightness * d4;
        }
        // The paper has 1 + c exp(d χ) + e cos² χ: the same up to a factor.
        let factor = 1.0 + c * libm::exp(d * FRAC_PI_2);
        let graded = [a, b, c / factor, d, e / factor];
        graded.iter().all(|x| x.is_finite()).then_some(SkyDistribution(Kind::Graded(graded)))
    }

    /// Radiance relative to the zenith, 0 or more, as a function of the cosines of the angles from
    /// the zenith, above 0, and from the sun. `sun` is the cosine of the sun's zenith angle.
    pub(crate) fn relative_to_zenith(self, sun: f64) -> impl Fn(f64, f64) -> f64 {
        let absolute = move |up: f64, from_sun: f64| match self.0 {
            Kind::Traditional => 1.0 + 2.0 * up,
            Kind::Graded([a, b, c, d, e]) => {
                // It diverges at the horizon for b above 0.
                let gradation = 1.0 + a * libm::exp(b / up.max(0.01));
                let angle = libm::acos(from_sun.clamp(-1.0, 1.0));
                let scattered = c * (libm::exp(d * angle) - libm::exp(d * FRAC_PI_2));
                gradation * (1.0 + scattered + e * from_sun * from_sun)
            }
        };
        let zenith = absolute(1.0, sun);
        move |up, from_sun| {
            let relative = absolute(up, from_sun) / zenith;
            if relative.is_finite() { relative.max(0.0) } else { 0.0 }
        }
    }
}
