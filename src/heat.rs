//! Radiative heat transfer between groups with known view factors.
//!
//! Groups are grey in each wavelength band, diffuse, and isothermal; the medium between them does
//! not participate. In every band the radiosity B and the irradiance H of a group are
//! ```text
//! B = ε M(T) + (1 − ε) H        H_i = Σ_j F_ij B_j + open_i M(T_surroundings)
//! ```
//!
//! with M the emission of a black body in the band, σT⁴ in total (M. F. Modest, "Radiative Heat
//! Transfer", 3rd edition 2013, equations 5.28 to 5.31). For a group either the temperature is
//! given, or the net flux out q = Σ ε (M − H), and the temperature is computed; an adiabatic group
//! has q = 0.
//!
//! A two-sided group is a sheet without thickness: each side has its own radiosity and irradiance
//! (a row of the matrix), both have one temperature, and q is the mean over both sides.
//!
//! ```text
//! ViewFactors ─→ one linear system (GMRES) where there is one band or no flux is given
//!             └→ Newton's method around it, in the temperatures of groups with given flux, else
//! ```

mod balance;
mod black_body;
mod bodies;
mod exchange;
mod surface;
mod undetermined;

use std::ops::ControlFlow;

use crate::error::{Error, ErrorKind};
use crate::view_factor::{ViewFactors, are_sides};
use exchange::Exchange;
use surface::{is_temperature, of_group};

pub use balance::{GroupHeat, HeatBalance};
pub use black_body::{STEFAN_BOLTZMANN, share_below};
pub use surface::{Boundary, HeatSettings, Surface};

impl HeatBalance {
    /// Solves for the exchange between the rows of `factors`, one of `surfaces` each. The two sides
    /// of a group have one boundary condition.
    ///
    /// `progress` is called with the residual after every product with the matrix, and may cancel:
    /// then there is no balance. Reflectance may be 1. The result has the same bits on every run.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`], with the name of the group, for a temperature that is negative or
    /// not finite, an emissivity outside [0, 1] or not one per band, a net flux out of a group that
    /// absorbs nothing, a net flux that would require a temperature below 0 K, groups with an
    /// undetermined temperature, different boundary conditions of the sides of a group, and band
    /// edges that do not ascend.
    pub fn of(
        factors: &ViewFactors,
        surfaces: &[Surface],
        settings: &HeatSettings,
        progress: impl FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Option<HeatBalance>, Error> {
        check(factors, surfaces, settings)?;
        undetermined::check(factors, surfaces, settings.band_edges.len() + 1)?;
        let solved = Exchange::new(factors, surfaces, settings).solve(progress)?;
        solved.as_ref().map(HeatBalance::new).transpose()
    }
}

/// Whether every number is in its range.
fn check(
    factors: &ViewFactors,
    surfaces: &[Surface],
    settings: &HeatSettings,
) -> Result<(), Error> {
    let wrong = |place: &str, found: String, remedy: String| {
        Err(Error::new(ErrorKind::Setting, place, found, remedy))
    };
    let edges = &settings.band_edges;
    let ascend = edges.is_sorted_by(|a, b| a < b);
    if !ascend || !edges.iter().all(|&edge| edge > 0.0 && edge.is_finite()) {
        let remedy = "wavelengths must be above 0, finite, and ascend".into();
        return wrong("band edges", format!("{edges:?}"), remedy);
    }
    if !is_temperature(settings.surroundings) {
        let remedy = "it must be at least 0 K, and finite".into();
        return wrong("temperature of the surroundings", settings.surroundings.to_string(), remedy);
    }
    if surfaces.len() != factors.names.len() {
        let remedy = format!("the matrix has {} groups", factors.names.len());
        return wrong("surfaces", surfaces.len().to_string(), remedy);
    }
    let mut groups = factors.names.iter().zip(surfaces);
    groups.try_for_each(|(name, surface)| surface.check(name, edges.len() + 1))?;
    if factors.back_of.len() != surfaces.len() || !are_sides(&factors.back_of) {
        let remedy = "each is none, for a front, or a front that has no other back";
        return wrong("back_of", "numbers of no fronts".into(), remedy.into());
    }
    for (row, front) in factors.back_of.iter().enumerate() {
        let front = front.map_or(row, |front| front as usize);
        let [here, there] = [row, front].map(|row| surfaces[row].boundary);
        if here != there {
            let found = format!("{here:?} of one side, {there:?} of the other");
            let remedy = "a sheet has one temperature, or one net flux out of both sides";
            return Err(of_group(&factors.names[front], found, remedy));
        }
    }
    let bodies = bodies::bodies(factors, surfaces);
    bodies.iter().try_for_each(|body| body.check(&factors.names))
}
