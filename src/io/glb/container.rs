//! The container of a glTF binary file: a header, a chunk of JSON and one of numbers.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use gltf_json::Root;

use crate::error::Error;
use crate::io::{cannot_write, write_file};

/// Writes `document` and then `binary` bytes of numbers, a multiple of four, by `write_binary`.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
pub(super) fn write(
    path: &Path,
    document: &Root,
    binary: u64,
    write_binary: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let mut json = document.to_vec().map_err(|e| cannot_write(path, e))?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let total = 12 + 8 + json.len() as u64 + 8 + binary;
    let Ok(total) = u32::try_from(total) else {
        let found = format!("{total} bytes, where glTF binary has room for 4 GiB");
        return Err(cannot_write(path, io::Error::new(io::ErrorKind::FileTooLarge, found)));
    };
    write_file(path, |out| {
        let kind = u32::from_le_bytes;
        for word in [kind(*b"glTF"), 2, total, json.len() as u32, kind(*b"JSON")] {
            out.write_all(&word.to_le_bytes())?;
        }
        out.write_all(&json)?;
        for word in [binary as u32, kind(*b"BIN\0")] {
            out.write_all(&word.to_le_bytes())?;
        }
        write_binary(out)
    })
}
