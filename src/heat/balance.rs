//! Results of a heat balance.

use super::black_body::temperature;
use super::bodies::Side;
use super::exchange::{Exchange, Solved};
use super::surface::{Boundary, of_group};
use crate::error::Error;
use crate::view_factor::Estimate;

/// Heat exchange of a row of the matrix: of a group, or of one side of a two-sided one; all bands
/// together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupHeat {
    /// K; `None` for an adiabatic group that reflects all: its temperature has no effect. The same
    /// for both sides of a group.
    pub temperature: Option<f64>,
    /// Leaving flux, W/m².
    pub radiosity: f64,
    /// Arriving flux, W/m².
    pub irradiance: f64,
    /// Net flux out, W/m²: given, or ε (M − H). Its standard error is that of the factors in the
    /// rows of the group, assumed independent: an upper bound where they sum to 1 by construction.
    pub net_flux: Estimate,
}

/// The exchange, and its energy balance. Powers are in W where lengths are in metres, else in W/m²
/// times the square of the scene's unit.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatBalance {
    /// In the order of the matrix.
    pub groups: Vec<GroupHeat>,
    /// Net power out of all groups that give more than they take, both sides together.
    pub supplied: f64,
    /// Net power out through the open parts of the enclosure.
    pub lost_to_surroundings: f64,
    /// Power that arrives at the backs of surfaces and is lost there.
    pub lost_to_backs: f64,
    /// Net power out of all groups less the losses: zero for factors with closure and reciprocity.
    pub imbalance: f64,
    /// Residual of the linear system, norm over that of the emission.
    pub residual: f64,
    /// Number of products with the matrix.
    pub products: usize,
}

impl HeatBalance {
    /// The balance of a solution.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] for a net flux that would require a temperature below 0 K.
    pub(super) fn new(solved: &Solved) -> Result<HeatBalance, Error> {
        let Solved { exchange, radiosity, irradiance, residual, products } = solved;
        let bands = exchange.bands.count();
        let of = |v: &[f64], i: usize| v[i * bands..][..bands].iter().sum::<f64>();
        let outside: f64 = exchange.surroundings.iter().sum();
        let (mut lost_to_surroundings, mut lost_to_backs, mut net_power) = (0.0, 0.0, 0.0);
        let mut powers = vec![0.0; exchange.bodies.len()];
        let mut groups = Vec::with_capacity(exchange.surfaces.len());
        for (i, &body) in exchange.body_of.iter().enumerate() {
            let (b, irradiance) = (of(radiosity, i), of(irradiance, i));
            let temperature = solved.temperature(body)?;
            let net_flux = solved.net_flux(i);
            let area = exchange.factors.areas[i];
            net_power += area * net_flux.value;
            powers[body] += area * net_flux.value;
            lost_to_surroundings += area * exchange.factors.open[i].value * (b - outside);
            lost_to_backs += area * exchange.factors.back[i].value * b;
            groups.push(GroupHeat { temperature, radiosity: b, irradiance, net_flux });
        }
        Ok(HeatBalance {
            groups,
            supplied: powers.iter().map(|power| power.max(0.0)).sum(),
            lost_to_surroundings,
            lost_to_backs,
            imbalance: net_power - lost_to_surroundings - lost_to_backs,
            residual: *residual,
            products: *products,
        })
    }
}

impl Solved<'_> {
    /// Net flux out of row `i`.
    fn net_flux(&self, i: usize) -> Estimate {
        let exchange = &self.exchange;
        let body = &exchange.bodies[exchange.body_of[i]];
        let value = match (body.boundary, body.sides.as_slice()) {
            (Boundary::NetFlux(q), [_]) => q,
            _ => {
                let bands = exchange.bands.count();
                let mut emission = vec![0.0; bands];
                exchange.bands.emission(exchange.emission[exchange.body_of[i]], &mut emission);
                let arriving = &self.irradiance[i * bands..][..bands];
                let pairs = exchange.surfaces[i].emissivity.iter().zip(emission).zip(arriving);
                pairs.map(|((e, m), h)| e * (m - h)).sum()
            }
        };
        Estimate { value, error: self.flux_error(i) }
    }

    /// Standard error of the net flux out of row `i` due to the errors of the factors in the rows
    /// of its body.
    ///
    /// A body with given flux emits in all what its sides absorb more, by their shares of its area;
    /// row `i` emits `own` times that.
    fn flux_error(&self, i: usize) -> f64 {
        let body = self.exchange.body_of[i];
        let own = match self.exchange.linear(body).flux {
            None => 0.0,
            Some((_, all)) if all > 0.0 => self.emitted_slope(i) / all,
            Some(_) => 1.0,
        };
        let of_side = |side: &Side| {
            let absorbed_here = if side.row == i { 1.0 } else { 0.0 };
            (absorbed_here - own * side.share) * self.absorbed_error(side.row)
        };
        let sides = &self.exchange.bodies[body].sides;
        sides.iter().map(|side| of_side(side).powi(2)).sum::<f64>().sqrt()
    }

    /// Derivative of what row `i` emits by the black body's emission.
    fn emitted_slope(&self, i: usize) -> f64 {
        let Exchange { bands, emission, body_of, surfaces, .. } = &self.exchange;
        let mut slope = vec![0.0; bands.count()];
        bands.slopes(emission[body_of[i]], &mut slope);
        surfaces[i].emissivity.iter().zip(&slope).map(|(e, s)| e * s).sum()
    }

    /// Standard error of the flux that row `i` absorbs.
    fn absorbed_error(&self, i: usize) -> f64 {
        let Exchange { bands, factors, surfaces, .. } = &self.exchange;
        let squares = factors.factors[i].iter().map(|factor| {
            let from = &self.radiosity[factor.to as usize * bands.count()..][..bands.count()];
            let absorbed = surfaces[i].emissivity.iter().zip(from).map(|(e, b)| e * b);
            (factor.error * absorbed.sum::<f64>()).powi(2)
        });
        squares.sum::<f64>().sqrt()
    }

    /// Temperature of body `k`.
    fn temperature(&self, k: usize) -> Result<Option<f64>, Error> {
        let Exchange { bodies, emission, factors, .. } = &self.exchange;
        let body = &bodies[k];
        let q = match body.boundary {
            Boundary::Temperature(t) => return Ok(Some(t)),
            Boundary::NetFlux(q) => q,
        };
        if body.emissivity.iter().all(|&e| e == 0.0) {
            return Ok(None);
        }
        if emission[k] < 0.0 {
            // The irradiance with this flux is less than with none: at 0 K a group takes in most.
            let absorbed = self.exchange.absorbed(k, &self.irradiance);
            let found = format!("net flux {q} where {absorbed:.6e} is absorbed");
            let remedy = "no temperature emits less than nothing: take less heat from it";
            return Err(of_group(&factors.names[body.sides[0].row], found, remedy));
        }
        Ok(Some(temperature(emission[k])))
    }
}
