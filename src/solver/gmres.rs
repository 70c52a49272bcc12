//! Restarted GMRES ([`linear::gmres`](crate::linear::gmres)) on the unshot flux.
//!
//! A = 1 − M, so that a product is light sent along all rows: it costs as much as a bounce of
//! Jacobi. Even at reflectances near one, light that fills a scene evenly is a single direction,
//! eliminated in one step.
//!
//! Every basis vector is stored with the destination of its light, losses included. All of it is
//! linear, so the ledger of a cycle is known without sending its solution, at whatever product the
//! cycle ends.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::flux_state::{Flux, FluxState, Transfer, send};
use super::ledger::largest_share;
use super::row_cache::RowCache;
use super::step::StepContext;
use crate::error::Error;
use crate::linear::gmres::{self, add_combination};
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;

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
        let cycle_fits = self.cycle.as_ref().is_none_or(|cycle| {
            let SentVectors { transfers, incident } = &cycle.records;
            cycle.is_consistent(is_vector)
                && [transfers.len(), incident.len()] == [cycle.products(); 2]
                && incident.iter().all(|w| is_vector(w))
        });
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
            let weights = inner_product_weights(step.state.mesh);
            let unshot = step.state.flux.unshot.clone();
            self.cycle = Some(Box::new(Cycle::new(unshot, weights, SentVectors::default())));
            return Ok(None);
        };
        if let Some(product) = &mut self.product {
            let Some(is_complete) = advance_product(cycle, product, step)? else {
                return Ok(Some(StopReason::Cancelled));
            };
            if is_complete && let Some(product) = self.product.take() {
                extend(cycle, product, &step.state.flux);
                step.counters.steps += 1;
            }
            return Ok(None);
        }
        let done = cycle.products();
        if done >= self.restart || done > 0 && unshot_bound(cycle, step.state) <= step.unshot {
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
            // A full cycle that leaves more than half of the unshot norm in some channel stagnates:
            // the next has twice the products. One with as many as elements is exact, so that the
            // doubling ends.
            let left = largest_share(cycle.residual_norm(), cycle.initial_norm);
            if left > 0.5 && cycle.products() >= self.restart {
                self.restart = self.restart.saturating_mul(2);
            }
            send_step(&cycle, state, rows);
        }
    }
}

impl Product {
    /// Before anything is sent.
    fn new(count: usize) -> Product {
        Product { incident: vec![Rgb::ZERO; count], transfer: Transfer::default(), element: 0 }
    }
}

/// The unshot flux of all elements. With the weights of [`inner_product_weights`] the norm of a
/// vector is no less than the sum of the magnitudes of its fluxes (Cauchy and Schwarz), and the
/// product with M is nearly symmetric (exactly where reflectance is one and rows are exact).
type Cycle = gmres::Cycle<Rgb, SentVectors>;

/// The light of each basis vector but the last.
#[derive(Clone, Default, Serialize, Deserialize)]
struct SentVectors {
    /// Its destination …
    transfers: Vec<Transfer>,
    /// … and the flux that each element received of it.
    incident: Vec<Vec<Rgb>>,
}

/// Sends the newest basis vector of `cycle` from as many elements as one batch of rows covers.
/// Returns whether all have sent, or `None` when the callback stops the solver.
fn advance_product(
    cycle: &Cycle,
    product: &mut Product,
    step: &mut StepContext,
) -> Result<Option<bool>, Error> {
    let vector = cycle.newest();
    let elements = (product.element..vector.len()).filter(|&e| vector[e] != Rgb::ZERO);
    let rows = step.rows.next_element_rows(step.state.mesh, step.row_source, elements)?;
    let is_complete = rows.is_empty();
    let unshot_share = unshot_bound(cycle, step.state);
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

/// Appends `product`, made with the newest basis vector, to `cycle`.
fn extend(cycle: &mut Cycle, product: Product, flux: &Flux) {
    let Product { incident, transfer, .. } = product;
    let image = cycle.newest().iter().enumerate();
    let image = image.map(|(e, &v)| v - flux.scattered(e, &incident)).collect();
    cycle.extend(image);
    cycle.records.transfers.push(transfer);
    cycle.records.incident.push(incident);
}

/// Upper bound of the remaining unshot flux as a share of the emitted: the worst channel.
fn unshot_bound(cycle: &Cycle, state: &FluxState) -> f64 {
    largest_share(cycle.residual_norm(), state.ledger.emitted)
}

/// Sends the flux that minimizes the unshot flux.
fn send_step(cycle: &Cycle, state: &mut FluxState, rows: &mut RowCache) {
    let factors = cycle.step();
    cycle.subtract_product(&factors, &mut state.flux.unshot);
    let mut sent = vec![Rgb::ZERO; state.flux.unshot.len()];
    cycle.add_step(&factors, &mut sent);
    add_combination(&mut state.flux.incident, &factors, &cycle.records.incident);
    for (e, flux) in sent.into_iter().enumerate().filter(|(_, flux)| *flux != Rgb::ZERO) {
        rows.record_sent(state.mesh.element(e), flux);
    }
    let mut transfer = Transfer::default();
    for (&factor, &of_vector) in factors.iter().zip(&cycle.records.transfers) {
        transfer.add(factor, of_vector);
    }
    state.record_losses(transfer);
}

/// Total area over the area of each element of `mesh`; 0 for holes.
fn inner_product_weights(mesh: &Mesh) -> Vec<f64> {
    let area = |e: usize| mesh.solid_area(mesh.element(e));
    let count = mesh.element_count();
    let total: f64 = (0..count).map(area).sum();
    let weight = |e: usize| if area(e) > 0.0 { total / area(e) } else { 0.0 };
    (0..count).map(weight).collect()
}
