//! Where the text of OBJ and MTL files comes from, and how much of it may come.

use std::borrow::Cow;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

use crate::error::quoted;

/// Bytes that an OBJ file may have, and all its libraries together: a corner takes at least two, so
/// the sides of all triangles can be numbered in 32 bits.
pub(super) const MAX_BYTES: u64 = 1 << 30;

/// The files that `mtllib` lines can name, from the folder of the OBJ file.
pub(super) enum LibrarySource<'a> {
    Folder(&'a Path),
    /// Name and content of each.
    Memory(&'a [(&'a str, &'a [u8])]),
}

impl LibrarySource<'_> {
    /// `name` with the folder before it.
    pub fn path(&self, name: &str) -> PathBuf {
        match self {
            LibrarySource::Folder(folder) => folder.join(name),
            LibrarySource::Memory(_) => name.into(),
        }
    }

    /// The content of file `name`, of at most `most` bytes, if it is in the folder or below.
    pub fn read(&self, name: &str, most: u64) -> io::Result<String> {
        let below = |c| matches!(c, Component::Normal(_) | Component::CurDir);
        if !Path::new(name).components().all(below) {
            let found = "it is not in the folder of the OBJ file, nor below";
            return Err(io::Error::new(ErrorKind::PermissionDenied, found));
        }
        match self {
            LibrarySource::Folder(_) => read(&self.path(name), most),
            LibrarySource::Memory(files) => {
                let named = |file: &&(&str, _)| Path::new(file.0) == Path::new(name);
                let file = files.iter().find(named).ok_or(ErrorKind::NotFound)?;
                limited(file.1.into(), most)
            }
        }
    }

    /// Which libraries there are.
    pub fn libraries(&self) -> String {
        let (place, mut names): (_, Vec<String>) = match self {
            LibrarySource::Folder(folder) => {
                let folder = if *folder == Path::new("") { Path::new(".") } else { folder };
                let files = fs::read_dir(folder).into_iter().flatten().flatten();
                let libraries = files
                    .map(|entry| entry.path())
                    .filter(|file| file.extension().is_some_and(|e| e.eq_ignore_ascii_case("mtl")));
                let name = |f: PathBuf| Some(f.file_name()?.to_string_lossy().into_owned());
                (format!("the folder '{}'", folder.display()), libraries.filter_map(name).collect())
            }
            LibrarySource::Memory(files) => {
                ("what was given".into(), files.iter().map(|file| file.0.into()).collect())
            }
        };
        names.sort();
        match names.len() {
            0 => format!("{place} has no .mtl file"),
            _ => format!("{place} has {}", quoted(&names)),
        }
    }
}

/// The text of a regular file of at most `most` bytes; bytes that are not UTF-8 become U+FFFD.
pub(super) fn read(path: &Path, most: u64) -> io::Result<String> {
    limited(read_bytes(path, most)?.into(), most)
}

/// The whole of a regular file of at most `most` bytes.
pub(super) fn read_bytes(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let about = fs::metadata(path)?;
    if about.is_dir() {
        return Err(io::Error::new(ErrorKind::IsADirectory, "it is a folder"));
    }
    if !about.is_file() {
        // A pipe or a device might never end.
        return Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"));
    }
    if about.len() > most {
        return Err(too_large(most));
    }
    // Some files are longer than they say, or grow.
    let mut bytes = Vec::with_capacity(about.len() as usize);
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(most)) } else { Ok(bytes) }
}

/// `bytes` as text, if they are not too many.
pub(super) fn limited(bytes: Cow<[u8]>, most: u64) -> io::Result<String> {
    if bytes.len() as u64 > most {
        return Err(too_large(most));
    }
    let lossy = |e: std::string::FromUtf8Error| String::from_utf8_lossy(e.as_bytes()).into_owned();
    Ok(String::from_utf8(bytes.into_owned()).unwrap_or_else(lossy))
}

fn too_large(most: u64) -> io::Error {
    io::Error::new(ErrorKind::FileTooLarge, format!("it has more than {most} bytes"))
}
