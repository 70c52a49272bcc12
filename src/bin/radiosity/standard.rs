//! `-` in the place of a file: standard input and output.

use std::fmt::Arguments;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use radiosity::io::Input;
use radiosity::work::{alone, from_first, is_first};
use radiosity::{Error, ErrorKind};

use crate::progress;

/// Content of standard input, and the name that says its format.
static INPUT: OnceLock<(PathBuf, Vec<u8>)> = OnceLock::new();

/// Whether standard output has a file, so that messages go elsewhere.
static HAS_FILE: AtomicBool = AtomicBool::new(false);

/// Whether `path` is the standard stream.
pub fn is_dash(path: &Path) -> bool {
    path == Path::new("-")
}

/// The scene file at `path`, or of standard input, which is read once.
///
/// # Errors
/// [`ErrorKind::File`] if standard input cannot be read.
pub fn input(path: &Path) -> Result<Input<'_>, Error> {
    if !is_dash(path) {
        return Ok(path.into());
    }
    if INPUT.get().is_none() {
        let read = from_first(|| {
            let mut content = vec![];
            let read = std::io::stdin().lock().read_to_end(&mut content);
            read.map(|_| content).map_err(|error| {
                let remedy = "send an OBJ, STL or GLB file to it";
                Error::new(ErrorKind::File, "standard input", error.to_string(), remedy)
            })
        });
        let content = read?;
        let name = if is_stl(&content) { "standard input.stl" } else { "standard input" };
        _ = INPUT.set((name.into(), content));
    }
    let (name, content) = INPUT.get().expect("it was set");
    Ok(Input::bytes(name, content))
}

/// Whether `content` is an STL file: text that begins as such, or as many triangles as it says.
fn is_stl(content: &[u8]) -> bool {
    let count = content.get(80..84).and_then(|bytes| bytes.try_into().ok());
    let count = count.map_or(0, u32::from_le_bytes);
    content.starts_with(b"solid") || content.len() as u64 == 84 + 50 * u64::from(count)
}

/// The path of the scene without its ending.
pub fn stem(scene: &Path) -> PathBuf {
    if is_dash(scene) { "stdin".into() } else { scene.with_extension("") }
}

/// Keeps standard output for a file.
pub fn keep_for_file() {
    HAS_FILE.store(true, Ordering::Relaxed);
}

/// Writes a file to standard output, in the first of several processes.
pub fn write(write: impl FnOnce(&mut std::io::StdoutLock) -> Result<(), Error>) {
    if is_first()
        && let Err(error) = alone(|| write(&mut std::io::stdout().lock()))
    {
        progress::add_unwritten(&error);
    }
}

/// Prints a line, also where nobody reads on, as behind `| head`: `println!` panics there.
pub fn say(line: Arguments) {
    _ = match HAS_FILE.load(Ordering::Relaxed) {
        true => writeln!(std::io::stderr(), "{line}"),
        false => writeln!(std::io::stdout(), "{line}"),
    };
}
