//! A solve as a file: written between batches, read again, the same bits.
//!
//! The file is a few words of magic, a postcard message and its checksum. It names the mesh by a
//! fingerprint and the settings in words, and goes on with no others. RowCache are not in it but for
//! those that cannot be made again; what else was kept is made again when it is asked for, as it was.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::flux_state::FluxState;
use super::gmres::Gmres;
use super::method::saved_identity;
use super::patch_cut::{CutSnapshot, PatchCut};
use super::relaxation::Relaxation;
use super::row_cache::PatchHistory;
use super::session::{Counters, MethodState, SolveSession};
use super::{Ledger, Method, Solver};
use crate::error::{Error, ErrorKind};
use crate::form_factor::{Entry, FormFactors, Row};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Begins every file; the last byte is the version.
const MAGIC: &[u8; 8] = b"radiosi\x01";

/// What names a solve.
#[derive(Serialize, Deserialize)]
struct Name {
    mesh: u64,
    method: String,
    rows: String,
}

#[derive(Serialize, Deserialize)]
struct Saved {
    done: Counters,
    made: u64,
    free: u64,
    ledger: Ledger,
    incident: Vec<Rgb>,
    unshot: Vec<Rgb>,
    trails: Vec<(NodeId, PatchHistory)>,
    rows: Vec<(NodeId, SavedRow)>,
    course: SavedMethodState,
}

#[derive(Serialize, Deserialize)]
struct SavedRow {
    entries: Vec<(u32, u32)>,
    open: u32,
    back: u32,
}

#[derive(Serialize, Deserialize)]
enum SavedMethodState {
    Shooting(CutSnapshot),
    Relaxation(Relaxation),
    Gmres(Gmres),
    Direct,
}

impl SolveSession<'_> {
    /// Writes the state to `path`, so that [`Solver::resume`] can go on from there. Whenever this is
    /// cut short, the file is either what it was or what it was to be.
    ///
    /// Takes 48 bytes an element, some 40 a patch that has shot, and what the method has in hand: with
    /// GMRES 48 bytes an element for each product of the cycle.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let failed = |e: std::io::Error| {
            let remedy = "choose a folder that can be written to and has room";
            Err(Error::new(ErrorKind::File, path.display().to_string(), e.to_string(), remedy)
                .with_source(e))
        };
        let mut beside = path.as_os_str().to_owned();
        beside.push(".new");
        fs::write(&beside, self.to_bytes()).and_then(|()| fs::rename(&beside, path)).or_else(failed)
    }

    /// What [`SolveSession::save`] writes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let SolveSession { solver, state, rows, course, done, made_by, .. } = self;
        let name = Name {
            mesh: state.mesh.fingerprint(),
            method: saved_identity(solver),
            rows: made_by.clone(),
        };
        let trails: Vec<(NodeId, PatchHistory)> =
            rows.trails.iter().map(|(&p, &t)| (p, t)).collect();
        let doubtful = trails.iter().filter(|(_, trail)| trail.kept && trail.doubt > 0.0);
        let old = doubtful.filter_map(|&(patch, _)| Some((patch, rows.get(patch)?)));
        let saved = Saved {
            done: *done,
            made: rows.made,
            free: rows.free() as u64,
            ledger: state.ledger,
            incident: state.flux.incident.clone(),
            unshot: state.flux.unshot.clone(),
            rows: old.map(|(patch, row)| (patch, SavedRow::of(row))).collect(),
            trails,
            course: match course {
                MethodState::Shooting(shooters) => SavedMethodState::Shooting(shooters.cut()),
                MethodState::Relaxation(relaxation) => {
                    SavedMethodState::Relaxation(relaxation.clone())
                }
                MethodState::Gmres(gmres) => SavedMethodState::Gmres(gmres.clone()),
                MethodState::Direct => SavedMethodState::Direct,
            },
        };
        let bytes = MAGIC.to_vec();
        let bytes = postcard::to_extend(&(name, saved), bytes).expect("memory takes all bytes");
        seal(bytes)
    }
}

/// `bytes` with their checksum.
fn seal(mut bytes: Vec<u8>) -> Vec<u8> {
    let sum = xxh3_64(&bytes);
    bytes.extend(sum.to_le_bytes());
    bytes
}

impl Solver {
    /// The solve that [`SolveSession::save`] wrote to `path`, to go on over `mesh` with rows from
    /// `form_factors`: it ends with the same bits as if it had not been interrupted. StopReason rules and
    /// memory for rows may have changed.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when the file cannot be read, is damaged, or is that of another mesh, method
    /// or maker of rows; those of [`Solver::begin`].
    pub fn resume<'m>(
        &self,
        mesh: &'m Mesh,
        form_factors: &dyn FormFactors,
        path: impl AsRef<Path>,
    ) -> Result<SolveSession<'m>, Error> {
        let path = path.as_ref();
        let bytes = fs::read(path).map_err(|e| {
            let place = path.display().to_string();
            Error::new(ErrorKind::File, place, e.to_string(), "name a file that can be read")
                .with_source(e)
        })?;
        self.resume_bytes(mesh, form_factors, &bytes).map_err(|e| e.inside(path))
    }

    /// The same from bytes.
    ///
    /// # Errors
    /// Those of [`Solver::resume`].
    pub fn resume_bytes<'m>(
        &self,
        mesh: &'m Mesh,
        form_factors: &dyn FormFactors,
        bytes: &[u8],
    ) -> Result<SolveSession<'m>, Error> {
        let solve = self.begin(mesh)?;
        let Some(body) = bytes.strip_prefix(MAGIC) else {
            let found = format!("the first bytes are {:x?}", &bytes[..bytes.len().min(8)]);
            return Err(bad("header", found, "give a state that this version has saved"));
        };
        let Some((body, sum)) = body.split_last_chunk::<8>() else {
            return Err(bad("end of file", "no checksum", REMEDY));
        };
        if xxh3_64(&bytes[..bytes.len() - 8]).to_le_bytes() != *sum {
            return Err(bad("end of file", "a checksum that is not that of the file", REMEDY));
        }
        let damaged = |e: postcard::Error| bad("content", e.to_string(), REMEDY);
        let (name, rest) = postcard::take_from_bytes::<Name>(body).map_err(damaged)?;
        let same = |what: &str, saved: &str, now: &str| match saved == now {
            true => Ok(()),
            false => Err(bad(what, format!("'{saved}'"), &format!("here it is '{now}'"))),
        };
        let hex = |mesh: u64| format!("{mesh:016x}");
        same("fingerprint of the mesh", &hex(name.mesh), &hex(mesh.fingerprint()))?;
        same("method", &name.method, &saved_identity(self))?;
        same("rows", &name.rows, &form_factors.fingerprint())?;
        let (saved, rest) = postcard::take_from_bytes::<Saved>(rest).map_err(damaged)?;
        if !rest.is_empty() {
            return Err(bad("content", format!("{} bytes too many", rest.len()), REMEDY));
        }
        saved.restore(solve, name.rows)
    }
}

const REMEDY: &str = "the file is damaged: use another, or solve from the start";

fn bad(place: &str, found: impl Into<String>, remedy: &str) -> Error {
    Error::new(ErrorKind::File, format!("saved state, {place}"), found, remedy)
}

/// Nobody has done more than this.
const MOST_DONE: u64 = 1 << 60;

impl Saved {
    /// `fresh` as it was when it was saved, if that is possible.
    fn restore<'m>(
        self,
        fresh: SolveSession<'m>,
        made_by: String,
    ) -> Result<SolveSession<'m>, Error> {
        let Saved { done, made, free, ledger, incident, unshot, trails, rows: old, course } = self;
        let SolveSession { solver, state, mut rows, .. } = fresh;
        let mesh = state.mesh;
        let count = mesh.element_count();
        let all = |flux: &[Rgb]| flux.len() == count && flux.iter().all(|w| w.is_finite());
        if !all(&incident) || !all(&unshot) {
            let found = format!("flux of {} and {} elements", incident.len(), unshot.len());
            return Err(bad("flux", found, &format!("must be {count} finite triples each")));
        }
        let Ledger {
            emitted,
            absorbed,
            escaped: left,
            backface_loss: back,
            unshot: rest,
            overshot,
        } = ledger;
        let finite = [absorbed, left, back, rest, overshot].iter().all(|w| w.is_finite());
        if emitted != state.ledger.emitted || !finite {
            let found = format!("{ledger:?}");
            return Err(bad("ledger", found, &format!("must be of {} W", state.ledger.emitted)));
        }
        let mut state = FluxState { ledger, ..state };
        state.flux.incident = incident;
        state.flux.unshot = unshot;
        let whole = |t: &PatchHistory| {
            t.sent.is_finite() && (0.0..=1.0).contains(&t.share) && (0.0..=1.0).contains(&t.doubt)
        };
        if let Some((patch, _)) = trails.iter().find(|(p, t)| !mesh.contains(*p) || !whole(t)) {
            return Err(bad("patches", format!("patch {}", patch.0), REMEDY));
        }
        if trails.windows(2).any(|w| w[0].0 >= w[1].0) {
            return Err(bad("patches", "patches out of order", REMEDY));
        }
        rows.restore(trails.into_iter().collect(), made, free as usize);
        for (patch, row) in old {
            let row = row.row();
            row.check(mesh, patch).map_err(|e| bad("rows", e.to_string(), REMEDY))?;
            rows.restore_row(patch, row);
        }
        if [done.steps, done.shots, made].into_iter().max() > Some(MOST_DONE) {
            let found = format!("{} steps, {} shots, {made} rows", done.steps, done.shots);
            return Err(bad("counts", found, REMEDY));
        }
        let unfit = || bad("method", "what it had in hand does not fit the mesh", REMEDY);
        let course = match (course, solver.method) {
            (SavedMethodState::Shooting(cut), Method::Shooting { .. }) => {
                let Solver { patch_tolerance, min_patch_level, .. } = solver;
                let shooters = PatchCut::from_cut(mesh, patch_tolerance, min_patch_level, cut);
                MethodState::Shooting(shooters.ok_or_else(unfit)?)
            }
            (SavedMethodState::Relaxation(relaxation), Method::Jacobi)
                if relaxation.fits(count, true) =>
            {
                MethodState::Relaxation(relaxation)
            }
            (SavedMethodState::Relaxation(relaxation), Method::GaussSeidel)
                if relaxation.fits(count, false) =>
            {
                MethodState::Relaxation(relaxation)
            }
            (SavedMethodState::Gmres(gmres), Method::Gmres { .. }) if gmres.fits(count) => {
                MethodState::Gmres(gmres)
            }
            (SavedMethodState::Direct, Method::Direct) => MethodState::Direct,
            _ => return Err(unfit()),
        };
        let solve = SolveSession { solver, state, rows, course, done, stop: None, made_by };
        // What is in hand is accounted for only once it is handed back.
        solve.clone().finish().map_err(|e| bad("ledger", e.to_string(), REMEDY))?;
        Ok(solve)
    }
}

impl SavedRow {
    fn of(row: &Row) -> SavedRow {
        let entries = row.entries.iter().map(|e| (e.element, e.share)).collect();
        SavedRow { entries, open: row.escaped, back: row.backface }
    }

    fn row(self) -> Row {
        let entry = |(element, share)| Entry { element, share };
        let SavedRow { entries, open, back } = self;
        Row { entries: entries.into_iter().map(entry).collect(), escaped: open, backface: back }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use super::*;
    use crate::backend::cpu::RayRows;
    use crate::solver::patch_cut::ShootingPatch;

    fn shooters(saved: &mut Saved) -> &mut Vec<ShootingPatch> {
        match &mut saved.course {
            SavedMethodState::Shooting(cut) => &mut cut.shooters,
            _ => panic!("saved while shooting"),
        }
    }

    /// A state with a checksum that is right and one thing in it that cannot be is refused.
    #[test]
    fn states_that_cannot_be_are_refused() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 300.0).unwrap();
        let mut rows = RayRows::new(&mesh, 64).unwrap();
        let [shooting, _, jacobi, _, gmres, _] = Method::ALL.map(Solver::new);
        let refused = |solver: Solver, rows: &mut RayRows, what: &str, damage: fn(&mut Saved)| {
            let mut solve = solver.begin(&mesh).unwrap();
            for _ in 0..3 {
                solve.advance(rows, |_| ControlFlow::Continue(())).unwrap();
            }
            let bytes = solve.to_bytes();
            let body = &bytes[MAGIC.len()..bytes.len() - 8];
            let (name, mut saved): (Name, Saved) = postcard::from_bytes(body).unwrap();
            let whole = postcard::to_extend(&(&name, &saved), MAGIC.to_vec()).unwrap();
            assert!(solver.resume_bytes(&mesh, rows, &seal(whole)).is_ok());
            damage(&mut saved);
            let damaged = postcard::to_extend(&(&name, &saved), MAGIC.to_vec()).unwrap();
            let Err(e) = solver.resume_bytes(&mesh, rows, &seal(damaged)) else {
                panic!("taken: {what}")
            };
            assert!(e.place().contains(what), "{what}: {e}");
        };
        let rows = &mut rows;
        refused(shooting, rows, "flux", |s| s.incident[3].y = f64::NAN);
        refused(shooting, rows, "flux", |s| s.unshot[0].x = f64::INFINITY);
        refused(shooting, rows, "flux", |s| s.unshot.truncate(1));
        refused(shooting, rows, "ledger", |s| s.unshot[0].x += 1e9);
        refused(shooting, rows, "ledger", |s| s.ledger.absorbed.z = f64::NAN);
        refused(shooting, rows, "ledger", |s| s.ledger.emitted *= 2.0);
        refused(shooting, rows, "counts", |s| s.done.shots = u64::MAX);
        refused(shooting, rows, "patches", |s| s.trails.swap(0, 1));
        refused(shooting, rows, "patches", |s| s.trails[0].1.share = -1.0);
        refused(shooting, rows, "patches", |s| s.trails[0].1.sent.x = f64::NAN);
        refused(shooting, rows, "patches", |s| {
            s.trails.push((NodeId(1 << 30), PatchHistory::default()))
        });
        refused(shooting, rows, "rows", |s| {
            let row = SavedRow { entries: vec![(0, 7)], open: 0, back: 0 };
            s.rows.push((s.trails[0].0, row));
        });
        refused(shooting, rows, "method", |s| s.course = SavedMethodState::Direct);
        // A shooter that is missing, and one that is there twice.
        for twice in [false, true] {
            refused(
                shooting,
                rows,
                "method",
                match twice {
                    false => |s| shooters(s).truncate(1),
                    true => |s| shooters(s).extend_from_within(..1),
                },
            );
        }
        refused(jacobi, rows, "method", |s| {
            s.course = SavedMethodState::Relaxation(Relaxation::gauss_seidel());
        });
        refused(jacobi, rows, "method", |s| {
            s.course = SavedMethodState::Relaxation(Relaxation::jacobi(1));
        });
        refused(gmres, rows, "method", |s| s.course = SavedMethodState::Gmres(Gmres::new(0)));
    }
}
