//! What has been found of groups.

use crate::view_factor::Estimate;

/// A group's share in the exchange, all bands together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupHeat {
    /// K; none for an adiabatic group that reflects all: nothing depends on it.
    pub temperature: Option<f64>,
    /// What leaves, W/m².
    pub radiosity: f64,
    /// What arrives, W/m².
    pub irradiance: f64,
    /// Net flux out, W/m²: given, or ε (M − H). Its standard error is that of the factors in the
    /// group's own row, taken as independent: an upper bound where they sum to 1 by construction.
    pub net_flux: Estimate,
}

/// The exchange, and how well it balances.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatBalance {
    /// In the order of the matrix.
    pub groups: Vec<GroupHeat>,
    /// Net power out through the open parts of the enclosure, W.
    pub lost_to_surroundings: f64,
    /// Power that met the backs of surfaces and is lost there, W.
    pub lost_to_backs: f64,
    /// Net power out of all groups less what is lost, W: zero for factors with closure and
    /// reciprocity.
    pub imbalance: f64,
    /// What is left of the linear system, norm over that of the emission.
    pub residual: f64,
    /// Products with the matrix that the solution took.
    pub products: usize,
}
