//! Linear light to display colours.

use std::f64::consts::PI;

use crate::camera::RadianceImage;
use crate::scene::{Rgb, luminance};

/// A tone curve: exposure from the light's own histogram, then compression of highlights.
///
/// The median luminance of all that is not black is shown at one level, whatever its unit and
/// scale, so that a lamp in view, or a deep shadow, does not change the rest. Highlights are
/// compressed by Reinhard, Stark, Shirley, Ferwerda (2002), equation 4, on luminance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneCurve {
    exposure: f64,
}

/// Exposed luminance of the median. Plain choice: the curve maps it to 0.23, middle grey or a
/// little above on the display, sRGB 0.52.
const KEY: f64 = 0.28;

/// Exposed luminance shown as white: 8 medians, three stops above. Plain choice.
const WHITE: f64 = 8.0 * KEY;

impl ToneCurve {
    /// Fits the curve to linear `colours`; black ones do not count.
    pub fn fit(colours: &[Rgb]) -> ToneCurve {
        let mut luminances: Vec<f64> =
            colours.iter().map(|&c| luminance(c)).filter(|&l| l > 0.0).collect();
        if luminances.is_empty() {
            return ToneCurve { exposure: 1.0 };
        }
        let middle = luminances.len() / 2;
        let (_, median, _) = luminances.select_nth_unstable_by(middle, f64::total_cmp);
        ToneCurve { exposure: KEY / median.max(f64::MIN_POSITIVE) }
    }

    /// The curve with this exposure, above 0, instead of a fitted one: images with the same
    /// exposure can be compared.
    pub fn with_exposure(exposure: f64) -> ToneCurve {
        ToneCurve { exposure }
    }

    /// Fits the curve to an image; pixels that see only sky are left out.
    pub fn fit_image(image: &RadianceImage) -> ToneCurve {
        let pixels = image.pixels.iter().zip(&image.sky);
        let surfaces: Vec<Rgb> = pixels.filter(|(_, is_sky)| !**is_sky).map(|(c, _)| *c).collect();
        ToneCurve::fit(if surfaces.is_empty() { &image.pixels } else { &surfaces })
    }

    /// The curve that shows a radiosity B as this one shows the radiance B/π of diffuse surfaces.
    pub fn of_radiosity(self) -> ToneCurve {
        ToneCurve { exposure: self.exposure / PI }
    }

    /// Factor of linear values before highlights are compressed.
    pub fn exposure(&self) -> f64 {
        self.exposure
    }

    /// The displayed colour: linear, each channel in [0, 1] (BT.709 primaries).
    pub fn linear(&self, colour: Rgb) -> Rgb {
        let l = luminance(colour) * self.exposure;
        let mapped = (1.0 + l / (WHITE * WHITE)) / (1.0 + l);
        (colour * self.exposure * mapped).clamp(Rgb::ZERO, Rgb::ONE)
    }

    /// The displayed colour, as 8-bit sRGB.
    pub fn display(&self, colour: Rgb) -> [u8; 3] {
        self.linear(colour).to_array().map(srgb)
    }
}

/// IEC 61966-2-1, to 8 bits, of a value in [0, 1].
pub(super) fn srgb(x: f64) -> u8 {
    let encoded =
        if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * libm::pow(x, 1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}
