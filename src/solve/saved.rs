//! A solve as a file: written between batches, read again, the same bits.
//!
//! The file is a few words of magic, a postcard message and its checksum. It names the mesh by a
//! fingerprint and the settings in words, and goes on with no others. Rows are not in it but for
//! those that cannot be made again; what else was kept is made again when it is asked for, as it was.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::gmres::Gmres;
use super::relaxation::Relaxation;
use super::rows::Trail;
use super::shooters::{Cut, Shooters};
use super::state::State;
use super::under_way::{Course, Done, Solve};
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
    done: Done,
    made: u64,
    free: u64,
    ledger: Ledger,
    incident: Vec<Rgb>,
    unshot: Vec<Rgb>,
    trails: Vec<(NodeId, Trail)>,
    rows: Vec<(NodeId, SavedRow)>,
    course: SavedCourse,
}

#[derive(Serialize, Deserialize)]
struct SavedRow {
    entries: Vec<(u32, u32)>,
    open: u32,
    back: u32,
}

#[derive(Serialize, Deserialize)]
enum SavedCourse {
    Shooting(Cut),
    Relaxation(Relaxation),
    Gmres(Gmres),
    Direct,
}

impl Solve<'_> {
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

    /// What [`Solve::save`] writes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let Solve { solver, state, rows, course, done, made_by, .. } = self;
        let name =
            Name { mesh: state.mesh.fingerprint(), method: method(solver), rows: made_by.clone() };
        let trails: Vec<(NodeId, Trail)> = rows.trails.iter().map(|(&p, &t)| (p, t)).collect();
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
                Course::Shooting(shooters) => SavedCourse::Shooting(shooters.cut()),
                Course::Relaxation(relaxation) => SavedCourse::Relaxation(relaxation.clone()),
                Course::Gmres(gmres) => SavedCourse::Gmres(gmres.clone()),
                Course::Direct => SavedCourse::Direct,
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

/// What must be the same for a solve to go on, in words. Stop rules may differ.
fn method(solver: &Solver) -> String {
    format!("{:?}", solver.method)
}

impl Solver {
    /// The solve that [`Solve::save`] wrote to `path`, to go on over `mesh` with rows from
    /// `form_factors`: it ends with the same bits as if it had not been interrupted. Stop rules and
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
    ) -> Result<Solve<'m>, Error> {
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
    ) -> Result<Solve<'m>, Error> {
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
        same("method", &name.method, &method(self))?;
        same("rows", &name.rows, &form_factors.settings())?;
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
    fn restore<'m>(self, fresh: Solve<'m>, made_by: String) -> Result<Solve<'m>, Error> {
        let Saved { done, made, free, ledger, incident, unshot, trails, rows: old, course } = self;
        let Solve { solver, state, mut rows, .. } = fresh;
        let mesh = state.mesh;
        let count = mesh.element_count();
        let all = |flux: &[Rgb]| flux.len() == count && flux.iter().all(|w| w.is_finite());
        if !all(&incident) || !all(&unshot) {
            let found = format!("flux of {} and {} elements", incident.len(), unshot.len());
            return Err(bad("flux", found, &format!("must be {count} finite triples each")));
        }
        let Ledger { emitted, absorbed, left, back, unshot: rest, overshot } = ledger;
        let finite = [absorbed, left, back, rest, overshot].iter().all(|w| w.is_finite());
        if emitted != state.ledger.emitted || !finite {
            let found = format!("{ledger:?}");
            return Err(bad("ledger", found, &format!("must be of {} W", state.ledger.emitted)));
        }
        let mut state = State { ledger, ..state };
        state.flux.incident = incident;
        state.flux.unshot = unshot;
        let whole = |t: &Trail| {
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
            (SavedCourse::Shooting(cut), Method::Shooting { tolerance, level, .. }) => {
                let shooters = Shooters::from_cut(mesh, tolerance, level, cut);
                Course::Shooting(shooters.ok_or_else(unfit)?)
            }
            (SavedCourse::Relaxation(relaxation), Method::Jacobi)
                if relaxation.fits(count, true) =>
            {
                Course::Relaxation(relaxation)
            }
            (SavedCourse::Relaxation(relaxation), Method::GaussSeidel)
                if relaxation.fits(count, false) =>
            {
                Course::Relaxation(relaxation)
            }
            (SavedCourse::Gmres(gmres), Method::Gmres { .. }) if gmres.fits(count) => {
                Course::Gmres(gmres)
            }
            (SavedCourse::Direct, Method::Direct) => Course::Direct,
            _ => return Err(unfit()),
        };
        let solve = Solve { solver, state, rows, course, done, stop: None, made_by };
        // What is in hand is accounted for only once it is handed back.
        solve.clone().finish().map_err(|e| bad("ledger", e.to_string(), REMEDY))?;
        Ok(solve)
    }
}

impl SavedRow {
    fn of(row: &Row) -> SavedRow {
        let entries = row.entries.iter().map(|e| (e.element, e.share)).collect();
        SavedRow { entries, open: row.open, back: row.back }
    }

    fn row(self) -> Row {
        let entry = |(element, share)| Entry { element, share };
        let SavedRow { entries, open, back } = self;
        Row { entries: entries.into_iter().map(entry).collect(), open, back }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::ray_cast::RayCast;
    use crate::solve::Go;
    use crate::solve::shooters::Shooter;

    fn shooters(saved: &mut Saved) -> &mut Vec<Shooter> {
        match &mut saved.course {
            SavedCourse::Shooting(cut) => &mut cut.shooters,
            _ => panic!("saved while shooting"),
        }
    }

    /// A state with a checksum that is right and one thing in it that cannot be is refused.
    #[test]
    fn states_that_cannot_be_are_refused() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
        let mesh = Mesh::new(crate::load_obj(path).unwrap(), 300.0).unwrap();
        let mut rows = RayCast::new(&mesh, 64).unwrap();
        let [shooting, _, jacobi, _, gmres, _] = Method::ALL.map(Solver::new);
        let refused = |solver: Solver, rows: &mut RayCast, what: &str, damage: fn(&mut Saved)| {
            let mut solve = solver.begin(&mesh).unwrap();
            for _ in 0..3 {
                solve.advance(rows, |_| Go::Continue(())).unwrap();
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
        refused(shooting, rows, "patches", |s| s.trails.push((NodeId(1 << 30), Trail::default())));
        refused(shooting, rows, "rows", |s| {
            let row = SavedRow { entries: vec![(0, 7)], open: 0, back: 0 };
            s.rows.push((s.trails[0].0, row));
        });
        refused(shooting, rows, "method", |s| s.course = SavedCourse::Direct);
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
            s.course = SavedCourse::Relaxation(Relaxation::gauss_seidel());
        });
        refused(jacobi, rows, "method", |s| {
            s.course = SavedCourse::Relaxation(Relaxation::jacobi(1));
        });
        refused(gmres, rows, "method", |s| s.course = SavedCourse::Gmres(Gmres::new(0)));
    }
}
