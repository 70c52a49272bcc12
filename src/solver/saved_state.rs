//! The content of a saved session, and its restoration: every part is checked before it is used.
//!
//! The order and types of all fields here, and of the types in them, are the file format: postcard
//! writes no names. The content must not change within a version of
//! [`checkpoint`](super::checkpoint).

use serde::{Deserialize, Serialize};

use super::flux_state::FluxState;
use super::gmres::Gmres;
use super::method_state::MethodState;
use super::patch_cut::CutSnapshot;
use super::relaxation::Relaxation;
use super::row_cache::{PatchHistory, RowCache};
use super::shooting::Shooting;
use super::step::Counters;
use super::{Ledger, Method, SolveSession, Solver};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{Entry, Row};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Remedy for a damaged file.
pub(super) const DAMAGED: &str = "the file is damaged: use another, or solve from the start";

/// Maximum number of steps, shots or rows in a file: more than any solve reaches, and far from
/// overflow.
const MAX_COUNTER: u64 = 1 << 60;

/// The error for a file in which `place` is wrong.
pub(super) fn refuse(place: &str, found: impl Into<String>, remedy: &str) -> Error {
    Error::new(ErrorKind::File, format!("saved state, {place}"), found, remedy)
}

/// The saved form of a session.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedSession {
    counters: Counters,
    rows_made: u64,
    free_bytes: u64,
    ledger: Ledger,
    incident: Vec<Rgb>,
    unshot: Vec<Rgb>,
    /// By ascending patch.
    histories: Vec<(NodeId, PatchHistory)>,
    /// Stale rows, which cannot be computed again.
    rows: Vec<(NodeId, SavedRow)>,
    method: SavedMethodState,
}

/// The saved form of a [`Row`].
#[derive(Serialize, Deserialize)]
struct SavedRow {
    /// Element and share.
    entries: Vec<(u32, u32)>,
    escaped: u32,
    backface: u32,
    passed: Vec<[u32; 3]>,
}

/// The saved form of a [`MethodState`].
#[derive(Serialize, Deserialize)]
enum SavedMethodState {
    Shooting(CutSnapshot),
    Relaxation(Relaxation),
    Gmres(Gmres),
    Direct,
}

impl SavedSession {
    /// The saved form of `session`.
    pub fn of(session: &SolveSession) -> SavedSession {
        let SolveSession { state, rows, method, counters, .. } = session;
        let histories: Vec<(NodeId, PatchHistory)> =
            rows.histories.iter().map(|(&patch, &history)| (patch, history)).collect();
        let stale_rows = histories
            .iter()
            .filter(|(_, history)| history.cached && history.stale_fraction > 0.0)
            .filter_map(|&(patch, _)| Some((patch, SavedRow::of(rows.get(patch)?))))
            .collect();
        SavedSession {
            counters: *counters,
            rows_made: rows.rows_made,
            free_bytes: rows.free_bytes() as u64,
            ledger: state.ledger,
            incident: state.flux.incident.clone(),
            unshot: state.flux.unshot.clone(),
            histories,
            rows: stale_rows,
            method: SavedMethodState::of(method),
        }
    }

    /// Restores the saved state to `session`, which has just begun.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when a part is not valid for such a session.
    pub fn restore<'m>(
        self,
        session: SolveSession<'m>,
        row_source: String,
    ) -> Result<SolveSession<'m>, Error> {
        let SavedSession { counters, rows_made, free_bytes, histories, .. } = self;
        let SolveSession { solver, state, mut rows, .. } = session;
        let mesh = state.mesh;
        let mut state = state;
        restore_flux(&mut state, self.incident, self.unshot)?;
        restore_ledger(&mut state, self.ledger)?;
        check_histories(&histories, mesh)?;
        rows.restore(histories.into_iter().collect(), rows_made, free_bytes as usize);
        restore_rows(&mut rows, self.rows, mesh)?;
        check_counters(counters, rows_made)?;
        let method = self.method.restore(&solver, mesh)?;
        let stop = None;
        let session = SolveSession { solver, state, rows, method, counters, stop, row_source };
        // Flux held by the method is accounted for only once it is finished.
        session.clone().finish().map_err(|e| refuse("ledger", e.to_string(), DAMAGED))?;
        Ok(session)
    }
}

fn restore_flux(state: &mut FluxState, incident: Vec<Rgb>, unshot: Vec<Rgb>) -> Result<(), Error> {
    let count = state.mesh.element_count();
    let is_flux = |flux: &[Rgb]| flux.len() == count && flux.iter().all(|w| w.is_finite());
    if !is_flux(&incident) || !is_flux(&unshot) {
        let found = format!("flux of {} and {} elements", incident.len(), unshot.len());
        return Err(refuse("flux", found, &format!("must be {count} finite triples each")));
    }
    state.flux.incident = incident;
    state.flux.unshot = unshot;
    Ok(())
}

/// The balance is checked when all else is restored.
fn restore_ledger(state: &mut FluxState, ledger: Ledger) -> Result<(), Error> {
    let Ledger { emitted, absorbed, escaped, backface_loss, pane_loss, unshot, overshot } = ledger;
    let parts = [absorbed, escaped, backface_loss, pane_loss, unshot, overshot];
    if emitted != state.ledger.emitted || !parts.iter().all(|w| w.is_finite()) {
        let remedy = format!("must be of {} W", state.ledger.emitted);
        return Err(refuse("ledger", format!("{ledger:?}"), &remedy));
    }
    state.ledger = ledger;
    Ok(())
}

fn check_histories(histories: &[(NodeId, PatchHistory)], mesh: &Mesh) -> Result<(), Error> {
    let is_share = |share: f64| (0.0..=1.0).contains(&share);
    for (patch, history) in histories {
        let PatchHistory { sent, importance, stale_fraction, .. } = *history;
        let is_consistent = sent.is_finite() && is_share(importance) && is_share(stale_fraction);
        if !mesh.contains(*patch) || !is_consistent {
            return Err(refuse("patches", format!("patch {}", patch.0), DAMAGED));
        }
    }
    if histories.windows(2).any(|w| w[0].0 >= w[1].0) {
        return Err(refuse("patches", "patches out of order", DAMAGED));
    }
    Ok(())
}

fn restore_rows(
    cache: &mut RowCache,
    rows: Vec<(NodeId, SavedRow)>,
    mesh: &Mesh,
) -> Result<(), Error> {
    for (patch, row) in rows {
        let row = Row::from(row);
        row.check(mesh, patch).map_err(|e| refuse("rows", e.to_string(), DAMAGED))?;
        cache.restore_row(patch, row);
    }
    Ok(())
}

fn check_counters(counters: Counters, rows_made: u64) -> Result<(), Error> {
    let Counters { steps, shots } = counters;
    if [steps, shots, rows_made].into_iter().max() > Some(MAX_COUNTER) {
        let found = format!("{steps} steps, {shots} shots, {rows_made} rows");
        return Err(refuse("counts", found, DAMAGED));
    }
    Ok(())
}

impl SavedRow {
    fn of(row: &Row) -> SavedRow {
        let entries = row.entries.iter().map(|e| (e.element, e.share)).collect();
        let Row { escaped, backface, .. } = *row;
        SavedRow { entries, escaped, backface, passed: row.passed.clone() }
    }
}

impl From<SavedRow> for Row {
    /// Unchecked.
    fn from(saved: SavedRow) -> Row {
        let SavedRow { entries, escaped, backface, passed } = saved;
        let entries = entries.into_iter().map(|(element, share)| Entry { element, share });
        Row { entries: entries.collect(), escaped, backface, passed }
    }
}

impl SavedMethodState {
    fn of(method: &MethodState) -> SavedMethodState {
        match method {
            MethodState::Shooting(shooting) => SavedMethodState::Shooting(shooting.cut.snapshot()),
            MethodState::Relaxation(relaxation) => SavedMethodState::Relaxation(relaxation.clone()),
            MethodState::Gmres(gmres) => SavedMethodState::Gmres(gmres.clone()),
            MethodState::Direct => SavedMethodState::Direct,
        }
    }

    /// The state of the method of `solver`, if it is valid over `mesh`.
    fn restore<'m>(self, solver: &Solver, mesh: &'m Mesh) -> Result<MethodState<'m>, Error> {
        let count = mesh.element_count();
        let restored = match (self, solver.method) {
            (SavedMethodState::Shooting(cut), Method::Shooting { overshoot }) => {
                Shooting::from_snapshot(solver, overshoot, mesh, cut).map(MethodState::Shooting)
            }
            (SavedMethodState::Relaxation(relaxation), Method::Jacobi) => {
                let fits = relaxation.is_consistent(count, true);
                fits.then_some(MethodState::Relaxation(relaxation))
            }
            (SavedMethodState::Relaxation(relaxation), Method::GaussSeidel) => {
                let fits = relaxation.is_consistent(count, false);
                fits.then_some(MethodState::Relaxation(relaxation))
            }
            (SavedMethodState::Gmres(gmres), Method::Gmres { .. }) => {
                let fits = gmres.is_consistent(count);
                fits.then_some(MethodState::Gmres(gmres))
            }
            (SavedMethodState::Direct, Method::Direct) => Some(MethodState::Direct),
            _ => None,
        };
        restored
            .ok_or_else(|| refuse("method", "what it had in hand does not fit the mesh", DAMAGED))
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::backend::cpu::RayRows;
    use crate::solver::patch_cut::ShootingPatch;

    fn patches(saved: &mut SavedSession) -> &mut Vec<ShootingPatch> {
        match &mut saved.method {
            SavedMethodState::Shooting(cut) => &mut cut.patches,
            _ => panic!("saved while shooting"),
        }
    }

    /// Saves a session of three batches, applies `damage`, and expects an error that names `place`.
    fn expect_refusal(solver: Solver, place: &str, damage: fn(&mut SavedSession)) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 300.0).unwrap();
        let mut rows = RayRows::new(&mesh, 64).unwrap();
        let mut session = solver.begin(&mesh).unwrap();
        for _ in 0..3 {
            session.advance(&mut rows, |_| ControlFlow::Continue(())).unwrap();
        }
        let restore = |saved: SavedSession| {
            let begun = solver.begin(&mesh).unwrap();
            saved.restore(begun, String::new())
        };
        let bytes = postcard::to_extend(&SavedSession::of(&session), vec![]).unwrap();
        assert!(restore(postcard::from_bytes(&bytes).unwrap()).is_ok());
        let mut saved: SavedSession = postcard::from_bytes(&bytes).unwrap();
        damage(&mut saved);
        let Err(e) = restore(saved) else { panic!("taken: {place}") };
        assert!(e.place().contains(place), "{place}: {e}");
    }

    #[test]
    fn restore_rejects_flux_that_does_not_fit() {
        let [shooting, ..] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "flux", |s| s.incident[3].y = f64::NAN);
        expect_refusal(shooting, "flux", |s| s.unshot[0].x = f64::INFINITY);
        expect_refusal(shooting, "flux", |s| s.unshot.truncate(1));
    }

    #[test]
    fn restore_rejects_ledger_of_other_flux() {
        let [shooting, ..] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "ledger", |s| s.unshot[0].x += 1e9);
        expect_refusal(shooting, "ledger", |s| s.ledger.absorbed.z = f64::NAN);
        expect_refusal(shooting, "ledger", |s| s.ledger.emitted *= 2.0);
    }

    #[test]
    fn restore_rejects_impossible_counters() {
        let [shooting, ..] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "counts", |s| s.counters.shots = u64::MAX);
    }

    #[test]
    fn restore_rejects_history_of_other_mesh() {
        let [shooting, ..] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "patches", |s| s.histories.swap(0, 1));
        expect_refusal(shooting, "patches", |s| s.histories[0].1.importance = -1.0);
        expect_refusal(shooting, "patches", |s| s.histories[0].1.sent.x = f64::NAN);
        expect_refusal(shooting, "patches", |s| {
            s.histories.push((NodeId(1 << 30), PatchHistory::default()));
        });
    }

    #[test]
    fn restore_rejects_row_with_wrong_total() {
        let [shooting, ..] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "rows", |s| {
            let entries = vec![(0, 7)];
            let row = SavedRow { entries, escaped: 0, backface: 0, passed: vec![] };
            s.rows.push((s.histories[0].0, row));
        });
    }

    #[test]
    fn restore_rejects_state_of_another_method_or_mesh() {
        let [shooting, _, jacobi, _, gmres, _] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "method", |s| s.method = SavedMethodState::Direct);
        // A missing patch, and one that occurs twice.
        expect_refusal(shooting, "method", |s| patches(s).truncate(1));
        expect_refusal(shooting, "method", |s| patches(s).extend_from_within(..1));
        expect_refusal(jacobi, "method", |s| {
            s.method = SavedMethodState::Relaxation(Relaxation::gauss_seidel());
        });
        expect_refusal(jacobi, "method", |s| {
            s.method = SavedMethodState::Relaxation(Relaxation::jacobi(1));
        });
        expect_refusal(gmres, "method", |s| s.method = SavedMethodState::Gmres(Gmres::new(0)));
    }
}
