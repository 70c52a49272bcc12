//! Solves for the balance of all groups and bands.
//!
//! The unknown is the radiosity B of each group in each band. One product maps B to the irradiance
//! H = F B + open M, band by band, and H to B = ε M + (1 − ε) H; where the flux q is given, M is
//! determined by Σ ε (M − H) = q, linear in H with one band. With several it is linearized around
//! the last emission, until that converges.

use std::ops::ControlFlow;

use rayon::prelude::*;

use super::balance::{GroupHeat, HeatBalance};
use super::black_body::{Bands, emission, temperature};
use super::surface::{Boundary, HeatSettings, Surface, of_group};
use crate::error::{Error, ErrorKind};
use crate::linear::gmres;
use crate::view_factor::{Estimate, ViewFactors};

/// Maximum number of Newton steps. Plain choice: a handful suffices, since convergence is
/// quadratic.
const MAX_STEPS: usize = 100;

pub(super) struct Exchange<'a> {
    factors: &'a ViewFactors,
    surfaces: &'a [Surface],
    bands: Bands<'a>,
    /// Emission of the surroundings by band.
    surroundings: Vec<f64>,
    /// Black body's emission at the temperature of each group: given, or the current iterate.
    emission: Vec<f64>,
}

/// Linearized black body's emission of a group as a function of its irradiance, by band:
/// at + slope · change, where the change is determined by the net flux.
struct Linear {
    at: Vec<f64>,
    slope: Vec<f64>,
    /// Flux out, and Σ ε slope; `None` where the temperature is given.
    flux: Option<(f64, f64)>,
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
        let known = surfaces.iter().map(|s| match s.boundary {
            Boundary::Temperature(t) => emission(t),
            Boundary::NetFlux(q) => q.abs(),
        });
        // Unknown emissions begin with the largest known one: there no share is 0.
        let largest = known.fold(outside, f64::max);
        let emission = surfaces.iter().map(|s| match s.boundary {
            Boundary::Temperature(t) => emission(t),
            Boundary::NetFlux(_) => largest,
        });
        let emission = emission.collect();
        Exchange { factors, surfaces, bands, surroundings, emission }
    }

    pub fn solve(
        mut self,
        mut progress: impl FnMut(f64) -> ControlFlow<()>,
    ) -> Result<Option<HeatBalance>, Error> {
        let (groups, bands) = (self.surfaces.len(), self.bands.count());
        let weights: Vec<f64> =
            self.factors.areas.iter().flat_map(|&a| std::iter::repeat_n(a, bands)).collect();
        let is_linear = bands == 1
            || self.surfaces.iter().all(|s| matches!(s.boundary, Boundary::Temperature(_)));
        let mut radiosity = vec![0.0; groups * bands];
        let (mut products, mut change_before) = (0, f64::INFINITY);
        for _ in 0..MAX_STEPS {
            let linear: Vec<Linear> = (0..groups).map(|i| self.linear(i)).collect();
            let nothing = vec![0.0; groups * bands];
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
                let residual = solved.residual;
                return self.balance(&radiosity, &irradiance, residual, products).map(Some);
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

    /// Linearizes the emission of group `i` around its current iterate.
    fn linear(&self, i: usize) -> Linear {
        let bands = self.bands.count();
        let (mut at, mut slope) = (vec![0.0; bands], vec![0.0; bands]);
        self.bands.emission(self.emission[i], &mut at);
        let flux = match self.surfaces[i].boundary {
            Boundary::Temperature(_) => None,
            Boundary::NetFlux(q) => {
                self.bands.slopes(self.emission[i], &mut slope);
                let emissivity = &self.surfaces[i].emissivity;
                Some((q, emissivity.iter().zip(&slope).map(|(e, s)| e * s).sum()))
            }
        };
        Linear { at, slope, flux }
    }

    /// Irradiance of each group in each band from the others and, if `from_outside`, the
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

    /// Radiosity of each group in each band for this irradiance; without `given`, only the part
    /// that is proportional to the irradiance.
    fn leaving(&self, linear: &[Linear], irradiance: &[f64], given: bool) -> Vec<f64> {
        let bands = self.bands.count();
        let mut leaving = irradiance.to_vec();
        let groups = leaving.par_chunks_mut(bands).zip(linear).zip(self.surfaces);
        groups.for_each(|((leaving, linear), surface)| {
            let constant = if given { 1.0 } else { 0.0 };
            let net = |leaving: &[f64]| {
                let pairs = surface.emissivity.iter().zip(&linear.at).zip(leaving);
                pairs.map(|((e, m), h)| e * (constant * m - h)).sum::<f64>()
            };
            let change = match linear.flux {
                Some((q, slope)) if slope > 0.0 => (constant * q - net(leaving)) / slope,
                _ => 0.0,
            };
            for (band, b) in leaving.iter_mut().enumerate() {
                let emitted = constant * linear.at[band] + linear.slope[band] * change;
                let e = surface.emissivity[band];
                *b = e * emitted + (1.0 - e) * *b;
            }
        });
        leaving
    }

    /// Sets the emission of groups with given flux from their irradiance, and returns the largest
    /// relative change.
    fn update_emission(&mut self, irradiance: &[f64]) -> f64 {
        let (bands, surfaces) = (&self.bands, self.surfaces);
        let count = bands.count();
        let groups = self.emission.par_iter_mut().zip(surfaces);
        let changes: Vec<f64> = groups
            .zip(irradiance.par_chunks(count))
            .map(|((emission, surface), irradiance)| {
                let Boundary::NetFlux(q) = surface.boundary else { return 0.0 };
                let absorbed = surface.emissivity.iter().zip(irradiance).map(|(e, h)| e * h);
                let emitted = q + absorbed.sum::<f64>();
                let before =
                    std::mem::replace(emission, emission_of(bands, &surface.emissivity, emitted));
                (*emission - before).abs() / emission.abs().max(f64::MIN_POSITIVE)
            })
            .collect();
        changes.into_iter().fold(0.0, f64::max)
    }

    fn balance(
        &self,
        radiosity: &[f64],
        irradiance: &[f64],
        residual: f64,
        products: usize,
    ) -> Result<HeatBalance, Error> {
        let bands = self.bands.count();
        let of = |v: &[f64], i: usize| v[i * bands..][..bands].iter().sum::<f64>();
        let outside: f64 = self.surroundings.iter().sum();
        let (mut lost_to_surroundings, mut lost_to_backs, mut net_power) = (0.0, 0.0, 0.0);
        let mut groups = Vec::with_capacity(self.surfaces.len());
        for (i, surface) in self.surfaces.iter().enumerate() {
            let (b, h) = (of(radiosity, i), of(irradiance, i));
            let value = self.net_flux(i, irradiance);
            let error = match surface.boundary {
                Boundary::NetFlux(_) => 0.0,
                Boundary::Temperature(_) => self.flux_error(i, radiosity),
            };
            let area = self.factors.areas[i];
            net_power += area * value;
            lost_to_surroundings += area * self.factors.open[i].value * (b - outside);
            lost_to_backs += area * self.factors.back[i].value * b;
            groups.push(GroupHeat {
                temperature: self.temperature(i, irradiance)?,
                radiosity: b,
                irradiance: h,
                net_flux: Estimate { value, error },
            });
        }
        let imbalance = net_power - lost_to_surroundings - lost_to_backs;
        Ok(HeatBalance {
            groups,
            lost_to_surroundings,
            lost_to_backs,
            imbalance,
            residual,
            products,
        })
    }

    fn net_flux(&self, i: usize, irradiance: &[f64]) -> f64 {
        let surface = &self.surfaces[i];
        if let Boundary::NetFlux(q) = surface.boundary {
            return q;
        }
        let bands = self.bands.count();
        let mut emission = vec![0.0; bands];
        self.bands.emission(self.emission[i], &mut emission);
        let arriving = &irradiance[i * bands..][..bands];
        let pairs = surface.emissivity.iter().zip(emission).zip(arriving);
        pairs.map(|((e, m), h)| e * (m - h)).sum()
    }

    /// Standard error of the net flux due to the errors of the factors in row `i`.
    fn flux_error(&self, i: usize, radiosity: &[f64]) -> f64 {
        let bands = self.bands.count();
        let squares = self.factors.factors[i].iter().map(|factor| {
            let from = &radiosity[factor.to as usize * bands..][..bands];
            let absorbed = self.surfaces[i].emissivity.iter().zip(from).map(|(e, b)| e * b);
            (factor.error * absorbed.sum::<f64>()).powi(2)
        });
        squares.sum::<f64>().sqrt()
    }

    fn temperature(&self, i: usize, irradiance: &[f64]) -> Result<Option<f64>, Error> {
        let surface = &self.surfaces[i];
        let q = match surface.boundary {
            Boundary::Temperature(t) => return Ok(Some(t)),
            Boundary::NetFlux(q) => q,
        };
        if surface.emissivity.iter().all(|&e| e == 0.0) {
            return Ok(None);
        }
        let all = self.emission[i];
        if all < 0.0 {
            let arriving = &irradiance[i * self.bands.count()..][..self.bands.count()];
            let pairs = surface.emissivity.iter().zip(arriving);
            let absorbed: f64 = pairs.map(|(e, h)| e * h).sum();
            // The irradiance with this flux is less than with none: at 0 K a group takes in most.
            let found = format!("net flux {q} where {absorbed:.6e} is absorbed");
            let remedy = "no temperature emits less than nothing: take less heat from it";
            return Err(of_group(&self.factors.names[i], found, remedy));
        }
        Ok(Some(temperature(all)))
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
