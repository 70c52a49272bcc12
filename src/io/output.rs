//! Where files are written.

use std::borrow::Cow;
use std::fmt::{self, Debug, Formatter};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::{Error, ErrorKind};
use crate::whole_file;

/// Where a file is written: a path, or any writer, such as a vector of bytes.
///
/// ```
/// # fn main() -> Result<(), radiosity::Error> {
/// # let surface = radiosity::VertexMesh::default();
/// let mut bytes = vec![];
/// radiosity::write_ply(&mut bytes, &surface)?; // or write_ply("scene.ply", &surface)
/// assert!(bytes.starts_with(b"ply"));
/// # Ok(())
/// # }
/// ```
pub struct Output<'a>(Target<'a>);

enum Target<'a> {
    Path(Cow<'a, Path>),
    Writer(&'a mut dyn Write),
}

impl<'a, P: AsRef<Path> + ?Sized> From<&'a P> for Output<'a> {
    fn from(path: &'a P) -> Output<'a> {
        Output(Target::Path(Cow::Borrowed(path.as_ref())))
    }
}

impl From<PathBuf> for Output<'_> {
    fn from(path: PathBuf) -> Self {
        Output(Target::Path(Cow::Owned(path)))
    }
}

impl From<String> for Output<'_> {
    fn from(path: String) -> Self {
        PathBuf::from(path).into()
    }
}

impl<'a, W: Write> From<&'a mut W> for Output<'a> {
    fn from(writer: &'a mut W) -> Output<'a> {
        Output(Target::Writer(writer))
    }
}

impl Debug for Output<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_tuple("Output").field(&self.name()).finish()
    }
}

impl Output<'_> {
    /// The path, or what stands for it in messages.
    pub(super) fn name(&self) -> String {
        match &self.0 {
            Target::Path(path) => path.display().to_string(),
            Target::Writer(_) => "the writer".into(),
        }
    }

    /// Passes the file to `write`, or the writer. A file is written beside its path, and renamed
    /// once the disk has all of it: any failure leaves the one that was there.
    ///
    /// # Errors
    /// [`ErrorKind::File`], which names it, when it cannot be written.
    pub fn write(
        mut self,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), Error> {
        let written = match &mut self.0 {
            Target::Path(path) => whole_file::replace(path, write),
            Target::Writer(writer) => write(writer).and_then(|()| writer.flush()),
        };
        written.map_err(|e| self.cannot_write(e))
    }

    /// Writes all `bytes`: [`Output::write`].
    ///
    /// # Errors
    /// Those of [`Output::write`].
    pub fn write_bytes(self, bytes: &[u8]) -> Result<(), Error> {
        self.write(|out| out.write_all(bytes))
    }

    /// The error for content that cannot be written.
    pub(super) fn cannot_write(
        &self,
        e: impl Into<Box<dyn std::error::Error + Send + Sync>>,
    ) -> Error {
        let e = e.into();
        let found = format!("cannot be written: {e}");
        let remedy = match self.0 {
            Target::Path(_) => "choose a folder that exists, can be written and has room",
            Target::Writer(_) => "give a writer that takes all bytes",
        };
        Error::new(ErrorKind::File, self.name(), found, remedy).with_source(e)
    }
}
