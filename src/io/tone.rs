//! Linear light to display colours.

use crate::scene::Rgb;

/// A tone curve fitted to a scene: exposure from its mean, highlights rolled off.
///
/// Reinhard, Stark, Shirley, Ferwerda (2002), equations 1, 2 and 4, on luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneCurve {
    exposure: f64,
    white: f64,
}

/// Luminance that the logarithmic mean is mapped to.
const KEY: f64 = 0.24;

impl ToneCurve {
    /// Fits the curve to linear `colours`; black ones do not count.
    pub fn fit(colours: &[Rgb]) -> ToneCurve {
        let luminances = || colours.iter().map(|&c| luminance(c)).filter(|&l| l > 0.0);
        let (sum, count) = luminances().fold((0.0, 0.0), |(s, n), l| (s + l.ln(), n + 1.0));
        let exposure = if count > 0.0 { KEY / (sum / count).exp() } else { 1.0 };
        // A lamp may burn out: white is not farther than 8 times the mean, three stops.
        let white = luminances().fold(0.0, f64::max) * exposure;
        ToneCurve { exposure, white: white.clamp(1.0, 8.0 * KEY) }
    }

    /// 8-bit sRGB of a linear colour (BT.709 primaries).
    pub fn display(&self, colour: Rgb) -> [u8; 3] {
        let l = luminance(colour) * self.exposure;
        let mapped = (1.0 + l / (self.white * self.white)) / (1.0 + l);
        (colour * self.exposure * mapped).to_array().map(srgb)
    }
}

/// Luminance of a linear BT.709 colour.
fn luminance(c: Rgb) -> f64 {
    c.dot(Rgb::new(0.2126, 0.7152, 0.0722))
}

/// IEC 61966-2-1, to 8 bits; out of range is clipped.
fn srgb(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
