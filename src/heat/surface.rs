//! What is known of groups.

use crate::error::{Error, ErrorKind, quoted};

/// What is known of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boundary {
    /// Its temperature, K.
    Temperature(f64),
    /// The net flux out of it, W/m²: what heats it from within or behind; 0 if it is adiabatic.
    NetFlux(f64),
}

/// A group as heat sees it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    /// Its temperature or its net flux.
    pub boundary: Boundary,
    /// Hemispherical emissivity in each band, in [0, 1]; reflectance is what is missing from 1.
    pub emissivity: Vec<f64>,
}

/// What all groups share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatSettings {
    /// Wavelengths that separate the bands, µm, ascending: n of them make n + 1 bands, the first
    /// from 0 and the last to infinity. None for one band of all wavelengths.
    pub band_edges: Vec<f64>,
    /// Temperature of what is seen through the open parts of the enclosure, K; it is black.
    pub surroundings: f64,
}

/// The error that something is wrong with group `name`.
pub(super) fn of_group(name: &str, found: impl Into<String>, remedy: impl Into<String>) -> Error {
    Error::new(ErrorKind::Setting, format!("group {}", quoted(&[name])), found, remedy)
}
