//! Results of a heat balance.

use crate::view_factor::Estimate;

/// Heat exchange of a group, all bands together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupHeat {
    /// K; `None` for an adiabatic group that reflects all: its temperature has no effect.
    pub temperature: Option<f64>,
    /// Leaving flux, W/m².
    pub radiosity: f64,
    /// Arriving flux, W/m².
    pub irradiance: f64,
    /// Net flux out, W/m²: given, or ε (M − H). Its standard error is that of the factors in the
    /// group's own row, assumed independent: an upper bound where they sum to 1 by construction.
    pub net_flux: Estimate,
}

/// The exchange, and its energy balance.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatBalance {
    /// In the order of the matrix.
    pub groups: Vec<GroupHeat>,
    /// Net power out through the open parts of the enclosure, W.
    pub lost_to_surroundings: f64,
    /// Power that arrives at the backs of surfaces and is lost there, W.
    pub lost_to_backs: f64,
    /// Net power out of all groups less the losses, W: zero for factors with closure and
    /// reciprocity.
    pub imbalance: f64,
    /// Residual of the linear system, norm over that of the emission.
    pub residual: f64,
    /// Number of products with the matrix.
    pub products: usize,
}
