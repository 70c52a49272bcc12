//! Where the light is while a solver runs.
//!
//! The state is flux, not radiosity: a patch that sends Φ along row i sends F_ij Φ to element j,
//! which absorbs (1 − ρ_j) of it and has the rest to pass on. Divided by the receiver's area that
//! is the textbook ΔB_j = ρ_j ΔB_i F_ij A_i/A_j, and no size of patch or element can make or lose
//! energy.
//!
//! With s what was sent, e what is emitted and (Mx)_j = ρ_j Σ_i F_ij x_i, the unshot flux is the
//! residual r = e − s + Ms of the radiosity equation, and what leaves is s + r = e + Ms. Solvers
//! only differ in what they send next (Gortler, Cohen and Slusallek 1994): this state, and the
//! ledger, is common to all.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::ledger::{Ledger, largest_share};
use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::mesh::{Mesh, NodeId, Passage, Transmission};
use crate::scene::Rgb;

/// Flux of the elements, W per channel.
#[derive(Clone)]
pub(super) struct Flux {
    /// The shares of what elements receive that others, behind them, send on.
    transmission: Transmission,
    /// Emitted by all, or received of it where that is known beforehand.
    total: Rgb,
    /// Emitted by each.
    pub emitted: Vec<Rgb>,
    /// The share of what it receives that each reflects; no flux.
    pub reflectance: Vec<Rgb>,
    /// Received by each.
    pub incident: Vec<Rgb>,
    /// Received or emitted by each and not yet passed on; below 0 where it was passed on before.
    pub unshot: Vec<Rgb>,
}

impl Flux {
    /// What `mesh` emits, all of it unshot.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when the emitted flux is not finite.
    pub fn emitted_by(mesh: &Mesh) -> Result<Flux, Error> {
        Flux::after(mesh, &ReceivedLight::default())
    }

    /// What `mesh` emits and has `received`, what is reflected of that unshot. What it has received
    /// counts as emitted in the place of all that the lights emit which it is from.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when the emitted flux is not finite.
    pub fn after(mesh: &Mesh, received: &ReceivedLight) -> Result<Flux, Error> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let emitted: Vec<Rgb> = elements
            .clone()
            .enumerate()
            .map(|(e, n)| mesh.exitance(e) * mesh.solid_area(n))
            .collect();
        let reflectance: Vec<Rgb> = (0..emitted.len()).map(|e| mesh.reflectance(e)).collect();
        let transmission = Transmission::new(mesh);
        let mut unshot = emitted.clone();
        let mut incident = vec![Rgb::ZERO; emitted.len()];
        for (e, node) in elements.enumerate().filter(|_| !received.irradiance.is_empty()) {
            if received.is_of(mesh, node) {
                unshot[e] = Rgb::ZERO;
            }
            if reflectance[e] + transmission.passed(e) != Rgb::ZERO {
                incident[e] = received.irradiance[e] * mesh.solid_area(node);
                unshot[e] += reflectance[e] * incident[e];
            }
        }
        for (e, unshot) in unshot.iter_mut().enumerate().filter(|_| !transmission.is_none()) {
            *unshot += transmission.transmitted(e, &incident);
        }
        let lost = |e: usize| (Rgb::ONE - reflectance[e] - transmission.passed(e)) * incident[e];
        let total: Rgb = unshot.iter().sum::<Rgb>() + (0..unshot.len()).map(lost).sum::<Rgb>();
        if !total.is_finite() {
            let remedy = "scale exitances down: sums of flux must stay finite in 64-bit floats";
            let found = format!("{total} W");
            return Err(Error::new(ErrorKind::Scene, "emitted flux", found, remedy));
        }
        Ok(Flux { transmission, total, emitted, reflectance, incident, unshot })
    }

    /// Emitted by all elements.
    pub fn total(&self) -> Rgb {
        self.total
    }

    /// Emitted, reflected or let through by element `e`, shot or not.
    pub fn leaving(&self, e: usize) -> Rgb {
        self.emitted[e] + self.scattered(e, &self.incident)
    }

    /// What leaves element `e` of the flux that is `incident` on each: what it reflects of its own,
    /// and what comes through from behind.
    pub fn scattered(&self, e: usize, incident: &[Rgb]) -> Rgb {
        self.reflectance[e] * incident[e] + self.transmitted(e, incident)
    }

    /// The part of it that comes through from behind.
    pub fn transmitted(&self, e: usize, incident: &[Rgb]) -> Rgb {
        self.transmission.transmitted(e, incident)
    }

    /// The share of what element `e` receives that leaves again, from it or from those behind it.
    pub fn albedo(&self, e: usize) -> Rgb {
        self.reflectance[e] + self.transmission.passed(e)
    }

    /// The elements behind element `e`, if it is translucent.
    pub fn behind(&self, e: usize) -> &[Passage] {
        self.transmission.behind(e)
    }

    /// What is unshot or overshot in `elements`, as a share of the emitted: the worst channel.
    pub fn unshot_share(&self, elements: &[Range<usize>]) -> f64 {
        let sum_of =
            |run: &Range<usize>| self.unshot[run.clone()].iter().map(|u| u.abs()).sum::<Rgb>();
        largest_share(elements.iter().map(sum_of).sum(), self.total)
    }

    /// What leaves `elements`, as a share of the emitted: the worst channel.
    pub fn leaving_share(&self, elements: &[Range<usize>]) -> f64 {
        let sum_of = |run: &Range<usize>| run.clone().map(|e| self.leaving(e)).sum::<Rgb>();
        largest_share(elements.iter().map(sum_of).sum(), self.total)
    }
}

/// Light that elements have received before any is shot: that of sky and luminaires, and of lights
/// which were looked at from the elements, since most of what they emit goes elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ReceivedLight {
    /// Irradiance of each element, W/m² per channel; empty for none.
    pub irradiance: Vec<Rgb>,
    /// Materials, by their index, whose emission that is: they shoot none of it.
    pub materials: Vec<u32>,
}

impl ReceivedLight {
    /// Whether the emission of `node` is in it.
    fn is_of(&self, mesh: &Mesh, node: NodeId) -> bool {
        let material = mesh.scene().triangles()[mesh.triangle(node)].material;
        self.materials.contains(&material)
    }
}

/// What became of flux that was sent, W per channel.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Transfer {
    /// By the fronts of elements, or let through by these.
    pub scattered: Rgb,
    /// By the fronts of elements.
    pub absorbed: Rgb,
    /// Met no surface.
    pub escaped: Rgb,
    /// Met the back of a surface and was lost there.
    pub backface: Rgb,
    /// Lost in clear panes on the way.
    pub panes: Rgb,
}

impl Transfer {
    /// Adds `scale` times `other`.
    pub fn add(&mut self, scale: Rgb, other: Transfer) {
        self.scattered += scale * other.scattered;
        self.absorbed += scale * other.absorbed;
        self.escaped += scale * other.escaped;
        self.backface += scale * other.backface;
        self.panes += scale * other.panes;
    }
}

/// Sends `flux` along `row`; `receive` is called with each element and the flux that it receives,
/// of which the share `albedo` leaves again.
pub(super) fn send(
    flux: Rgb,
    row: &Row,
    albedo: impl Fn(usize) -> Rgb,
    receive: impl FnMut(usize, Rgb),
) -> Transfer {
    if row.passed.is_empty() {
        return send_through(flux, row, |_, sent| sent, albedo, receive);
    }
    let mut panes = Rgb::ZERO;
    let weaken = |k: usize, sent: Rgb| {
        let arrives = sent * Row::transmittance(row.passed[k]);
        panes += sent - arrives;
        arrives
    };
    let transfer = send_through(flux, row, weaken, albedo, receive);
    Transfer { panes, ..transfer }
}

/// The same through panes, which `weaken` the flux that is sent to each entry, by its number; then
/// what escapes, and what meets backs.
fn send_through(
    flux: Rgb,
    row: &Row,
    mut weaken: impl FnMut(usize, Rgb) -> Rgb,
    albedo: impl Fn(usize) -> Rgb,
    mut receive: impl FnMut(usize, Rgb),
) -> Transfer {
    let per_share = flux / f64::from(Row::TOTAL);
    let mut absorbed = Rgb::ZERO;
    let mut scattered = Rgb::ZERO;
    for (k, entry) in row.entries.iter().enumerate() {
        let e = entry.element as usize;
        let incident = weaken(k, per_share * f64::from(entry.share));
        let scattered_here = incident * albedo(e);
        receive(e, incident);
        scattered += scattered_here;
        absorbed += incident - scattered_here;
    }
    let count = row.entries.len();
    Transfer {
        scattered,
        absorbed,
        escaped: weaken(count, per_share * f64::from(row.escaped)),
        backface: weaken(count + 1, per_share * f64::from(row.backface)),
        panes: Rgb::ZERO,
    }
}

/// Flux of all elements, and the ledger of it.
#[derive(Clone)]
pub(super) struct FluxState<'m> {
    pub mesh: &'m Mesh,
    pub flux: Flux,
    pub ledger: Ledger,
}

/// Largest difference between emitted and accounted flux, over the emitted, that passes as
/// rounding. Sums of some 10⁹ terms in f64 stay far below.
const MAX_ENERGY_IMBALANCE: f64 = 1e-9;

impl<'m> FluxState<'m> {
    /// What `mesh` emits and has `received`, none of it shot.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when the emitted flux is not finite.
    pub fn new(mesh: &'m Mesh, received: &ReceivedLight) -> Result<FluxState<'m>, Error> {
        let flux = Flux::after(mesh, received)?;
        let unshot = flux.unshot.iter().sum::<Rgb>();
        let emitted = flux.total;
        let ledger = Ledger { emitted, unshot, absorbed: emitted - unshot, ..Default::default() };
        Ok(FluxState { mesh, flux, ledger })
    }

    /// Sends `flux`, which is no longer unshot anywhere, along `row`.
    pub fn distribute(&mut self, flux: Rgb, row: &Row) {
        let Flux { transmission, reflectance, incident, unshot, .. } = &mut self.flux;
        let receive = |e: usize, received: Rgb| {
            incident[e] += received;
            unshot[e] += reflectance[e] * received;
            for passage in transmission.behind(e) {
                unshot[passage.behind as usize] += passage.passed * received;
            }
        };
        let albedo = |e: usize| reflectance[e] + transmission.passed(e);
        let transfer = send(flux, row, albedo, receive);
        self.record_losses(transfer);
        self.ledger.unshot += transfer.scattered - flux;
    }

    /// Enters what is lost of flux that was sent into the ledger.
    pub fn record_losses(&mut self, transfer: Transfer) {
        self.ledger.absorbed += transfer.absorbed;
        self.ledger.escaped += transfer.escaped;
        self.ledger.backface_loss += transfer.backface;
        self.ledger.pane_loss += transfer.panes;
    }

    /// Sums what is unshot anew, so that rounding does not add up, and verifies that emitted and
    /// accounted flux are equal.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`] when they differ by more than [`MAX_ENERGY_IMBALANCE`].
    pub fn recompute_and_verify_energy(&mut self) -> Result<(), Error> {
        self.ledger.unshot = self.flux.unshot.iter().map(|u| u.max(Rgb::ZERO)).sum();
        self.ledger.overshot = self.flux.unshot.iter().map(|u| (-*u).max(Rgb::ZERO)).sum();
        let imbalance = self.ledger.imbalance();
        if imbalance <= MAX_ENERGY_IMBALANCE {
            return Ok(());
        }
        Err(Error::new(
            ErrorKind::FormFactor,
            "energy ledger",
            format!("emitted and accounted flux differ by {imbalance:e} of the emitted"),
            format!(
                "they must agree to {MAX_ENERGY_IMBALANCE:e}; rows that are not finite can do this"
            ),
        ))
    }

    /// Radiosity of each element, W/m²; 0 of holes.
    pub fn radiosity(&self) -> Vec<Rgb> {
        let radiosity = |e| match self.mesh.solid_area(self.mesh.element(e)) {
            0.0 => Rgb::ZERO,
            area => self.flux.leaving(e) / area,
        };
        (0..self.mesh.element_count()).map(radiosity).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn received_light_takes_the_place_of_emission() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 300.0).unwrap();
        let light = mesh.scene().materials().iter().position(|m| m.exitance != Rgb::ZERO).unwrap();
        let irradiance = vec![Rgb::new(1.0, 2.0, 3.0); mesh.element_count()];
        let received = ReceivedLight { irradiance, materials: vec![light as u32] };
        let state = FluxState::new(&mesh, &received).unwrap();
        let area = mesh.scattering_area();
        let close = |a: Rgb, b: Rgb| (a - b).abs().max_element() < 1e-9 * b.max_element();
        // All that the lamp sends to surfaces that reflect, of which the rest is unshot.
        assert!(close(state.ledger.emitted, area * Rgb::new(1.0, 2.0, 3.0)), "{:?}", state.ledger);
        let reflected = mesh.mean_albedo() * area * Rgb::new(1.0, 2.0, 3.0);
        assert!(close(state.ledger.unshot, reflected), "{:?} {reflected}", state.ledger);
        assert!(state.ledger.imbalance() < 1e-12);
        // What leaves is all of it, emission included.
        for (e, radiosity) in state.radiosity().into_iter().enumerate() {
            let material = mesh.material(mesh.element(e));
            let leaving = material.exitance + material.reflectance * Rgb::new(1.0, 2.0, 3.0);
            assert!(close(radiosity, leaving), "{e}: {radiosity} {leaving}");
        }
    }
}
