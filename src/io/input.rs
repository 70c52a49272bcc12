//! Where files are read.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};

use super::files::{self, FileSource};
use crate::error::{Error, ErrorKind};

/// What is read: the file at a path, or bytes under a name.
///
/// ```
/// use radiosity::{io::Input, load_scene};
///
/// # fn main() -> Result<(), radiosity::Error> {
/// let square = b"mtllib it.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl white\nf 1 2 3\n";
/// let library = b"newmtl white\nKd 0.7 0.7 0.7\n";
/// let files = [("it.mtl", library.as_slice())];
/// let scene = load_scene(Input::bytes("it.obj", square).with_files(&files))?;
/// assert_eq!(scene.triangles().len(), 1); // or load_scene("it.obj")
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Input<'a> {
    path: Cow<'a, Path>,
    memory: Option<Memory<'a>>,
}

/// Content of the file, and name and content of those that it can name.
#[derive(Clone, Copy, Debug)]
struct Memory<'a> {
    content: &'a [u8],
    files: &'a [(&'a str, &'a [u8])],
}

/// Bytes that can be read in any order.
#[cfg(any(feature = "glb", feature = "npz"))]
pub(super) trait ReadSeek: io::Read + io::Seek {}

#[cfg(any(feature = "glb", feature = "npz"))]
impl<R: io::Read + io::Seek> ReadSeek for R {}

impl<'a> Input<'a> {
    /// This `content`, under a `name` for messages, whose ending can say the format.
    pub fn bytes(name: &'a (impl AsRef<Path> + ?Sized), content: &'a [u8]) -> Input<'a> {
        let path = Cow::Borrowed(name.as_ref());
        Input { path, memory: Some(Memory { content, files: &[] }) }
    }

    /// The same, with the files that it can name: name and content. Those beside a path are read
    /// from its folder, whatever is given here.
    pub fn with_files(mut self, files: &'a [(&'a str, &'a [u8])]) -> Input<'a> {
        self.memory = self.memory.map(|memory| Memory { files, ..memory });
        self
    }

    /// The path, or the name.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The content, of at most `most` bytes; `remedy` says what should have been given.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when it cannot be read, or is larger.
    pub(super) fn read(&self, most: u64, remedy: &str) -> Result<Cow<'a, [u8]>, Error> {
        let content = match self.memory {
            None => files::read_bytes(&self.path, most).map(Cow::Owned),
            Some(Memory { content, .. }) => files::limited(content, most).map(Cow::Borrowed),
        };
        content.map_err(|e| self.cannot_read(e, remedy))
    }

    /// The content from its beginning, of any length.
    ///
    /// # Errors
    /// [`ErrorKind::File`] when it cannot be read.
    #[cfg(any(feature = "glb", feature = "npz"))]
    pub(super) fn open(&self, remedy: &str) -> Result<Box<dyn ReadSeek + 'a>, Error> {
        match self.memory {
            None => {
                let file = std::fs::File::open(&self.path);
                let file = file.map_err(|e| self.cannot_read(e, remedy))?;
                Ok(Box::new(io::BufReader::new(file)))
            }
            Some(Memory { content, .. }) => Ok(Box::new(io::Cursor::new(content))),
        }
    }

    /// The files that it can name.
    pub(super) fn files(&self) -> FileSource<'_> {
        match self.memory {
            None => FileSource::in_folder(self.path.parent().unwrap_or(Path::new(""))),
            Some(Memory { files, .. }) => FileSource::in_memory(files),
        }
    }

    /// The error for content that cannot be read.
    pub(super) fn cannot_read(&self, e: io::Error, remedy: &str) -> Error {
        let (place, found) = (self.path.display().to_string(), format!("cannot be read: {e}"));
        Error::new(ErrorKind::File, place, found, remedy).with_source(e)
    }
}

impl<'a, P: AsRef<Path> + ?Sized> From<&'a P> for Input<'a> {
    fn from(path: &'a P) -> Input<'a> {
        Input { path: Cow::Borrowed(path.as_ref()), memory: None }
    }
}

impl From<PathBuf> for Input<'_> {
    fn from(path: PathBuf) -> Self {
        Input { path: Cow::Owned(path), memory: None }
    }
}

impl From<String> for Input<'_> {
    fn from(path: String) -> Self {
        PathBuf::from(path).into()
    }
}
