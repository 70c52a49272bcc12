//! The content of a saved session, and its restoration: every part is checked before it is used.
//!
//! The order and types of all fields here, and of the types in them, are the file format: postcard
//! writes no names. The content must not change within a version of
//! [`checkpoint`](super::checkpoint).

use serde::{Deserialize, Serialize};

use super::method_state::MethodState;
use super::patch_cut::CutSnapshot;
use super::row_cache::PatchHistory;
use super::step::Counters;
use super::{Ledger, SolveSession};
use crate::error::{Error, ErrorKind};
use crate::form_factor::Row;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Remedy for a damaged file.
pub(super) const DAMAGED: &str = "the file is damaged: use another, or solve from the start";

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
    rows: Vec<(NodeId, Row)>,
    method: MethodState<CutSnapshot>,
}

impl SavedSession {
    /// The saved form of `session`.
    pub fn of(session: &SolveSession) -> SavedSession {
        let SolveSession { state, rows, method, counters, .. } = session;
        let stale = |history: &PatchHistory| history.cached && history.stale_fraction > 0.0;
        let stale_rows = rows.histories.iter().filter(|(_, history)| stale(history));
        let stale_rows = stale_rows.filter_map(|(&p, _)| Some((p, Row::clone(rows.get(p)?))));
        SavedSession {
            counters: *counters,
            rows_made: rows.rows_made,
            free_bytes: rows.free_bytes() as u64,
            ledger: state.ledger,
            incident: state.flux.incident.clone(),
            unshot: state.flux.unshot.clone(),
            histories: rows.histories.iter().map(|(&patch, &history)| (patch, history)).collect(),
            rows: stale_rows.collect(),
            method: method.saved(),
        }
    }

    /// Restores the saved state to `session`, which has just begun.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when a part is not valid for such a session.
    pub fn restore<'m>(
        self,
        mut session: SolveSession<'m>,
        row_source: String,
    ) -> Result<SolveSession<'m>, Error> {
        let SolveSession { solver, state, rows, .. } = &mut session;
        self.check(state.mesh, state.ledger.emitted)?;
        for (patch, row) in &self.rows {
            row.check(state.mesh, *patch).map_err(|e| refuse("rows", e.to_string(), DAMAGED))?;
        }
        state.flux.incident = self.incident;
        state.flux.unshot = self.unshot;
        state.ledger = self.ledger;
        rows.restore(self.histories, self.rows, self.rows_made, self.free_bytes as usize);
        let method = self.method.restored(solver, state.mesh);
        session.method = method.ok_or_else(|| {
            refuse("method", "an intermediate state that does not fit the mesh", DAMAGED)
        })?;
        session.counters = self.counters;
        session.row_source = row_source;
        // Flux held by the method is accounted for only once it is finished.
        session.clone().finish().map_err(|e| refuse("ledger", e.to_string(), DAMAGED))?;
        Ok(session)
    }

    /// Whether the numbers are possible for a session over `mesh` with this `emitted` flux. The
    /// balance of the ledger is checked when all is restored.
    fn check(&self, mesh: &Mesh, emitted: Rgb) -> Result<(), Error> {
        let count = mesh.element_count();
        let is_flux = |flux: &[Rgb]| flux.len() == count && flux.iter().all(|w| w.is_finite());
        let Ledger { absorbed, escaped, backface_loss, pane_loss, unshot, overshot, .. } =
            self.ledger;
        let parts = [absorbed, escaped, backface_loss, pane_loss, unshot, overshot];
        let is_history = |(patch, history): &(NodeId, PatchHistory)| {
            let shares = [history.importance, history.stale_fraction];
            let are_shares = shares.iter().all(|share| (0.0..=1.0).contains(share));
            mesh.contains(*patch) && history.sent.is_finite() && are_shares
        };
        let Counters { steps, shots } = self.counters;
        // More than any solve reaches, and far from overflow.
        let are_counts = [steps, shots, self.rows_made].iter().all(|&n| n <= 1 << 60);
        for (part, is_valid) in [
            ("flux", is_flux(&self.incident) && is_flux(&self.unshot)),
            ("ledger", self.ledger.emitted == emitted && parts.iter().all(|w| w.is_finite())),
            ("patches", self.histories.iter().all(is_history)),
            ("patches", self.histories.is_sorted_by(|a, b| a.0 < b.0)),
            ("counts", are_counts),
        ] {
            if !is_valid {
                return Err(refuse(part, "values that no solve of this mesh has", DAMAGED));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::backend::cpu::RayRows;
    use crate::form_factor::Entry;
    use crate::solver::gmres::Gmres;
    use crate::solver::patch_cut::ShootingPatch;
    use crate::solver::relaxation::Relaxation;
    use crate::solver::{Method, Solver};

    fn patches(saved: &mut SavedSession) -> &mut Vec<ShootingPatch> {
        match &mut saved.method {
            MethodState::Shooting(cut) => &mut cut.patches,
            _ => panic!("saved while shooting"),
        }
    }

    /// Saves a session of three batches, applies `damage`, and expects an error that names `place`.
    fn expect_refusal(solver: Solver, place: &str, damage: fn(&mut SavedSession)) {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_scene(path).unwrap(), 300.0).unwrap();
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
            let entries = vec![Entry { element: 0, share: 7 }];
            s.rows.push((s.histories[0].0, Row { entries, ..Row::default() }));
        });
    }

    #[test]
    fn restore_rejects_state_of_another_method_or_mesh() {
        let [shooting, _, jacobi, _, gmres, _] = Method::ALL.map(Solver::new);
        expect_refusal(shooting, "method", |s| s.method = MethodState::Direct);
        // A missing patch, and one that occurs twice.
        expect_refusal(shooting, "method", |s| patches(s).truncate(1));
        expect_refusal(shooting, "method", |s| patches(s).extend_from_within(..1));
        expect_refusal(jacobi, "method", |s| {
            s.method = MethodState::Relaxation(Relaxation::gauss_seidel());
        });
        expect_refusal(jacobi, "method", |s| {
            s.method = MethodState::Relaxation(Relaxation::jacobi(1));
        });
        expect_refusal(gmres, "method", |s| s.method = MethodState::Gmres(Gmres::new(0)));
    }
}
