//! From spectra to colours: the CIE 1931 standard observer, 2°.
//!
//! ```text
//!   bands at λ_b ──► XYZ = Σ_b B_b (x̄, ȳ, z̄)(λ_b) Δλ_b / ∫ ȳ dλ ──► linear BT.709
//! ```
//!
//! Δλ_b is the weight of a wavelength in the trapezoid rule: half of the distance between its
//! neighbours. A spectrum of 1 W/(m² nm) at all visible wavelengths has Y = 1: these are ratios,
//! not lumens.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec3};

use super::spectra::Band;
use crate::error::{Error, ErrorKind};
use crate::scene::Rgb;

/// A lobe of a colour matching function: height, wavelength of its peak in nm, and its widths below
/// and above that, in nm.
struct Lobe(f64, f64, f64, f64);

/// The colour matching functions as sums of lobes (Wyman, Sloan and Shirley 2013, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), table 1). Their error is
/// less than the variation between observers.
const X: [Lobe; 3] = [
    Lobe(1.056, 599.8, 37.9, 31.0),
    Lobe(0.362, 442.0, 16.0, 26.7),
    Lobe(-0.065, 501.1, 20.4, 26.2),
];
const Y: [Lobe; 2] = [Lobe(0.821, 568.8, 46.9, 40.5), Lobe(0.286, 530.9, 16.3, 31.1)];
const Z: [Lobe; 2] = [Lobe(1.217, 437.0, 11.8, 36.0), Lobe(0.681, 459.0, 26.0, 13.8)];

/// Converts XYZ to linear BT.709 with its white point D65 (IEC 61966-2-1), by columns.
const LINEAR_SRGB: DMat3 = DMat3::from_cols(
    DVec3::new(3.240_454_2, -0.969_266_0, 0.055_643_4),
    DVec3::new(-1.537_138_5, 1.876_010_8, -0.204_025_9),
    DVec3::new(-0.498_531_4, 0.041_556_0, 1.057_225_2),
);

impl Lobe {
    fn at(&self, nm: f64) -> f64 {
        let &Lobe(height, top, below, above) = self;
        let t = (nm - top) / if nm < top { below } else { above };
        height * libm::exp(-0.5 * t * t)
    }

    /// Its integral over all wavelengths, nm: that of two halves of a Gaussian.
    fn integral(&self) -> f64 {
        let &Lobe(height, _, below, above) = self;
        height * (below + above) * FRAC_PI_2.sqrt()
    }
}

/// The colour matching functions x̄, ȳ and z̄ at a wavelength in nm.
pub fn colour_matching(nm: f64) -> DVec3 {
    let sum = |lobes: &[Lobe]| lobes.iter().map(|lobe| lobe.at(nm)).sum();
    DVec3::new(sum(&X), sum(&Y), sum(&Z))
}

/// `xyz` as linear BT.709, the colours of sRGB; a channel may be below 0.
pub fn linear_srgb(xyz: DVec3) -> Rgb {
    LINEAR_SRGB * xyz
}

/// Weights of bands for the standard observer.
#[derive(Clone, Debug, PartialEq)]
pub struct Observer {
    /// Index of each band and the XYZ of its unit, by ascending wavelength: sums have the same bits
    /// in any order of the bands.
    weights: Vec<(usize, DVec3)>,
}

impl Observer {
    /// The weights of `bands`, all of which have wavelengths. Invisible bands have weights near 0.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for fewer than two bands, one without a wavelength, or two with the
    /// same.
    pub fn new(bands: &[Band]) -> Result<Observer, Error> {
        let wrong = |found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Setting, "colours of bands", found, remedy))
        };
        let mut numbered: Vec<(f64, usize)> = vec![];
        for (b, band) in bands.iter().enumerate() {
            match band.wavelength {
                Some(nm) => numbered.push((nm, b)),
                None => {
                    let found = format!("band {} has no wavelength", band.name);
                    return wrong(found, "give all bands theirs");
                }
            }
        }
        numbered.sort_by(|a, b| a.0.total_cmp(&b.0));
        let [(first, _), .., (last, _)] = numbered[..] else {
            return wrong(format!("{} bands", bands.len()), "give two or more");
        };
        if let Some(same) = numbered.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return wrong(format!("two bands at {} nm", same[0].0), "give each its own wavelength");
        }
        let luminance: f64 = Y.iter().map(Lobe::integral).sum();
        let nm = |k: usize| numbered[k.min(numbered.len() - 1)].0;
        let weights = numbered.iter().enumerate().map(|(k, &(at, b))| {
            let low = if at == first { at } else { (nm(k - 1) + at) / 2.0 };
            let high = if at == last { at } else { (at + nm(k + 1)) / 2.0 };
            (b, colour_matching(at) * ((high - low) / luminance))
        });
        Ok(Observer { weights: weights.collect() })
    }

    /// XYZ of `values`, one per band.
    pub fn xyz(&self, values: &[f64]) -> DVec3 {
        self.weights.iter().map(|&(b, weight)| values[b] * weight).sum()
    }

    /// The same converted to linear BT.709.
    pub fn linear_srgb(&self, values: &[f64]) -> Rgb {
        linear_srgb(self.xyz(values))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bands(wavelengths: impl IntoIterator<Item = f64>) -> Vec<Band> {
        let band = |nm: f64| Band { name: nm.to_string(), wavelength: Some(nm) };
        wavelengths.into_iter().map(band).collect()
    }

    /// Some values of the tables of the standard observer (CIE 15), by 50 nm.
    #[test]
    fn lobes_follow_the_standard_observer() {
        for (nm, table) in [
            (450.0, [0.3362, 0.0380, 1.7721]),
            (500.0, [0.0049, 0.3230, 0.2720]),
            (550.0, [0.4334, 0.9950, 0.0087]),
            (600.0, [1.0622, 0.6310, 0.0008]),
            (650.0, [0.2835, 0.1070, 0.0000]),
        ] {
            // The error of the fit there is less than 1 % of the peaks of the functions.
            let off = (colour_matching(nm) - DVec3::from(table)) / DVec3::new(1.06, 1.0, 1.78);
            assert!(off.abs().max_element() < 0.01, "at {nm} nm: {off}");
        }
    }

    #[test]
    fn equal_energy_is_equal_xyz() {
        let observer = Observer::new(&bands((360..=830).step_by(5).map(f64::from))).unwrap();
        let xyz = observer.xyz(&[1.0; 95]);
        // Y is from the fit itself, except for its tails beyond the ends; X and Z of the tables are
        // 1; the error of the fit is 1 % of the peaks over a width of some 100 nm.
        assert!((xyz.y - 1.0).abs() < 1e-4 && xyz.abs_diff_eq(DVec3::ONE, 0.01), "{xyz}");
    }

    /// D65's chromaticity (0.3127, 0.3290) is white.
    #[test]
    fn d65_is_white() {
        let white = linear_srgb(DVec3::new(0.3127 / 0.3290, 1.0, (1.0 - 0.3127 - 0.3290) / 0.3290));
        // Chromaticities of four digits.
        assert!(white.abs_diff_eq(DVec3::ONE, 1e-3), "{white}");
    }

    #[test]
    fn order_of_bands_changes_no_bit() {
        let wavelengths = [470.0, 610.0, 425.5, 530.0, 581.0];
        let values = [0.3, 0.1, 0.7, 0.9, 0.2];
        let xyz = |order: [usize; 5]| {
            let observer = Observer::new(&bands(order.map(|k| wavelengths[k]))).unwrap();
            observer.xyz(&order.map(|k| values[k])).to_array().map(f64::to_bits)
        };
        assert_eq!(xyz([0, 1, 2, 3, 4]), xyz([3, 0, 4, 2, 1]));
        for wrong in [bands([500.0]), bands([500.0, 500.0]), vec![Band::default(); 2], vec![]] {
            assert!(Observer::new(&wrong).is_err());
        }
    }
}
