//! Progressive shooting (Cohen, Chen, Wallace, Greenberg 1988) in f64.
//!
//! The state is flux, not radiosity: a patch that shoots Φ sends F_ij Φ to element j, which absorbs
//! (1 − ρ_j) of it and has the rest to shoot. Divided by the receiver's area that is the textbook
//! ΔB_j = ρ_j ΔB_i F_ij A_i/A_j, and no size of patch or element can make or lose energy.

use std::ops::Range;
use std::time::Instant;

use super::kept_rows::KeptRows;
use super::{Go, Ledger, Progress, Solution, Stop, largest_share};
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
    /// How many quadtree levels above the elements patches shoot: 4ᵏ elements a patch. Elements of
    /// emitters shoot by themselves, since what is nearest a lamp depends most on its shape.
    pub level: u32,
}

impl Default for Shooting {
    fn default() -> Self {
        Shooting { unshot: 1e-3, shots: None, row_memory: 1 << 30, level: 1 }
    }
}

/// The ledger must close to this after every batch: f64 sums of some 10⁹ terms stay far below.
const IMBALANCE: f64 = 1e-9;

/// Less than this share unshot cannot change a radiosity in f64: asking for 0 ends here.
const LEAST_UNSHOT: f64 = 1e-16;

impl Shooting {
    /// Spreads the light that `mesh` emits, with rows from `form_factors`, brightest patch first.
    ///
    /// `progress` is told of every shot and may stop the solver; what was reached is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `unshot` is not in [0, 1]; [`ErrorKind::FormFactor`] when a row
    /// breaks its contract; whatever `form_factors` fails with.
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
        let start = Instant::now();
        let mut state = State::new(mesh, shooters(mesh, self.level));
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
            let batch = state.brightest(form_factors.batch(), left, |p| kept.get(p).is_none());
            let missing: Vec<NodeId> =
                batch.iter().map(|s| s.patch).filter(|&p| kept.get(p).is_none()).collect();
            let made = form_factors.rows(mesh, &missing)?;
            if made.len() != missing.len() {
                let found = format!("{} rows for {} patches", made.len(), missing.len());
                let remedy = "FormFactors::rows must return one row a patch";
                return Err(Error::new(ErrorKind::FormFactor, "form factors", found, remedy));
            }
            rows_made += made.len() as u64;
            let mut made = made.into_iter();
            for shooter in batch {
                let patch = shooter.patch;
                match kept.get(patch) {
                    Some(row) => state.shoot(&shooter.elements, row),
                    None => {
                        let Some(row) = made.next() else { break };
                        row.check(mesh, patch)?;
                        state.shoot(&shooter.elements, &row);
                        kept.keep(patch, row);
                    }
                }
                shots += 1;
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

/// A patch that shoots, and the elements that it shoots for.
#[derive(Clone, Debug)]
pub(crate) struct Shooter {
    pub patch: NodeId,
    pub elements: Range<usize>,
}

/// The nodes that shoot: `level` above the elements where the tree is that deep everywhere below,
/// the elements themselves on emitters. Together they cover every element once.
pub(crate) fn shooters(mesh: &Mesh, level: u32) -> Vec<Shooter> {
    fn height(mesh: &Mesh, node: NodeId) -> u32 {
        mesh.children(node).map_or(0, |c| 1 + c.iter().map(|&k| height(mesh, k)).max().unwrap_or(0))
    }
    fn collect(mesh: &Mesh, node: NodeId, level: u32, out: &mut Vec<Shooter>) {
        match mesh.children(node) {
            Some(children) if height(mesh, node) > level => {
                children.iter().for_each(|&k| collect(mesh, k, level, out));
            }
            _ => out.push(Shooter { patch: node, elements: mesh.elements_of(node) }),
        }
    }
    let mut out = vec![];
    for t in 0..mesh.scene().triangles().len() {
        let emits = mesh.scene().material(t).exitance != Rgb::ZERO;
        collect(mesh, mesh.root(t), if emits { 0 } else { level }, &mut out);
    }
    out
}

struct State<'m> {
    mesh: &'m Mesh,
    shooters: Vec<Shooter>,
    /// Reflectance of each element.
    reflectance: Vec<Rgb>,
    /// Unshot flux of each element, W.
    unshot: Vec<Rgb>,
    /// All flux that each element emits or reflects, shot or not, W.
    leaving: Vec<Rgb>,
    ledger: Ledger,
}

impl<'m> State<'m> {
    fn new(mesh: &'m Mesh, shooters: Vec<Shooter>) -> State<'m> {
        let elements = (0..mesh.element_count()).map(|e| mesh.element(e));
        let unshot: Vec<Rgb> =
            elements.clone().map(|n| mesh.material(n).exitance * mesh.area(n)).collect();
        let reflectance = elements.map(|n| mesh.material(n).reflectance).collect();
        let emitted = unshot.iter().sum();
        let ledger = Ledger { emitted, unshot: emitted, ..Default::default() };
        State { mesh, shooters, reflectance, leaving: unshot.clone(), unshot, ledger }
    }

    /// The shooters with most unshot flux, most first: the largest share of what its channel
    /// emits counts. Ends at `rows` patches whose row is missing, at `most` patches, or where the
    /// flux falls far below the first's, so that no dim patch shoots before a bright one is lit.
    fn brightest(&self, rows: usize, most: u64, missing: impl Fn(NodeId) -> bool) -> Vec<Shooter> {
        let share = |s: &Shooter| {
            let flux = self.unshot[s.elements.clone()].iter().sum();
            largest_share(flux, self.ledger.emitted)
        };
        let mut bright: Vec<(f64, usize)> =
            self.shooters.iter().map(share).zip(0..).filter(|s| s.0 > 0.0).collect();
        bright.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let floor = bright.first().map_or(0.0, |s| s.0 * BATCH_FALL);
        let mut wanted = rows.max(1);
        let mut batch = vec![];
        for &(share, k) in &bright {
            let shooter = &self.shooters[k];
            let draws = missing(shooter.patch);
            if share < floor || batch.len() as u64 >= most || (draws && wanted == 0) {
                break;
            }
            wanted -= usize::from(draws);
            batch.push(shooter.clone());
        }
        batch
    }

    /// Passes the unshot flux of `from` on along `row`.
    fn shoot(&mut self, from: &Range<usize>, row: &Row) {
        let flux: Rgb = self.unshot[from.clone()].iter().sum();
        self.unshot[from.clone()].fill(Rgb::ZERO);
        let per_share = flux / f64::from(Row::TOTAL);
        let (mut absorbed, mut reflected) = (Rgb::ZERO, Rgb::ZERO);
        for entry in &row.entries {
            let e = entry.element as usize;
            let incident = per_share * f64::from(entry.share);
            let passed = incident * self.reflectance[e];
            self.unshot[e] += passed;
            self.leaving[e] += passed;
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
        self.ledger.unshot = self.unshot.iter().sum();
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
        let flux = self.leaving.iter().zip(0..);
        flux.map(|(&w, e)| w / self.mesh.area(self.mesh.element(e))).collect()
    }
}

/// A batch ends where the flux is below this share of its brightest patch.
const BATCH_FALL: f64 = 0.25;
