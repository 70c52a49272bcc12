//! Where the light is while a solver runs.
//!
//! The state is flux, not radiosity: who sends Φ along row i sends F_ij Φ to element j, which absorbs
//! (1 − ρ_j) of it and has the rest to pass on. Divided by the receiver's area that is the textbook
//! ΔB_j = ρ_j ΔB_i F_ij A_i/A_j, and no size of patch or element can make or lose energy.
//!
//! With s what was sent, e what is emitted and (Mx)_j = ρ_j Σ_i F_ij x_i, the unshot flux is the
//! residual r = e − s + Ms of the radiosity equation, and what leaves is s + r = e + Ms. Solvers only
//! differ in what they send next (Gortler, Cohen and Slusallek 1994): this, and the ledger, is theirs
//! in common.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::ledger::{Ledger, largest_share};
use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// Flux of the elements, W per channel.
#[derive(Clone)]
pub(super) struct Flux {
    /// Emitted by all.
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
    pub fn emitted_by(mesh: &Mesh) -> Result<Flux, Error> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let emitted: Vec<Rgb> =
            elements.clone().map(|n| mesh.material(n).exitance * mesh.area(n)).collect();
        let reflectance: Vec<Rgb> = elements.map(|n| mesh.material(n).reflectance).collect();
        let total: Rgb = emitted.iter().sum();
        if !total.is_finite() {
            let remedy = "scale exitances down: sums of flux must stay finite in 64-bit floats";
            let found = format!("{total} W");
            return Err(Error::new(ErrorKind::Scene, "emitted flux", found, remedy));
        }
        let (incident, unshot) = (vec![Rgb::ZERO; emitted.len()], emitted.clone());
        Ok(Flux { total, emitted, reflectance, incident, unshot })
    }

    /// Emitted by all elements.
    pub fn total(&self) -> Rgb {
        self.total
    }

    /// Emitted or reflected by element `e`, shot or not.
    pub fn leaving(&self, e: usize) -> Rgb {
        self.emitted[e] + self.reflectance[e] * self.incident[e]
    }

    /// What is unshot or overshot in `elements`, as a share of the emitted: the worst channel.
    pub fn unshot_share(&self, elements: &[Range<usize>]) -> f64 {
        let all =
            |run: &Range<usize>| self.unshot[run.clone()].iter().map(|u| u.abs()).sum::<Rgb>();
        largest_share(elements.iter().map(all).sum(), self.total)
    }

    /// What leaves `elements`, as a share of the emitted: the worst channel.
    pub fn leaving_share(&self, elements: &[Range<usize>]) -> f64 {
        let all = |run: &Range<usize>| run.clone().map(|e| self.leaving(e)).sum::<Rgb>();
        largest_share(elements.iter().map(all).sum(), self.total)
    }
}

/// What became of flux that was sent, W per channel.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct Transfer {
    pub reflected: Rgb,
    pub absorbed: Rgb,
    pub left: Rgb,
    pub back: Rgb,
}

impl Transfer {
    /// Adds `scale` times `other`.
    pub fn add(&mut self, scale: Rgb, other: Transfer) {
        self.reflected += scale * other.reflected;
        self.absorbed += scale * other.absorbed;
        self.left += scale * other.left;
        self.back += scale * other.back;
    }
}

/// Sends `flux` along `row`; `receive` gets what comes to each element, of which it reflects what
/// `reflectance` says.
pub(super) fn send(
    flux: Rgb,
    row: &Row,
    reflectance: impl Fn(usize) -> Rgb,
    mut receive: impl FnMut(usize, Rgb),
) -> Transfer {
    let per_share = flux / f64::from(Row::TOTAL);
    let (mut absorbed, mut reflected) = (Rgb::ZERO, Rgb::ZERO);
    for entry in &row.entries {
        let e = entry.element as usize;
        let incident = per_share * f64::from(entry.share);
        let passed = incident * reflectance(e);
        receive(e, incident);
        reflected += passed;
        absorbed += incident - passed;
    }
    let (left, back) = (per_share * f64::from(row.escaped), per_share * f64::from(row.backface));
    Transfer { reflected, absorbed, left, back }
}

/// Flux of all elements, and the ledger of it.
#[derive(Clone)]
pub(super) struct FluxState<'m> {
    pub mesh: &'m Mesh,
    pub flux: Flux,
    pub ledger: Ledger,
}

/// The ledger must close to this after every batch: f64 sums of some 10⁹ terms stay far below.
pub(super) const IMBALANCE: f64 = 1e-9;

impl<'m> FluxState<'m> {
    pub fn new(mesh: &'m Mesh) -> Result<FluxState<'m>, Error> {
        let flux = Flux::emitted_by(mesh)?;
        let ledger = Ledger { emitted: flux.total, unshot: flux.total, ..Default::default() };
        Ok(FluxState { mesh, flux, ledger })
    }

    /// Sends `flux`, which is no longer unshot anywhere, along `row`.
    pub fn pass_on(&mut self, flux: Rgb, row: &Row) {
        let Flux { reflectance, incident, unshot, .. } = &mut self.flux;
        let sent = send(
            flux,
            row,
            |e| reflectance[e],
            |e, came| {
                incident[e] += came;
                unshot[e] += reflectance[e] * came;
            },
        );
        self.lose(sent);
        self.ledger.unshot += sent.reflected - flux;
    }

    /// Books what is lost of flux that was sent.
    pub fn lose(&mut self, sent: Transfer) {
        self.ledger.absorbed += sent.absorbed;
        self.ledger.escaped += sent.left;
        self.ledger.backface_loss += sent.back;
    }

    /// Counts what is unshot anew and checks that the ledger closes.
    pub fn settle(&mut self) -> Result<(), Error> {
        self.ledger.unshot = self.flux.unshot.iter().map(|u| u.max(Rgb::ZERO)).sum();
        self.ledger.overshot = self.flux.unshot.iter().map(|u| (-*u).max(Rgb::ZERO)).sum();
        let imbalance = self.ledger.imbalance();
        if imbalance <= IMBALANCE {
            return Ok(());
        }
        Err(Error::new(
            ErrorKind::FormFactor,
            "energy ledger",
            format!("emitted and accounted flux differ by {imbalance:e} of the emitted"),
            format!("they must agree to {IMBALANCE:e}; rows that are not finite can do this"),
        ))
    }

    pub fn radiosity(&self) -> Vec<Rgb> {
        let area = |e| self.mesh.area(self.mesh.element(e));
        (0..self.mesh.element_count()).map(|e| self.flux.leaving(e) / area(e)).collect()
    }
}
