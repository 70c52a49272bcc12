//! The distribution of light while a solver runs.
//!
//! The state is flux, not radiosity: a patch that sends Φ along row i sends F_ij Φ to element j,
//! which absorbs the share 1 − ρ_j and keeps the rest as unshot. Divided by the receiver's area
//! that is the textbook ΔB_j = ρ_j ΔB_i F_ij A_i/A_j; energy is conserved for patches and elements
//! of any size.
//!
//! With s the flux sent, e the flux emitted and (Mx)_j = ρ_j Σ_i F_ij x_i, the unshot flux is the
//! residual r = e − s + Ms of the radiosity equation, and the leaving flux is s + r = e + Ms.
//! Solvers differ only in what they send next (Gortler, Cohen and Slusallek 1994); this state and
//! the ledger are common to all.

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
    /// Shares of the flux received by translucent elements that leave on the other side.
    transmission: Transmission,
    /// Total emitted flux; for lights in [`ReceivedLight`] the flux received from them.
    total: Rgb,
    /// Emitted flux per element.
    pub emitted: Vec<Rgb>,
    /// Reflectance per element; not a flux.
    pub reflectance: Vec<Rgb>,
    /// Received flux per element.
    pub incident: Vec<Rgb>,
    /// Received or emitted per element and not yet passed on; below 0 where more was passed on than
    /// received.
    pub unshot: Vec<Rgb>,
}

impl Flux {
    /// The emission of `mesh`, all of it unshot.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when the emitted flux is not finite.
    pub fn emitted_by(mesh: &Mesh) -> Result<Flux, Error> {
        Flux::after(mesh, &ReceivedLight::default())
    }

    /// The emission of `mesh` and the light `received`; the reflected part of the latter is unshot.
    /// Received light counts as emitted, in place of the emission of the lights that it came from.
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

    /// Total emitted flux.
    pub fn total(&self) -> Rgb {
        self.total
    }

    /// Flux emitted, reflected or transmitted by element `e`, shot or not.
    pub fn leaving(&self, e: usize) -> Rgb {
        self.emitted[e] + self.scattered(e, &self.incident)
    }

    /// Flux that leaves element `e` when `incident` is received by each element: the reflected part
    /// of its own and the flux transmitted from behind.
    pub fn scattered(&self, e: usize, incident: &[Rgb]) -> Rgb {
        self.reflectance[e] * incident[e] + self.transmitted(e, incident)
    }

    /// The part of [`Flux::scattered`] that is transmitted from behind.
    pub fn transmitted(&self, e: usize, incident: &[Rgb]) -> Rgb {
        self.transmission.transmitted(e, incident)
    }

    /// Share of the flux received by element `e` that leaves again, from it or from those behind
    /// it.
    pub fn albedo(&self, e: usize) -> Rgb {
        self.reflectance[e] + self.transmission.passed(e)
    }

    /// The elements behind element `e`, if it is translucent.
    pub fn behind(&self, e: usize) -> &[Passage] {
        self.transmission.behind(e)
    }

    /// Unshot and overshot flux of `elements` as a share of the emitted flux: the worst channel.
    pub fn unshot_share(&self, elements: &[Range<usize>]) -> f64 {
        let sum_of =
            |run: &Range<usize>| self.unshot[run.clone()].iter().map(|u| u.abs()).sum::<Rgb>();
        largest_share(elements.iter().map(sum_of).sum(), self.total)
    }

    /// Flux that leaves `elements` as a share of the emitted flux: the worst channel.
    pub fn leaving_share(&self, elements: &[Range<usize>]) -> f64 {
        let sum_of = |run: &Range<usize>| run.clone().map(|e| self.leaving(e)).sum::<Rgb>();
        largest_share(elements.iter().map(sum_of).sum(), self.total)
    }
}

/// Light that elements have received before any is shot: from sky and luminaires, and from lights
/// that are sampled from the elements because most of their emission goes elsewhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ReceivedLight {
    /// Irradiance of each element, W/m² per channel; empty for none.
    pub irradiance: Vec<Rgb>,
    /// Indices of the materials whose emission it includes: they shoot none of it.
    pub materials: Vec<u32>,
}

impl ReceivedLight {
    /// Whether it includes the emission of `node`.
    fn is_of(&self, mesh: &Mesh, node: NodeId) -> bool {
        let material = mesh.scene().triangles()[mesh.triangle(node)].material;
        self.materials.contains(&material)
    }
}

/// Destination of flux that was sent, W per channel.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Transfer {
    /// Reflected at the fronts of elements, or transmitted there.
    pub scattered: Rgb,
    /// Absorbed at the fronts of elements.
    pub absorbed: Rgb,
    /// Hit no surface.
    pub escaped: Rgb,
    /// Hit the back of a surface and was lost there.
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

/// Sends `flux` along `row`; calls `receive` with each element and the flux that it receives, of
/// which the share `albedo` leaves again.
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

/// As [`send`], through panes: `weaken` attenuates the flux to each entry (by its number), then the
/// escaping flux, then the flux to back faces.
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

/// Flux of all elements, and its ledger.
#[derive(Clone)]
pub(super) struct FluxState<'m> {
    pub mesh: &'m Mesh,
    pub flux: Flux,
    pub ledger: Ledger,
}

impl<'m> FluxState<'m> {
    /// The emission of `mesh` and the light `received`, none of it shot.
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

    /// Distributes `flux`, already removed from the unshot flux, along `row`.
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

    /// Adds the losses in `transfer` to the ledger.
    pub fn record_losses(&mut self, transfer: Transfer) {
        self.ledger.absorbed += transfer.absorbed;
        self.ledger.escaped += transfer.escaped;
        self.ledger.backface_loss += transfer.backface;
        self.ledger.pane_loss += transfer.panes;
    }

    /// Sums the unshot flux anew, so that rounding does not accumulate, and verifies that emitted
    /// and accounted flux are equal.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`] when they differ by more than 1e-9 of the emitted: sums of some
    /// 10⁹ terms in f64 stay far below.
    pub fn recompute_and_verify_energy(&mut self) -> Result<(), Error> {
        self.ledger.unshot = self.flux.unshot.iter().map(|u| u.max(Rgb::ZERO)).sum();
        self.ledger.overshot = self.flux.unshot.iter().map(|u| (-*u).max(Rgb::ZERO)).sum();
        let imbalance = self.ledger.imbalance();
        if imbalance <= 1e-9 {
            return Ok(());
        }
        Err(Error::new(
            ErrorKind::FormFactor,
            "energy ledger",
            format!("emitted and accounted flux differ by {imbalance:e} of the emitted"),
            "they must agree to 1e-9; rows that are not finite can do this",
        ))
    }

    /// Radiosity of each element, W/m²; 0 for holes.
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
        let mesh = Mesh::new(crate::load_scene(path).unwrap(), 300.0).unwrap();
        let light = mesh.scene().materials().iter().position(|m| m.exitance != Rgb::ZERO).unwrap();
        let irradiance = vec![Rgb::new(1.0, 2.0, 3.0); mesh.element_count()];
        let received = ReceivedLight { irradiance, materials: vec![light as u32] };
        let state = FluxState::new(&mesh, &received).unwrap();
        let area = mesh.scattering_area();
        let close = |a: Rgb, b: Rgb| (a - b).abs().max_element() < 1e-9 * b.max_element();
        // All flux that the lamp sends to reflecting surfaces; the reflected part of it is unshot.
        assert!(close(state.ledger.emitted, area * Rgb::new(1.0, 2.0, 3.0)), "{:?}", state.ledger);
        let reflected = mesh.mean_albedo() * area * Rgb::new(1.0, 2.0, 3.0);
        assert!(close(state.ledger.unshot, reflected), "{:?} {reflected}", state.ledger);
        assert!(state.ledger.imbalance() < 1e-12);
        // The leaving flux is all of it, emission included.
        for (e, radiosity) in state.radiosity().into_iter().enumerate() {
            let material = mesh.material(mesh.element(e));
            let leaving = material.exitance + material.reflectance * Rgb::new(1.0, 2.0, 3.0);
            assert!(close(radiosity, leaving), "{e}: {radiosity} {leaving}");
        }
    }
}
