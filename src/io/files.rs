//! Source of the bytes of OBJ files, their libraries and textures, with limits of their size.
//!
//! A name in a file is searched below the folder of the OBJ file only: as written, with `/` for
//! `\`, then without its first folders one by one, down to the file name alone; each time with the
//! spelling given and then without regard to case.

use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};

use super::Input;
use crate::error::{Error, quoted};

/// Maximum number of bytes of an OBJ file, and of all its libraries together: a corner takes at
/// least two, so that 32 bits number the sides of all triangles.
pub(super) const MAX_BYTES: u64 = 1 << 30;

/// The files that an OBJ file and its libraries can name.
pub(super) struct FileSource<'a> {
    place: Place<'a>,
    /// Per folder read: names in lower case, and as spelled.
    listings: RefCell<HashMap<PathBuf, HashMap<String, String>>>,
    /// Results of earlier searches.
    found: RefCell<HashMap<String, Option<String>>>,
    lookups: Cell<usize>,
}

enum Place<'a> {
    Folder(&'a Path),
    /// Name and content of each file.
    Memory(&'a [(&'a str, &'a [u8])]),
}

impl<'a> FileSource<'a> {
    pub fn in_folder(folder: &'a Path) -> FileSource<'a> {
        FileSource::new(Place::Folder(folder))
    }

    pub fn in_memory(files: &'a [(&'a str, &'a [u8])]) -> FileSource<'a> {
        FileSource::new(Place::Memory(files))
    }

    fn new(place: Place<'a>) -> FileSource<'a> {
        let (listings, found) = Default::default();
        FileSource { place, listings, found, lookups: Cell::new(0) }
    }

    /// `name` with the folder before it.
    pub fn path(&self, name: &str) -> PathBuf {
        match self.place {
            Place::Folder(folder) => folder.join(name),
            Place::Memory(_) => name.into(),
        }
    }

    /// The file of this `name`, as a path from the scene's folder.
    pub fn find(&self, name: &str) -> Option<String> {
        // The length of a path on Linux.
        if name.len() > 4096 || name.contains('\0') {
            return None;
        }
        if let Some(found) = self.found.borrow().get(name) {
            return found.clone();
        }
        // A search takes some 10 µs: a file with a million names does not keep the disk busy.
        if self.lookups.replace(self.lookups.get() + 1) >= 10_000 {
            return None;
        }
        let found = self.look_for(name);
        self.found.borrow_mut().insert(name.into(), found.clone());
        found
    }

    fn look_for(&self, name: &str) -> Option<String> {
        if self.is_below(name) && self.is_file(name) {
            return plain(name).to_str().map(String::from);
        }
        let slashes = name.replace('\\', "/");
        let parts: Vec<&str> = slashes.split('/').filter(|p| !["", "."].contains(p)).collect();
        // The part up to the last `..` lies outside the folder.
        let inside = parts.iter().rposition(|&p| p == "..").map_or(0, |k| k + 1);
        let first = inside.max(parts.len().saturating_sub(8));
        (first..parts.len()).find_map(|k| self.spelled(&parts[k..]))
    }

    /// Whether `name` is a plain path from the folder down.
    fn is_below(&self, name: &str) -> bool {
        use Component::{CurDir, Normal};
        !name.is_empty() && Path::new(name).components().all(|c| matches!(c, Normal(_) | CurDir))
    }

    /// A file of this path, with this or other capitalisation.
    fn spelled(&self, parts: &[&str]) -> Option<String> {
        let path = parts.join("/");
        if !self.is_below(&path) {
            return None;
        }
        if self.is_file(&path) {
            return Some(path);
        }
        if let Place::Memory(files) = self.place {
            let same = |file: &&(&str, _)| file.0.to_lowercase() == path.to_lowercase();
            return files.iter().find(same).map(|file| file.0.into());
        }
        let mut found = PathBuf::new();
        for part in parts {
            let name = self.listed(&found, part)?;
            found.push(name);
        }
        let found = found.to_str()?.to_string();
        self.is_file(&found).then_some(found)
    }

    /// The entry of `folder` that equals `name` except for capitalisation.
    fn listed(&self, folder: &Path, name: &str) -> Option<String> {
        let mut listings = self.listings.borrow_mut();
        let names = listings.entry(folder.into()).or_insert_with(|| {
            let names = self.entries(folder).into_iter();
            names.map(|name| (name.to_lowercase(), name)).collect()
        });
        names.get(&name.to_lowercase()).cloned()
    }

    /// The names in `folder`, which lies in the scene's.
    fn entries(&self, folder: &Path) -> Vec<String> {
        let Place::Folder(root) = self.place else { return vec![] };
        let folder = root.join(folder);
        let folder = if folder == Path::new("") { Path::new(".") } else { &folder };
        let entries = fs::read_dir(folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect()
    }

    /// Whether there is a regular file of this name, and no link leads out of the folder.
    fn is_file(&self, name: &str) -> bool {
        match self.place {
            Place::Memory(files) => files.iter().any(|file| plain(file.0) == plain(name)),
            Place::Folder(folder) => {
                let path = folder.join(name);
                path.is_file() && is_inside(&path, folder)
            }
        }
    }

    /// The content of the existing file `name`, of at most `most` bytes.
    pub fn read(&self, name: &str, most: u64) -> io::Result<Vec<u8>> {
        match self.place {
            Place::Folder(_) => read_bytes(&self.path(name), most),
            Place::Memory(files) => {
                let named = |file: &&(&str, _)| plain(file.0) == plain(name);
                let file = files.iter().find(named).ok_or(ErrorKind::NotFound)?;
                limited(file.1, most).map(Vec::from)
            }
        }
    }

    /// The libraries in the folder, for messages.
    pub fn libraries(&self) -> String {
        let (place, mut names): (_, Vec<String>) = match self.place {
            Place::Folder(folder) => {
                let library = |name: &String| name.to_lowercase().ends_with(".mtl");
                let names = self.entries(Path::new("")).into_iter().filter(library).collect();
                let folder = if folder == Path::new("") { Path::new(".") } else { folder };
                (format!("the folder '{}'", folder.display()), names)
            }
            Place::Memory(files) => {
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

/// `path` in one spelling, whether or not it has folders `.`.
pub(super) fn plain(path: &str) -> PathBuf {
    Path::new(path).components().filter(|part| *part != Component::CurDir).collect()
}

/// Whether `path` lies in `folder` when all links are followed.
fn is_inside(path: &Path, folder: &Path) -> bool {
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    match (path.canonicalize(), folder.canonicalize()) {
        (Ok(path), Ok(folder)) => path.starts_with(folder),
        _ => false,
    }
}

/// The content of a regular file of at most `most` bytes.
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
    // Some files are longer than their metadata report, or grow.
    let mut bytes = Vec::with_capacity(about.len() as usize);
    File::open(path)?.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { Err(too_large(most)) } else { Ok(bytes) }
}

/// Whether a file of this name and content is to be glTF: binary, or a JSON text.
pub(super) fn is_gltf(path: &Path, bytes: &[u8]) -> bool {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let first = text.iter().find(|byte| !byte.is_ascii_whitespace());
    let extension = path.extension().unwrap_or_default();
    let is_named = ["glb", "gltf"].iter().any(|known| extension.eq_ignore_ascii_case(known));
    is_named || bytes.starts_with(b"glTF") || first == Some(&b'{')
}

/// `bytes`, if there are at most `most`.
pub(super) fn limited(bytes: &[u8], most: u64) -> io::Result<&[u8]> {
    if bytes.len() as u64 > most { Err(too_large(most)) } else { Ok(bytes) }
}

fn too_large(most: u64) -> io::Error {
    io::Error::new(ErrorKind::FileTooLarge, format!("it has more than {most} bytes"))
}

/// The text of a file of at most `most` bytes, in UTF-8, UTF-16 or Windows-1252, without a
/// byte-order mark.
///
/// # Errors
/// [`crate::ErrorKind::File`] when it cannot be read, or is larger.
pub fn read_text<'i>(file: impl Into<Input<'i>>, most: u64) -> Result<String, Error> {
    let (mut text, _) = decode(file.into().read(most, "give a text file")?.into_owned());
    if text.starts_with('\u{feff}') {
        text.drain(..'\u{feff}'.len_utf8());
    }
    Ok(text)
}

/// `bytes` as text, and the name of their encoding where that is not UTF-8: UTF-16 by its
/// byte-order mark or by its zeros, else Windows-1252, of which Latin-1 is a part.
pub(super) fn decode(bytes: Vec<u8>) -> (String, Option<&'static str>) {
    let marked = Encoding::for_bom(&bytes).map(|(encoding, _)| encoding);
    if let Some(utf_16) = marked.filter(|e| e.name() != "UTF-8").or_else(|| utf_16(&bytes)) {
        return (utf_16.decode_with_bom_removal(&bytes).0.into_owned(), Some(utf_16.name()));
    }
    match String::from_utf8(bytes) {
        Ok(text) => (text, None),
        Err(e) => {
            let text = WINDOWS_1252.decode_without_bom_handling(e.as_bytes()).0.into_owned();
            (text, Some(WINDOWS_1252.name()))
        }
    }
}

/// UTF-16 without a byte-order mark: at least three in four of the first 256 byte pairs have a
/// zero, always at the same end, as Latin letters do.
fn utf_16(bytes: &[u8]) -> Option<&'static Encoding> {
    let pairs = || bytes.chunks_exact(2).take(256);
    let most = |zero: usize| {
        let latin = pairs().filter(|pair| pair[zero] == 0 && pair[1 - zero] != 0).count();
        latin > 0 && 4 * latin >= 3 * pairs().count()
    };
    if most(0) {
        Some(UTF_16BE)
    } else if most(1) {
        Some(UTF_16LE)
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_decoded() {
        let text = "v 0 0 0\ng b\u{e9}ton\n";
        let be: Vec<u8> = text.encode_utf16().flat_map(u16::to_be_bytes).collect();
        let le: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let latin: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let with = |mark: &[u8], bytes: &[u8]| [mark, bytes].concat();
        for (bytes, name) in [
            (text.as_bytes().to_vec(), None),
            (with(&[0xfe, 0xff], &be), Some("UTF-16BE")),
            (with(&[0xff, 0xfe], &le), Some("UTF-16LE")),
            (be, Some("UTF-16BE")),
            (le, Some("UTF-16LE")),
            (latin, Some("windows-1252")),
        ] {
            assert_eq!(decode(bytes), (text.to_string(), name));
        }
        assert_eq!(decode(vec![0; 9]), ("\0".repeat(9), None));
    }
}
