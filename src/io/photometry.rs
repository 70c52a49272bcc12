//! Photometric files of luminaires: IESNA LM-63 (`.ies`), EULUMDAT (`.ldt`).
//!
//! ```text
//! bytes ─► text ─► numbers ─► planes, unfolded by symmetry ─► IntensityDistribution
//!                                                          └► opening, in metres
//! ```
//!
//! Real files have defects. Those that can be interpreted are repaired and reported
//! ([`Photometry::warnings`]); others are refused with their line.

mod eulumdat;
mod lamp_set;
mod lm_63;
mod numbers;
mod planes;

use std::sync::Arc;

use glam::DVec3;

use super::{Input, files};
use crate::error::Error;
use crate::scene::{IntensityDistribution, Luminaire, Opening};

/// The luminaire of a photometric file.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Photometry {
    /// Name in the file; may be empty.
    pub name: String,
    /// Intensity by direction, cd.
    pub intensity: Arc<IntensityDistribution>,
    /// Luminous opening, metres.
    pub opening: Opening,
    /// Flux of the lamps as given in the file, lm; none if intensities are absolute.
    pub lamp_flux: Option<f64>,
    /// Electric power, W; 0 if the file does not give it.
    pub power: f64,
    /// Defects and their repairs.
    pub warnings: Vec<String>,
}

impl Photometry {
    /// A luminaire of this kind in a scene whose unit is a metre, aiming at `aim` from `position`:
    /// see [`Luminaire::new`] and [`Luminaire::in_unit_of`].
    pub fn luminaire(&self, position: DVec3, aim: DVec3) -> Luminaire {
        let plain = Luminaire::new(self.intensity.clone(), position, aim);
        Luminaire { opening: self.opening, ..plain }
    }
}

/// Which luminaire is read, of files with several.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct PhotometrySettings {
    /// Number of the set of lamps, from 1, of EULUMDAT files with several: they are alternatives.
    /// Without it, sets of unequal flux are an error.
    pub lamp_set: Option<usize>,
}

impl PhotometrySettings {
    /// Reads an IESNA LM-63 file of 1986 to 2019, of any photometric type, or a EULUMDAT file; the
    /// format is detected from the content.
    ///
    /// Intensities become candela: of LM-63 times the multiplier and the ballast's factors; of
    /// EULUMDAT, which has them per 1000 lm, times the flux of a set of lamps. Their light is in
    /// lumens and lux: then all numbers of the scene should be photometric, `Ke` in cd/m².
    ///
    /// # Errors
    /// [`crate::ErrorKind::File`] when the file cannot be read or has more than 4 MiB;
    /// [`crate::ErrorKind::Scene`] with its line if it is of neither format, ends early, has
    /// invalid numbers, or has several sets of lamps, none of which is chosen.
    pub fn read<'i>(&self, file: impl Into<Input<'i>>) -> Result<Photometry, Error> {
        let file = file.into();
        // Five times the bytes of a file with 361 × 181 values.
        let bytes = file.read(1 << 22, "give an IESNA LM-63 (.ies) or EULUMDAT (.ldt) file")?;
        let (text, _) = files::decode(bytes.into_owned());
        match lm_63::is_lm_63(&text) {
            true => lm_63::read(file.path(), &text),
            false => eulumdat::read(file.path(), &text, self.lamp_set),
        }
    }
}

/// [`PhotometrySettings::read`] of a file with one luminaire.
///
/// # Errors
/// Those of [`PhotometrySettings::read`].
pub fn read_photometry<'i>(file: impl Into<Input<'i>>) -> Result<Photometry, Error> {
    PhotometrySettings::default().read(file)
}

/// `text` as a name.
fn name_of(text: &str) -> String {
    text.trim().chars().filter(|c| !c.is_control()).take(100).collect()
}
