//! Solves for the balance of all groups and bands.
//!
//! The unknown is the radiosity B of each row in each band. One product maps B to the irradiance
//! H = F B + open M, band by band, and H to B = ε M + (1 − ε) H; where the flux q is given, M is
//! determined by Σ ε (M − H) = q, over bands and the sides of a body by their shares of its area:
//! linear in H with one band. With several it is linearized around the last emission, until that
//! converges.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::black_body::{Bands, emission};
use super::bodies::{Body, bodies, body_of_rows};
use super::surface::{Boundary, HeatSettings, Surface};
use crate::error::{Error, ErrorKind};
use crate::linear::gmres;
use crate::view_factor::ViewFactors;

/// Maximum number of Newton steps. Plain choice: a handful suffices, since convergence is
/// quadratic.
const MAX_STEPS: usize = 100;

pub(super) struct Exchange<'a> {
    pub factors: &'a ViewFactors,
    /// One per row.
    pub surfaces: &'a [Surface],
    pub bodies: Vec<Body>,
    /// Per row, the index of its body.
    pub body_of: Vec<usize>,
    pub bands: Bands<'a>,
    /// Emission of the surroundings by band.
    pub surroundings: Vec<f64>,
    /// Black body's emission at the temperature of each body: given, or the current iterate.
    pub emission: Vec<f64>,
}

/// The solution of an exchange.
pub(super) struct Solved<'a> {
    pub exchange: Exchange<'a>,
    /// Of each row in each band.
    pub radiosity: Vec<f64>,
    pub irradiance: Vec<f64>,
    /// Of the linear system, norm over that of the emission.
    pub residual: f64,
    /// Products with the matrix.
    pub products: usize,
}

/// Linearized black body's emission of a body as a function of its irradiance, by band:
/// at + slope · change, where the change is determined by the net flux.
pub(super) struct Linear {
    at: Vec<f64>,
    slope: Vec<f64>,
    /// Flux out, and Σ ε slope; `None` where the temperature is given.
    pub flux: Option<(f64, f64)>,
}

impl<'a> Exchange<'a> {
    pub fn new(
        factors: &'a ViewFactors,
        surfaces: &'a [Surface],
        settings: &'a HeatSettings,
    ) -> Exchange<'a> {
        let bands = Bands { edges: &settings.band_edges };
        let mut surroundings = vec![0.0; bands.count()];
        let outside = emission(settings.surroundings);
        bands.emission(outside, &mut surroundings);
        let bodies = bodies(factors, surfaces);
        let body_of = body_of_rows(&bodies, surfaces.len());
        let known = bodies.iter().map(|body| match body.boundary {
            Boundary::Temperature(t) => emission(t),
            Boundary::NetFlux(q) => q.abs(),
        });
        // Unknown emissions begin with the largest known one: there no share is 0.
        let largest = known.fold(outside, f64::max);
        let emission = bodies.iter().map(|body| match body.boundary {
            Boundary::Temperature(t) => emission(t),
            Boundary::NetFlux(_) => largest,
        });
        let emission = emission.collect();
        Exchange { factors, surfaces, bodies, body_of, bands, surroundings, emission }
    }

    pub fn solve(
        mut self,
        mut progress: impl FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Option<Solved<'a>>, Error> {
        let (rows, bands) = (self.surfaces.len(), self.bands.count());
        let weights: Vec<f64> =
            self.factors.areas.iter().flat_map(|&a| std::iter::repeat_n(a, bands)).collect();
        let is_linear = bands == 1
            || self.surfaces.iter().all(|s| matches!(s.boundary, Boundary::Temperature(_)));
        let mut radiosity = vec![0.0; rows * bands];
        let (mut products, mut change_before) = (0, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let bodies = 0..self.bodies.len();
            let linear: Vec<Linear> = bodies.map(|k| self.linear(k)).collect();
            let nothing = vec![0.0; rows * bands];
            let right = self.leaving(&linear, &self.irradiance(&nothing, true), true);
            let product = |b: &[f64]| {
                let mut image = self.leaving(&linear, &self.irradiance(b, false), false);
                image.iter_mut().zip(b).for_each(|(k, b)| *k = b - *k);
                image
            };
            let solved = gmres::solve(product, &right, &weights, &mut radiosity, &mut progress);
            let Some(solved) = solved else { return Ok(None) };
            products += solved.products;
            if !solved.residual.is_finite() {
                let found = "fluxes that are too large for 64-bit floats";
                let remedy = "view factors are at most 1";
                return Err(Error::new(ErrorKind::Setting, "heat", found, remedy));
            }
            let irradiance = self.irradiance(&radiosity, true);
            let change = self.update_emission(&irradiance);
            // Below a millionth each step squares the change, unless it is rounding; so are changes
            // below 1e-13.
            let is_rounding = change < 1e-6 && change > 0.5 * change_before;
            if is_linear || change <= 1e-13 || is_rounding {
                let (exchange, residual) = (self, solved.residual);
                return Ok(Some(Solved { exchange, radiosity, irradiance, residual, products }));
            }
            change_before = change;
        }
        Err(Error::new(
            ErrorKind::Setting,
            "groups with given flux",
            format!("no temperatures after {MAX_STEPS} steps"),
            "take fewer bands, or give temperatures",
        ))
    }

    /// Linearizes the emission of body `k` around its current iterate.
    pub fn linear(&self, k: usize) -> Linear {
        let bands = self.bands.count();
        let (mut at, mut slope) = (vec![0.0; bands], vec![0.0; bands]);
        self.bands.emission(self.emission[k], &mut at);
        let Body { boundary, emissivity, .. } = &self.bodies[k];
        let flux = match *boundary {
            Boundary::Temperature(_) => None,
            Boundary::NetFlux(q) => {
                self.bands.slopes(self.emission[k], &mut slope);
                Some((q, emissivity.iter().zip(&slope).map(|(e, s)| e * s).sum()))
            }
        };
        Linear { at, slope, flux }
    }

    /// Irradiance of each row in each band from the others and, if `from_outside`, the
    /// surroundings.
    fn irradiance(&self, radiosity: &[f64], from_outside: bool) -> Vec<f64> {
        let bands = self.bands.count();
        let mut irradiance = vec![0.0; radiosity.len()];
        let rows = irradiance.par_chunks_mut(bands).zip(&self.factors.factors);
        rows.zip(&self.factors.open).for_each(|((arriving, row), open)| {
            for factor in row {
                let from = &radiosity[factor.to as usize * bands..][..bands];
                arriving.iter_mut().zip(from).for_each(|(h, b)| *h += factor.value * b);
            }
            if from_outside {
                let from = arriving.iter_mut().zip(&self.surroundings);
                from.for_each(|(h, m)| *h += open.value * m);
            }
        });
        irradiance
    }

    /// Radiosity of each row in each band for this irradiance; without `given`, only the part that
    /// is proportional to the irradiance.
    fn leaving(&self, linear: &[Linear], irradiance: &[f64], given: bool) -> Vec<f64> {
        let bands = self.bands.count();
        let constant = if given { 1.0 } else { 0.0 };
        let change = |(body, linear): (&Body, &Linear)| match linear.flux {
            Some((q, slope)) if slope > 0.0 => {
                let net = |row, band| constant * linear.at[band] - irradiance[row * bands + band];
                (constant * q - body.absorbed(self.surfaces, net)) / slope
            }
            _ => 0.0,
        };
        let changes: Vec<f64> = self.bodies.par_iter().zip(linear).map(change).collect();
        let mut leaving = irradiance.to_vec();
        let rows = leaving.par_chunks_mut(bands).zip(&self.body_of).zip(self.surfaces);
        rows.for_each(|((leaving, &body), surface)| {
            let linear = &linear[body];
            for (band, b) in leaving.iter_mut().enumerate() {
                let emitted = constant * linear.at[band] + linear.slope[band] * changes[body];
                let e = surface.emissivity[band];
                *b = e * emitted + (1.0 - e) * *b;
            }
        });
        leaving
    }

    /// What body `k` absorbs of this irradiance, W/m² of its area.
    pub fn absorbed(&self, k: usize, irradiance: &[f64]) -> f64 {
        let bands = self.bands.count();
        self.bodies[k].absorbed(self.surfaces, |row, band| irradiance[row * bands + band])
    }

    /// Sets the emission of bodies with given flux from their irradiance, and returns the largest
    /// relative change.
    fn update_emission(&mut self, irradiance: &[f64]) -> f64 {
        let emissions: Vec<f64> = (0..self.bodies.len())
            .into_par_iter()
            .map(|k| match self.bodies[k].boundary {
                Boundary::Temperature(_) => self.emission[k],
                Boundary::NetFlux(q) => {
                    let emitted = q + self.absorbed(k, irradiance);
                    emission_of(&self.bands, &self.bodies[k].emissivity, emitted)
                }
            })
            .collect();
        let before = std::mem::replace(&mut self.emission, emissions);
        let changes = self.emission.iter().zip(&before);
        changes
            .map(|(now, before)| (now - before).abs() / now.abs().max(f64::MIN_POSITIVE))
            .fold(0.0, f64::max)
    }
}

/// Emission M of a black body for which a group with this emissivity by band emits `emitted`;
/// negative where `emitted` is.
fn emission_of(bands: &Bands, emissivity: &[f64], emitted: f64) -> f64 {
    if let &[e] = emissivity {
        return if e > 0.0 { emitted / e } else { 0.0 };
    }
    let largest = emissivity.iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        return 0.0;
    }
    // Lower bound: the largest emissivity in every band.
    let mut low = emitted / largest;
    if low <= 0.0 {
        return low;
    }
    let mut by_band = vec![0.0; bands.count()];
    let mut of = |all: f64| {
        bands.emission(all, &mut by_band);
        emissivity.iter().zip(&by_band).map(|(e, m)| e * m).sum::<f64>()
    };
    let mut high = low;
    while of(high) < emitted && high < f64::MAX / 4.0 {
        (low, high) = (high, 4.0 * high);
    }
    // It grows with M: bisection to the last bit.
    loop {
        let middle = low + 0.5 * (high - low);
        if !(middle > low && middle < high) {
            return middle;
        }
        if of(middle) < emitted { low = middle } else { high = middle }
    }
}
