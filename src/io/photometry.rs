//! Files that hold how a luminaire spreads its light: IESNA LM-63 (`.ies`), EULUMDAT (`.ldt`).
//!
//! ```text
//! bytes ─► text ─► numbers ─► planes, unfolded by symmetry ─► IntensityDistribution
//!                                                          └► opening, in metres
//! ```
//!
//! Real files are odd. What can be understood is repaired and told ([`Photometry::warnings`]); what
//! cannot is refused with its line.

mod eulumdat;
mod lm_63;
mod numbers;
mod planes;

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;

use super::files;
use crate::error::{Error, ErrorKind};
use crate::scene::{IntensityDistribution, Luminaire, Opening};

/// Bytes that a file may have: five times those of one with 361 × 181 values.
const MAX_BYTES: u64 = 1 << 22;

/// What a photometric file says of a luminaire.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Photometry {
    /// What it is called, as the file has it; may be empty.
    pub name: String,
    /// Intensity by direction, cd.
    pub intensity: Arc<IntensityDistribution>,
    /// What of it shines, metres.
    pub opening: Opening,
    /// Flux that the file says its lamps have, lm; none where intensities are absolute.
    pub lamp_flux: Option<f64>,
    /// Electric power, W; 0 where the file does not say.
    pub power: f64,
    /// What was odd, and what was made of it.
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

/// Reads an IESNA LM-63 file of 1986 to 2019, of any photometric type, or a EULUMDAT file; the
/// content says which of them it is.
///
/// Intensities become candela: of LM-63 times the multiplier and the ballast's factors; of
/// EULUMDAT, which has them per 1000 lm, times the flux of the first set of lamps. Light from them
/// is in lumens and lux: then all numbers of the scene should be photometric, `Ke` in cd/m².
///
/// # Errors
/// [`ErrorKind::File`] when the file cannot be read or has more than 4 MiB; [`ErrorKind::Scene`]
/// with its line for what is no such file, ends early, or has numbers without a meaning.
pub fn read_photometry(path: impl AsRef<Path>) -> Result<Photometry, Error> {
    let path = path.as_ref();
    let bytes = files::read_bytes(path, MAX_BYTES).map_err(|e| {
        let remedy = "give an IESNA LM-63 (.ies) or EULUMDAT (.ldt) file";
        let found = format!("cannot be read: {e}");
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy).with_source(e)
    })?;
    photometry_from_bytes(path, bytes)
}

/// [`read_photometry`] from memory; `name` is for messages.
///
/// # Errors
/// Those of [`read_photometry`].
pub fn photometry_from_bytes(name: impl AsRef<Path>, bytes: Vec<u8>) -> Result<Photometry, Error> {
    let name = name.as_ref();
    let (text, _) = files::decode(bytes);
    match lm_63::is_lm_63(&text) {
        true => lm_63::read(name, &text),
        false => eulumdat::read(name, &text),
    }
}

/// At most so many characters of a name are kept.
const MAX_NAME: usize = 100;

/// `text` as a name.
fn name_of(text: &str) -> String {
    text.trim().chars().filter(|c| !c.is_control()).take(MAX_NAME).collect()
}
