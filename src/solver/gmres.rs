//! Restarted GMRES (Saad and Schultz 1986) on the unshot flux.
//!
//! A cycle searches the Krylov space of the unshot flux r, Ar, A²r … with A = 1 − M for the flux to
//! send that minimizes the remaining unshot flux. It needs only products with M, that is, light
//! sent along all rows, so that a product costs as much as a bounce of Jacobi. Even at reflectances
//! near one, light that fills a scene evenly is a single direction, eliminated in one step. One
//! cycle:
//!
//! 1. v₀ = r/|r|; product: w = A v_k by sending v_k along the rows of all elements;
//! 2. modified Gram–Schmidt: w = Σ h_ik v_i + h_{k+1,k} v_{k+1}, a column of the Hessenberg matrix;
//! 3. Givens rotations bring the Hessenberg matrix to the triangle R, and r to the vector g, whose
//!    last component is the norm of the residual;
//! 4. after the last product: R y = g, and Σ y_k v_k is sent.
//!
//! Every vector is stored with the destination of its light, losses included. All of it is linear,
//! so the ledger of a cycle is known without sending its solution, at whatever product the cycle
//! ends.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::flux_state::{Flux, FluxState, Transfer, send};
use super::ledger::largest_share;
use super::row_cache::RowCache;
use super::step::StepContext;
use crate::error::Error;
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;

/// A full cycle that reduces the unshot norm by less than this share stagnates: the next has twice
/// the products. Plain choice; no recorded measurement.
const MIN_CYCLE_REDUCTION: f64 = 0.5;

/// Cycles of products; a step is a product.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct Gmres {
    /// Products in a cycle.
    restart: usize,
    cycle: Option<Box<Cycle>>,
    product: Option<Product>,
}

/// The product of M with the newest basis vector, in progress.
#[derive(Clone, Serialize, Deserialize)]
struct Product {
    /// Flux received by each element so far, W.
    incident: Vec<Rgb>,
    /// Destination of the flux sent so far.
    transfer: Transfer,
    /// Elements below this index have sent their part.
    element: usize,
}

impl Gmres {
    /// Before the first cycle, of `restart` products.
    pub fn new(restart: usize) -> Gmres {
        Gmres { restart, cycle: None, product: None }
    }

    /// Whether this is a valid state over `count` elements; one that was read from a file may not
    /// be.
    pub fn is_consistent(&self, count: usize) -> bool {
        let is_vector = |w: &[Rgb]| w.len() == count && w.iter().all(|w| w.is_finite());
        let cycle_fits = self.cycle.as_ref().is_none_or(|cycle| cycle.is_consistent(is_vector));
        let product_fits = self.product.as_ref().is_none_or(|product| {
            self.cycle.is_some() && is_vector(&product.incident) && product.element <= count
        });
        self.restart > 0 && cycle_fits && product_fits
    }

    /// Advances by as many elements as one batch of rows covers.
    pub fn advance(&mut self, step: &mut StepContext) -> Result<Option<StopReason>, Error> {
        let Some(cycle) = &mut self.cycle else {
            if step.refresh_and_check_convergence()? {
                return Ok(Some(StopReason::Converged));
            }
            self.cycle = Some(Box::new(Cycle::new(step.state)));
            return Ok(None);
        };
        if let Some(product) = &mut self.product {
            let Some(is_complete) = cycle.advance_product(product, step)? else {
                return Ok(Some(StopReason::Cancelled));
            };
            if is_complete && let Some(product) = self.product.take() {
                cycle.extend(product, &step.state.flux);
                step.counters.steps += 1;
            }
            return Ok(None);
        }
        let done = cycle.products();
        if done >= self.restart || done > 0 && cycle.unshot_bound(step.state) <= step.unshot {
            self.finish(step.state, step.rows);
        } else if step.has_done_all_steps() {
            return Ok(Some(StopReason::Steps));
        } else {
            self.product = Some(Product::new(step.state.flux.unshot.len()));
        }
        Ok(None)
    }

    /// Sends the flux that minimizes the unshot flux, by the products so far, and ends the cycle.
    pub fn finish(&mut self, state: &mut FluxState, rows: &mut RowCache) {
        self.product = None;
        if let Some(cycle) = self.cycle.take() {
            // A cycle with as many products as elements is exact, so that the doubling ends.
            if cycle.stagnates() && cycle.products() >= self.restart {
                self.restart = self.restart.saturating_mul(2);
            }
            cycle.finish(state, rows);
        }
    }
}

impl Product {
    /// Before anything is sent.
    fn new(count: usize) -> Product {
        Product { incident: vec![Rgb::ZERO; count], transfer: Transfer::default(), element: 0 }
    }
}

/// One cycle of all channels at once: one linear system per channel, on shared rows. A channel that
/// has converged continues with vectors of 0.
#[derive(Clone, Serialize, Deserialize)]
struct Cycle {
    /// Weights of the inner product: total area over the area of each element. With these the norm
    /// of a vector is no less than the sum of the magnitudes of its fluxes (Cauchy and Schwarz),
    /// and the product with M is nearly symmetric (exactly where reflectance is one and rows are
    /// exact).
    weights: Vec<f64>,
    /// v: orthonormal vectors, the first along the unshot flux.
    basis: Vec<Vec<Rgb>>,
    /// Destination of the light of each basis vector but the last …
    transfers: Vec<Transfer>,
    /// … and the flux that each element received of it.
    incident: Vec<Vec<Rgb>>,
    /// Columns of the Hessenberg matrix: A times each basis vector but the last, in the basis.
    hessenberg: Vec<Vec<Rgb>>,
    /// Columns of R: the Hessenberg matrix after the rotations.
    r_factor: Vec<Vec<Rgb>>,
    /// Cosine and sine of each Givens rotation.
    rotations: Vec<[Rgb; 2]>,
    /// Norm of the unshot flux when the cycle began.
    initial_norm: Rgb,
    /// g: the initial unshot flux in the basis, after the rotations. The last is the norm of the
    /// residual.
    rotated_residual: Vec<Rgb>,
}

impl Cycle {
    fn new(state: &FluxState) -> Cycle {
        let weights = inner_product_weights(state.mesh);
        // Scaled by the largest, so that squares neither overflow nor underflow.
        let largest = state.flux.unshot.iter().fold(Rgb::ZERO, |max, u| max.max(u.abs()));
        let mut first = state.flux.unshot.clone();
        for u in &mut first {
            *u = ratio(*u, largest);
        }
        let norm = norm(&weights, &first);
        for u in &mut first {
            *u = ratio(*u, norm);
        }
        let initial_norm = norm * largest;
        Cycle {
            weights,
            basis: vec![first],
            transfers: vec![],
            incident: vec![],
            hessenberg: vec![],
            r_factor: vec![],
            rotations: vec![],
            initial_norm,
            rotated_residual: vec![initial_norm],
        }
    }

    /// Products done so far.
    fn products(&self) -> usize {
        self.transfers.len()
    }

    /// Sends the newest basis vector from as many elements as one batch of rows covers. Returns
    /// whether all have sent, or `None` when the callback stops the solver.
    fn advance_product(
        &self,
        product: &mut Product,
        step: &mut StepContext,
    ) -> Result<Option<bool>, Error> {
        let vector = &self.basis[self.products()];
        let elements = (product.element..vector.len()).filter(|&e| vector[e] != Rgb::ZERO);
        let rows = step.rows.next_element_rows(step.state.mesh, step.row_source, elements)?;
        let is_complete = rows.is_empty();
        let unshot_share = self.unshot_bound(step.state);
        for (e, row) in rows {
            let Product { incident, transfer, element } = &mut *product;
            let flux = &step.state.flux;
            let sent = send(
                vector[e],
                &row,
                |receiver| flux.albedo(receiver),
                |receiver, received| incident[receiver] += received,
            );
            transfer.add(Rgb::ONE, sent);
            *element = e + 1;
            step.counters.shots += 1;
            if step.report(unshot_share) == ControlFlow::Break(()) {
                return Ok(None);
            }
        }
        Ok(Some(is_complete))
    }

    /// Appends the product with the newest basis vector, and its component orthogonal to the basis
    /// as the next basis vector.
    fn extend(&mut self, product: Product, flux: &Flux) {
        let Product { incident, transfer, .. } = product;
        let k = self.products();
        let scattered = (0..incident.len()).map(|e| flux.scattered(e, &incident));
        let mut new: Vec<Rgb> = self.basis[k].iter().zip(scattered).map(|(&v, m)| v - m).collect();
        // Modified Gram–Schmidt, enough for GMRES (Paige, Rozložník and Strakoš 2006).
        let mut column = vec![];
        for v in &self.basis {
            let along = dot(&self.weights, v, &new);
            for (w, v) in new.iter_mut().zip(v) {
                *w -= along * v;
            }
            column.push(along);
        }
        let norm = norm(&self.weights, &new);
        column.push(norm);
        self.hessenberg.push(column.clone());
        self.rotate(column);
        for w in &mut new {
            *w = ratio(*w, norm);
        }
        self.basis.push(new);
        self.transfers.push(transfer);
        self.incident.push(incident);
    }

    /// Applies the rotations so far to the newest `column` of the Hessenberg matrix, and a new one
    /// that makes its last entry 0.
    fn rotate(&mut self, mut column: Vec<Rgb>) {
        let k = self.products();
        for (i, &[c, s]) in self.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let norm = column[k + 1];
        let radius = (column[k] * column[k] + norm * norm).map(f64::sqrt);
        let [c, s] = [ratio(column[k], radius), ratio(norm, radius)];
        let residual = self.rotated_residual[k];
        self.rotated_residual[k] = c * residual;
        self.rotated_residual.push(-s * residual);
        column[k] = radius;
        column.pop();
        self.r_factor.push(column);
        self.rotations.push([c, s]);
    }

    /// Norm of the residual after the products so far.
    fn residual_norm(&self) -> Rgb {
        self.rotated_residual.last().map_or(Rgb::ZERO, |r| r.abs())
    }

    /// Upper bound of the remaining unshot flux as a share of the emitted: the worst channel.
    fn unshot_bound(&self, state: &FluxState) -> f64 {
        largest_share(self.residual_norm(), state.ledger.emitted)
    }

    /// Whether some channel lost less than [`MIN_CYCLE_REDUCTION`] of its unshot flux.
    fn stagnates(&self) -> bool {
        largest_share(self.residual_norm(), self.initial_norm) > 1.0 - MIN_CYCLE_REDUCTION
    }

    /// y: the coefficients of the basis vectors that minimize the unshot flux.
    fn coefficients(&self) -> Vec<Rgb> {
        let count = self.r_factor.len();
        let mut y = vec![Rgb::ZERO; count];
        for i in (0..count).rev() {
            let known: Rgb = (i + 1..count).map(|k| self.r_factor[k][i] * y[k]).sum();
            y[i] = ratio(self.rotated_residual[i] - known, self.r_factor[i][i]);
        }
        y
    }

    /// Sends the flux that minimizes the unshot flux.
    fn finish(self, state: &mut FluxState, rows: &mut RowCache) {
        let coefficients = self.coefficients();
        // A times the flux sent, in the basis: the decrease of the unshot flux.
        let mut shot = vec![Rgb::ZERO; self.basis.len()];
        for (column, &y) in self.hessenberg.iter().zip(&coefficients) {
            for (sum, &h) in shot.iter_mut().zip(column) {
                *sum += h * y;
            }
        }
        for (v, &shot) in self.basis.iter().zip(&shot) {
            for (unshot, v) in state.flux.unshot.iter_mut().zip(v) {
                *unshot -= shot * *v;
            }
        }
        let mut sent = vec![Rgb::ZERO; state.flux.unshot.len()];
        for (k, &y) in coefficients.iter().enumerate() {
            for (sum, v) in sent.iter_mut().zip(&self.basis[k]) {
                *sum += y * *v;
            }
            for (sum, received) in state.flux.incident.iter_mut().zip(&self.incident[k]) {
                *sum += y * *received;
            }
        }
        for (e, flux) in sent.into_iter().enumerate().filter(|(_, flux)| *flux != Rgb::ZERO) {
            rows.record_sent(state.mesh.element(e), flux);
        }
        let mut transfer = Transfer::default();
        for (&y, &of_vector) in coefficients.iter().zip(&self.transfers) {
            transfer.add(y, of_vector);
        }
        state.record_losses(transfer);
    }

    /// Whether all vectors satisfy `is_vector` and their numbers are right.
    fn is_consistent(&self, is_vector: impl Fn(&[Rgb]) -> bool) -> bool {
        let count = self.products();
        // Column k has k + 1 entries plus those below the diagonal.
        let are_columns = |columns: &[Vec<Rgb>], below: usize| {
            let lengths = columns.iter().map(Vec::len);
            columns.len() == count && lengths.enumerate().all(|(k, len)| len == k + 1 + below)
        };
        self.basis.len() == count + 1
            && self.incident.len() == count
            && self.rotations.len() == count
            && self.rotated_residual.len() == count + 1
            && are_columns(&self.hessenberg, 1)
            && are_columns(&self.r_factor, 0)
            && self.basis.iter().chain(&self.incident).all(|v| is_vector(v))
            && self.weights.len() == self.basis[0].len()
    }
}

/// Total area over the area of each element of `mesh`; 0 for holes.
fn inner_product_weights(mesh: &Mesh) -> Vec<f64> {
    let area = |e: usize| mesh.solid_area(mesh.element(e));
    let count = mesh.element_count();
    let total: f64 = (0..count).map(area).sum();
    let weight = |e: usize| if area(e) > 0.0 { total / area(e) } else { 0.0 };
    (0..count).map(weight).collect()
}

/// Σ weight a b over the elements, by channel.
fn dot(weights: &[f64], a: &[Rgb], b: &[Rgb]) -> Rgb {
    weights.iter().zip(a).zip(b).map(|((&w, a), b)| w * *a * *b).sum()
}

/// √ Σ weight a² over the elements, by channel.
fn norm(weights: &[f64], a: &[Rgb]) -> Rgb {
    dot(weights, a, a).map(f64::sqrt)
}

/// `a` over `b`, and 0 where `b` is 0.
fn ratio(a: Rgb, b: Rgb) -> Rgb {
    Rgb::select(b.cmpeq(Rgb::ZERO), Rgb::ZERO, a / b)
}
