//! Properties of groups.

use crate::error::{Error, ErrorKind, quoted};

/// Boundary condition of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary {
    /// Its temperature, K.
    Temperature(f64),
    /// The net flux out of it, W/m²: heat supplied from within or behind; 0 if it is adiabatic.
    NetFlux(f64),
}

/// Thermal properties of a group.
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

/// The error for an invalid property of group `name`.
pub(super) fn of_group(name: &str, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::Setting, format!("group {}", quoted(&[name])), found, remedy)
}
