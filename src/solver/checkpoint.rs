//! A session as a file: written between batches, read again, the same bits.
//!
//! ```text
//! 7 bytes "radiosi", 1 byte version      MAGIC
//! fingerprint of the mesh, text of the method, fingerprint of the row source   Identity   postcard
//! the session                            SavedSession                                     postcard
//! 8 bytes XXH3-64 of all the above       little-endian
//! ```
//!
//! A file is resumed only with a mesh, a method and a row source of the same identity. The file
//! holds only those rows that cannot be computed again; other cached rows are rebuilt identically
//! on demand.

use std::path::Path;
use std::{fs, io};

use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::method::saved_identity;
use super::saved_state::{DAMAGED, SavedSession, refuse};
use super::{SolveSession, Solver};
use crate::error::{Error, ErrorKind};
use crate::form_factor::FormFactors;
use crate::mesh::Mesh;
use crate::whole_file;

/// Begins every file; the last byte is the version.
const MAGIC: &[u8; 8] = b"radiosi\x02";

/// Data that must be equal for a session to be resumed. Stop rules may differ.
#[derive(Serialize, Deserialize)]
struct Identity {
    /// [`Mesh::fingerprint`].
    mesh: u64,
    /// [`saved_identity`].
    method: String,
    /// [`FormFactors::fingerprint`].
    row_source: String,
}

impl SolveSession<'_> {
    /// Writes the state to `path` for [`Solver::resume`]. If the write is interrupted, the file is
    /// either the old or the complete new one.
    ///
    /// Size: 48 bytes per element, about 40 per patch that has shot, and the intermediate state of
    /// the method: with GMRES 48 bytes per element for each product of the cycle.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let remedy = "choose a folder that can be written to and has room";
        let written = whole_file::replace(path, |out| out.write_all(&self.to_bytes()));
        written.map_err(file_error(path, remedy))
    }

    /// The bytes that [`SolveSession::save`] writes.
    ///
    /// # Panics
    /// Never: serialization to a vector cannot fail.
    pub fn to_bytes(&self) -> Vec<u8> {
        let identity = Identity {
            mesh: self.mesh().fingerprint(),
            method: saved_identity(&self.solver),
            row_source: self.row_source.clone(),
        };
        let content = (identity, SavedSession::of(self));
        let mut bytes =
            postcard::to_extend(&content, MAGIC.to_vec()).expect("a vector takes all bytes");
        bytes.extend(xxh3_64(&bytes).to_le_bytes());
        bytes
    }
}

impl Solver {
    /// Resumes the session that [`SolveSession::save`] wrote to `path`, over `mesh` with rows from
    /// `form_factors`: the result has the same bits as without the interruption. Stop rules and
    /// memory for rows may differ.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when the file cannot be read, is damaged, or was written for another
    /// mesh, method or row source; the errors of [`Solver::begin`].
    pub fn resume<'m>(
        &self,
        mesh: &'m Mesh,
        form_factors: &dyn FormFactors,
        path: impl AsRef<Path>,
    ) -> Result<SolveSession<'m>, Error> {
        let path = path.as_ref();
        let bytes = fs::read(path).map_err(file_error(path, "name a file that can be read"))?;
        let session = self.begin(mesh)?;
        self.restore_bytes(session, form_factors, &bytes).map_err(|e| e.inside(path))
    }

    /// As [`Solver::resume`], from bytes.
    ///
    /// # Errors
    /// Those of [`Solver::resume`].
    pub fn resume_bytes<'m>(
        &self,
        mesh: &'m Mesh,
        form_factors: &dyn FormFactors,
        bytes: &[u8],
    ) -> Result<SolveSession<'m>, Error> {
        self.restore_bytes(self.begin(mesh)?, form_factors, bytes)
    }

    /// Restores the state in `bytes` to `session`, which has just begun.
    fn restore_bytes<'m>(
        &self,
        session: SolveSession<'m>,
        form_factors: &dyn FormFactors,
        bytes: &[u8],
    ) -> Result<SolveSession<'m>, Error> {
        let mesh = session.mesh();
        let content = verified_content(bytes)?;
        let (identity, content) = take_from::<Identity>(content)?;
        let hex = |mesh: u64| format!("{mesh:016x}");
        check_same("fingerprint of the mesh", &hex(identity.mesh), &hex(mesh.fingerprint()))?;
        check_same("method", &identity.method, &saved_identity(self))?;
        check_same("rows", &identity.row_source, &form_factors.fingerprint())?;
        let (saved, content) = take_from::<SavedSession>(content)?;
        if !content.is_empty() {
            let found = format!("{} bytes too many", content.len());
            return Err(refuse("content", found, DAMAGED));
        }
        saved.restore(session, identity.row_source)
    }
}

/// Errors of the file at `path`.
fn file_error(path: &Path, remedy: &str) -> impl FnOnce(io::Error) -> Error {
    move |e| {
        let place = path.display().to_string();
        Error::new(ErrorKind::File, place, e.to_string(), remedy).with_source(e)
    }
}

/// The bytes between header and checksum, if both are valid.
fn verified_content(bytes: &[u8]) -> Result<&[u8], Error> {
    let Some(body) = bytes.strip_prefix(MAGIC) else {
        let found = format!("the first bytes are {:x?}", &bytes[..bytes.len().min(MAGIC.len())]);
        return Err(refuse("header", found, "give a state that this version has saved"));
    };
    let Some((content, sum)) = body.split_last_chunk() else {
        return Err(refuse("end of file", "no checksum", DAMAGED));
    };
    if xxh3_64(&bytes[..bytes.len() - sum.len()]) != u64::from_le_bytes(*sum) {
        return Err(refuse("end of file", "a checksum that is not that of the file", DAMAGED));
    }
    Ok(content)
}

/// Reads a `T` from the beginning of `bytes`; returns it and the remaining bytes.
fn take_from<'b, T: Deserialize<'b>>(bytes: &'b [u8]) -> Result<(T, &'b [u8]), Error> {
    postcard::take_from_bytes(bytes).map_err(|e| refuse("content", e.to_string(), DAMAGED))
}

fn check_same(what: &str, saved: &str, now: &str) -> Result<(), Error> {
    if saved == now {
        Ok(())
    } else {
        Err(refuse(what, format!("'{saved}'"), &format!("here it is '{now}'")))
    }
}
