//! GMRES, restarted (Saad and Schultz 1986), on the flux that is unshot.
//!
//! A cycle looks for what to send among the unshot flux r, Ar, A²r … with A = 1 − M, such that the
//! least is unshot afterwards. Products with A of bounced light are all it asks for, so that it costs
//! what Jacobi's bounces do; but however near one the reflectance is, light that fills a scene evenly
//! is a single direction, and found in a step.
//!
//! Every vector is kept with what became of its light when it was sent, lost parts included. All of
//! it is linear, so the ledger of what a cycle sends is known without sending it, whenever it ends.

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

use super::flux_state::{FluxState, Transfer, send};
use super::ledger::largest_share;
use super::row_cache::RowCache;
use super::session::StepContext;
use crate::error::Error;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// Cycles of products, each a step, until done.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Gmres {
    /// Products in a cycle.
    length: usize,
    cycle: Option<Box<Cycle>>,
    product: Option<Product>,
}

/// A vector that is being sent.
#[derive(Clone, Serialize, Deserialize)]
struct Product {
    /// Received by each element.
    incident: Vec<Rgb>,
    /// What became of all that was sent.
    sent: Transfer,
    /// The element whose turn it is.
    element: usize,
}

/// A cycle that takes less than this share off what is unshot is followed by one of twice the length.
const LEAST_GAIN: f64 = 0.5;

impl Gmres {
    /// With `restart` products in a cycle.
    pub fn new(restart: usize) -> Gmres {
        Gmres { length: restart, cycle: None, product: None }
    }

    /// Whether it fits `count` elements, as one from a file may not.
    pub fn fits(&self, count: usize) -> bool {
        let all = |w: &[Rgb]| w.len() == count && w.iter().all(|w| w.is_finite());
        let product = |p: &Product| all(&p.incident) && p.element <= count;
        self.length > 0
            && self.cycle.as_ref().is_none_or(|cycle| cycle.fits(all))
            && self.product.as_ref().is_none_or(|p| self.cycle.is_some() && product(p))
    }

    /// Goes on by as many elements as one batch of rows reaches.
    pub fn advance(&mut self, batch: &mut StepContext) -> Result<Option<StopReason>, Error> {
        let Some(cycle) = &mut self.cycle else {
            if batch.has_converged()? {
                return Ok(Some(StopReason::Converged));
            }
            self.cycle = Some(Box::new(Cycle::new(batch.state)));
            return Ok(None);
        };
        let Some(product) = &mut self.product else {
            let made = cycle.sent.len();
            if made >= self.length || made > 0 && cycle.unshot(batch.state) <= batch.unshot {
                self.finish(batch.state, batch.rows);
            } else if batch.is_last_step() {
                return Ok(Some(StopReason::Steps));
            } else {
                let incident = vec![Rgb::ZERO; batch.state.flux.unshot.len()];
                self.product = Some(Product { incident, sent: Transfer::default(), element: 0 });
            }
            return Ok(None);
        };
        let vector = &cycle.basis[cycle.sent.len()];
        let lit = (product.element..vector.len()).filter(|&e| vector[e] != Rgb::ZERO);
        let rows = batch.rows.next(batch.state.mesh, batch.maker, lit)?;
        let (done, unshot_share) = (rows.is_empty(), cycle.unshot(batch.state));
        for (e, row) in rows {
            let (incident, reflectance) = (&mut product.incident, &batch.state.flux.reflectance);
            let sent = send(vector[e], &row, |e| reflectance[e], |e, came| incident[e] += came);
            product.sent.add(Rgb::ONE, sent);
            product.element = e + 1;
            batch.done.shots += 1;
            if batch.tell(unshot_share) == ControlFlow::Break(()) {
                return Ok(Some(StopReason::Cancelled));
            }
        }
        if done && let Some(Product { incident, sent, .. }) = self.product.take() {
            cycle.extend(incident, sent, &batch.state.flux.reflectance);
            batch.done.steps += 1;
        }
        Ok(None)
    }

    /// Sends what leaves least unshot, by the vectors so far, and begins anew.
    pub fn finish(&mut self, state: &mut FluxState, rows: &mut RowCache) {
        self.product = None;
        if let Some(cycle) = self.cycle.take() {
            // In as many products as there are elements it would be exact: no scene holds it up for ever.
            if cycle.stalls() && cycle.sent.len() >= self.length {
                self.length = self.length.saturating_mul(2);
            }
            cycle.finish(state, rows);
        }
    }
}

/// One cycle, of all channels at once: as many systems that share rows. A channel that is through
/// goes on with vectors of 0.
#[derive(Clone, Serialize, Deserialize)]
struct Cycle {
    /// Σ A over A of each element. With these weights a vector's norm is no less than the sum of its
    /// fluxes' magnitudes (Cauchy and Schwarz), and the product with M nearly symmetric (it is where
    /// reflectance is one and rows are exact).
    weights: Vec<f64>,
    /// Orthonormal vectors, the first along what is unshot.
    basis: Vec<Vec<Rgb>>,
    /// What became of the light of each but the last, and what came to each element.
    sent: Vec<Transfer>,
    incident: Vec<Vec<Rgb>>,
    /// A times each but the last, in terms of the basis: columns of the Hessenberg matrix.
    columns: Vec<Vec<Rgb>>,
    /// The same as an upper triangle, after these rotations (cosine and sine).
    triangle: Vec<Vec<Rgb>>,
    rotations: Vec<[Rgb; 2]>,
    /// Norm of what was unshot.
    norm: Rgb,
    /// The unshot flux, rotated likewise; the norm of what cannot be sent away comes last.
    rest: Vec<Rgb>,
}

impl Cycle {
    fn new(state: &FluxState) -> Cycle {
        let area = |e: usize| state.mesh.area(state.mesh.element(e));
        let count = state.flux.unshot.len();
        let whole: f64 = (0..count).map(area).sum();
        let weights: Vec<f64> = (0..count).map(|e| whole / area(e)).collect();
        // In parts of the largest, so that squares of it neither overflow nor vanish.
        let largest = state.flux.unshot.iter().fold(Rgb::ZERO, |most, u| most.max(u.abs()));
        let mut first = state.flux.unshot.clone();
        first.iter_mut().for_each(|u| *u = ratio(*u, largest));
        let norm = dot(&weights, &first, &first).map(f64::sqrt);
        first.iter_mut().for_each(|u| *u = ratio(*u, norm));
        let (sent, incident) = (vec![], vec![]);
        let (columns, triangle, rotations) = (vec![], vec![], vec![]);
        let (basis, norm) = (vec![first], norm * largest);
        let rest = vec![norm];
        Cycle { weights, basis, sent, incident, columns, triangle, rotations, norm, rest }
    }

    /// Takes in what came of the newest vector, and adds the direction that is new in what is
    /// reflected of that.
    fn extend(&mut self, incident: Vec<Rgb>, sent: Transfer, reflectance: &[Rgb]) {
        let k = self.sent.len();
        let reflected = incident.iter().zip(reflectance).map(|(&h, &rho)| rho * h);
        let mut new: Vec<Rgb> = self.basis[k].iter().zip(reflected).map(|(&v, m)| v - m).collect();
        // Modified Gram–Schmidt, enough for GMRES (Paige, Rozložník and Strakoš 2006).
        let mut column = vec![];
        for v in &self.basis {
            let along = dot(&self.weights, v, &new);
            new.iter_mut().zip(v).for_each(|(w, v)| *w -= along * v);
            column.push(along);
        }
        let norm = dot(&self.weights, &new, &new).map(f64::sqrt);
        column.push(norm);
        self.columns.push(column.clone());
        for (i, &[c, s]) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            (column[i], column[i + 1]) = (c * a + s * b, c * b - s * a);
        }
        let radius = (column[k] * column[k] + norm * norm).map(f64::sqrt);
        let [c, s] = [ratio(column[k], radius), ratio(norm, radius)];
        let rest = self.rest[k];
        let last = -s * rest;
        self.rest[k] = c * rest;
        self.rest.push(last);
        column[k] = radius;
        column.pop();
        self.triangle.push(column);
        self.rotations.push([c, s]);
        new.iter_mut().for_each(|w| *w = ratio(*w, norm));
        self.basis.push(new);
        self.sent.push(sent);
        self.incident.push(incident);
    }

    /// Norm of what would be unshot after the vectors so far.
    fn last(&self) -> Rgb {
        self.rest.last().map_or(Rgb::ZERO, |r| r.abs())
    }

    /// The most that would be unshot, as a share of the emitted: the worst channel.
    fn unshot(&self, state: &FluxState) -> f64 {
        largest_share(self.last(), state.ledger.emitted)
    }

    /// Whether less than [`LEAST_GAIN`] of what was unshot is gone in some channel.
    fn stalls(&self) -> bool {
        largest_share(self.last(), self.norm) > 1.0 - LEAST_GAIN
    }

    /// Sends what leaves least unshot.
    fn finish(self, state: &mut FluxState, rows: &mut RowCache) {
        let count = self.triangle.len();
        let mut parts = vec![Rgb::ZERO; count];
        for i in (0..count).rev() {
            let known: Rgb = (i + 1..count).map(|k| self.triangle[k][i] * parts[k]).sum();
            parts[i] = ratio(self.rest[i] - known, self.triangle[i][i]);
        }
        // A times what is sent, by the basis: that much is no longer unshot.
        let mut shot = vec![Rgb::ZERO; self.basis.len()];
        for (column, &part) in self.columns.iter().zip(&parts) {
            shot.iter_mut().zip(column).for_each(|(s, &h)| *s += h * part);
        }
        for (v, &shot) in self.basis.iter().zip(&shot) {
            state.flux.unshot.iter_mut().zip(v).for_each(|(r, v)| *r -= shot * *v);
        }
        let mut sent = vec![Rgb::ZERO; state.flux.unshot.len()];
        for (k, &part) in parts.iter().enumerate() {
            sent.iter_mut().zip(&self.basis[k]).for_each(|(s, v)| *s += part * *v);
            let incident = state.flux.incident.iter_mut();
            incident.zip(&self.incident[k]).for_each(|(h, came)| *h += part * *came);
        }
        for (e, flux) in sent.into_iter().enumerate().filter(|(_, flux)| *flux != Rgb::ZERO) {
            rows.sent(state.mesh.element(e), flux);
        }
        let mut all = Transfer::default();
        parts.iter().zip(&self.sent).for_each(|(&part, &sent)| all.add(part, sent));
        state.lose(all);
    }

    /// Whether all vectors satisfy `fits` and are as many as they should be.
    fn fits(&self, fits: impl Fn(&[Rgb]) -> bool) -> bool {
        let made = self.sent.len();
        let columns = |columns: &[Vec<Rgb>], more: usize| {
            columns.len() == made && columns.iter().enumerate().all(|(k, c)| c.len() == k + more)
        };
        self.basis.len() == made + 1
            && self.incident.len() == made
            && self.rotations.len() == made
            && self.rest.len() == made + 1
            && columns(&self.columns, 2)
            && columns(&self.triangle, 1)
            && self.basis.iter().chain(&self.incident).all(|v| fits(v))
            && self.weights.len() == self.basis[0].len()
    }
}

/// Sum of products over the elements.
fn dot(weights: &[f64], a: &[Rgb], b: &[Rgb]) -> Rgb {
    weights.iter().zip(a).zip(b).map(|((&w, a), b)| w * *a * *b).sum()
}

/// `a` over `b`, and 0 where that is 0.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpeq(Rgb::ZERO), Rgb::ZERO, a / b)
}
