//! Progressive shooting (Cohen, Chen, Wallace, Greenberg 1988) in f64.
//!
//! The state is flux, not radiosity: a patch that shoots Φ sends F_ij Φ to element j, which absorbs
//! (1 − ρ_j) of it and has the rest to shoot. Divided by the receiver's area that is the textbook
//! ΔB_j = ρ_j ΔB_i F_ij A_i/A_j, and no size of patch or element can make or lose energy.

use std::ops::Range;
use std::time::Instant;

use super::kept_rows::KeptRows;
use super::shooters::{Shooters, Shot};
use super::{Flux, Go, Ledger, Progress, Solution, Stop};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Settings of progressive shooting; [`Shooting::default`] is usable as it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Shooting {
    /// Stop when no channel has more than this share of its emitted flux unshot, in [0, 1].
    pub unshot: f64,
    /// Stop after this many shots.
    pub shots: Option<u64>,
    /// Bytes that kept rows may take.
    pub row_memory: usize,
    /// How much of its light a patch may send wrong because it shoots from one place: the share of
    /// the emitted light that it carries, under a square root, times the share of this that goes
    /// wrong, as far as can be told from its size, from how near its receivers are and from how
    /// uneven it is. Patches are as large as this lets them be, from clusters of many triangles down
    /// to elements. 0 makes every patch as small as `level` allows. Elements of emitters shoot by
    /// themselves where they are few. Rows are taken to be right for near receivers: see
    /// [`NearRepair`](crate::NearRepair).
    pub tolerance: f64,
    /// The smallest patches are this many quadtree levels above the elements: 4ᵏ elements, or a
    /// triangle.
    pub level: u32,
}

impl Default for Shooting {
    fn default() -> Self {
        Shooting { unshot: 1e-3, shots: None, row_memory: 1 << 30, tolerance: 4e-3, level: 0 }
    }
}

/// The ledger must close to this after every batch: f64 sums of some 10⁹ terms stay far below.
const IMBALANCE: f64 = 1e-9;

/// Less than this share unshot cannot change a radiosity in f64: asking for 0 ends here.
const LEAST_UNSHOT: f64 = 1e-16;

impl Shooting {
    /// Spreads the light that `mesh` emits, with rows from `form_factors`, brightest patch first.
    ///
    /// `progress` is told of every shot, and of every row that was made in vain, and may stop the
    /// solver; what was reached is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1] or `tolerance` not at least 0;
    /// [`ErrorKind::FormFactor`] when a row breaks its contract; whatever `form_factors` fails with.
    pub fn solve(
        &self,
        mesh: &Mesh,
        form_factors: &mut dyn FormFactors,
        mut progress: impl FnMut(&Progress) -> Go,
    ) -> Result<Solution, Error> {
        if !(0.0..=1.0).contains(&self.unshot) {
            let place = format!("unshot share {}", self.unshot);
            return Err(Error::new(ErrorKind::Setting, place, "out of range", "use 0 to 1"));
        }
        if self.tolerance.is_nan() || self.tolerance < 0.0 {
            let place = format!("tolerance {}", self.tolerance);
            return Err(Error::new(ErrorKind::Setting, place, "below 0", "use 0 or more"));
        }
        let start = Instant::now();
        let mut state = State::new(mesh);
        let mut shooters = Shooters::new(mesh, self.tolerance, self.level);
        let mut kept = KeptRows::new(self.row_memory);
        let (mut shots, mut rows_made) = (0, 0);
        let stop = 'solve: loop {
            state.settle()?;
            if state.ledger.unshot_share() <= self.unshot.max(LEAST_UNSHOT) {
                break Stop::Converged;
            }
            let left = self.shots.map_or(u64::MAX, |most| most - shots);
            if left == 0 {
                break Stop::Shots;
            }
            let missing = |patch| kept.get(patch).is_none();
            let batch = shooters.brightest(&state.flux, form_factors.batch(), left, missing);
            let draws: Vec<&Shot> = batch.iter().filter(|s| missing(s.patch)).collect();
            let share = |s: &&Shot| state.flux.unshot_share(&s.elements);
            let unshot_share = draws.iter().map(share).fold(0.0, f64::max);
            let missing: Vec<NodeId> = draws.iter().map(|s| s.patch).collect();
            let made = form_factors.rows(mesh, &missing, unshot_share)?;
            if made.len() != missing.len() {
                let found = format!("{} rows for {} patches", made.len(), missing.len());
                let remedy = "FormFactors::rows must return one row a patch";
                return Err(Error::new(ErrorKind::FormFactor, "form factors", found, remedy));
            }
            rows_made += made.len() as u64;
            let mut made = made.into_iter();
            for shot in batch {
                match kept.get(shot.patch) {
                    Some(row) => {
                        state.shoot(&shot.elements, row);
                        shots += 1;
                    }
                    None => {
                        let Some(row) = made.next() else { break };
                        row.check(mesh, shot.patch)?;
                        // Else the patch is too large, and its parts shoot.
                        if shooters.confirm(&shot, &row, &state.flux) {
                            state.shoot(&shot.elements, &row);
                            kept.keep(shot.patch, row);
                            shots += 1;
                        }
                    }
                }
                let unshot_share = state.ledger.unshot_share();
                let told = Progress { shots, rows_made, unshot_share, elapsed: start.elapsed() };
                if progress(&told).is_break() {
                    state.settle()?;
                    break 'solve Stop::Cancelled;
                }
            }
        };
        Ok(Solution { radiosity: state.radiosity(), ledger: state.ledger, shots, rows_made, stop })
    }
}

struct State<'m> {
    mesh: &'m Mesh,
    /// Reflectance of each element.
    reflectance: Vec<Rgb>,
    flux: Flux,
    ledger: Ledger,
}

impl<'m> State<'m> {
    fn new(mesh: &'m Mesh) -> State<'m> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let unshot: Vec<Rgb> =
            elements.clone().map(|n| mesh.material(n).exitance * mesh.area(n)).collect();
        let reflectance = elements.map(|n| mesh.material(n).reflectance).collect();
        let emitted = unshot.iter().sum();
        let ledger = Ledger { emitted, unshot: emitted, ..Default::default() };
        let flux = Flux { emitted, leaving: unshot.clone(), unshot };
        State { mesh, reflectance, flux, ledger }
    }

    /// Passes the unshot flux of `from` on along `row`.
    fn shoot(&mut self, from: &[Range<usize>], row: &Row) {
        let Flux { unshot, leaving, .. } = &mut self.flux;
        let mut flux = Rgb::ZERO;
        for elements in from {
            flux += unshot[elements.clone()].iter().sum::<Rgb>();
            unshot[elements.clone()].fill(Rgb::ZERO);
        }
        let per_share = flux / f64::from(Row::TOTAL);
        let (mut absorbed, mut reflected) = (Rgb::ZERO, Rgb::ZERO);
        for entry in &row.entries {
            let e = entry.element as usize;
            let incident = per_share * f64::from(entry.share);
            let passed = incident * self.reflectance[e];
            unshot[e] += passed;
            leaving[e] += passed;
            reflected += passed;
            absorbed += incident - passed;
        }
        self.ledger.absorbed += absorbed;
        self.ledger.left += per_share * f64::from(row.open);
        self.ledger.back += per_share * f64::from(row.back);
        self.ledger.unshot += reflected - flux;
    }

    /// Counts what is unshot anew and checks that the ledger closes.
    fn settle(&mut self) -> Result<(), Error> {
        self.ledger.unshot = self.flux.unshot.iter().sum();
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

    fn radiosity(&self) -> Vec<Rgb> {
        let flux = self.flux.leaving.iter().zip(0..);
        flux.map(|(&w, e)| w / self.mesh.area(self.mesh.element(e))).collect()
    }
}
