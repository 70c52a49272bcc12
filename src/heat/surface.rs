//! Properties of groups.

use super::black_body::emission;
use crate::error::{Error, ErrorKind, quoted};

/// Boundary condition of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary {
    /// Its temperature, K.
    Temperature(f64),
    /// The net flux out of it, W/m²: heat supplied from within or behind; 0 if it is adiabatic. Of
    /// a two-sided group the mean over both sides.
    NetFlux(f64),
}

/// Thermal properties of a group, or of one side of a two-sided one.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Its temperature or its net flux.
    pub boundary: Boundary,
    /// Hemispherical emissivity in each band, in [0, 1]; the reflectance is 1 − emissivity.
    pub emissivity: Vec<f64>,
}

/// Settings common to all groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatSettings {
    /// Wavelengths that separate the bands, µm, ascending: n of them make n + 1 bands, the first
    /// from 0 and the last to infinity. Empty for one band of all wavelengths.
    pub band_edges: Vec<f64>,
    /// Temperature of the surroundings seen through the open parts of the enclosure, K; they are
    /// black.
    pub surroundings: f64,
}

impl Surface {
    /// Whether every number of group `name` is in its range.
    pub(super) fn check(&self, name: &str, bands: usize) -> Result<(), Error> {
        if self.emissivity.len() != bands {
            let found = format!("{} emissivities", self.emissivity.len());
            return Err(of_group(name, found, format!("one for each of the {bands} bands")));
        }
        if let Some(e) = self.emissivity.iter().find(|e| !(0.0..=1.0).contains(*e)) {
            return Err(of_group(name, format!("emissivity {e}"), "it must be in [0, 1]"));
        }
        match self.boundary {
            Boundary::Temperature(t) if !is_temperature(t) => {
                let remedy = "it must be at least 0 K, and finite";
                Err(of_group(name, format!("temperature {t}"), remedy))
            }
            Boundary::NetFlux(q) if !q.is_finite() => {
                Err(of_group(name, format!("net flux {q}"), "it must be finite"))
            }
            _ => Ok(()),
        }
    }
}

/// Whether a black body can have temperature `t`, K.
pub(super) fn is_temperature(t: f64) -> bool {
    t >= 0.0 && emission(t).is_finite()
}

/// The error for an invalid property of group `name`.
pub(super) fn of_group(name: &str, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::Setting, format!("group {}", quoted(&[name])), found, remedy)
}
