//! CSV out: the matrix of view factors.

use std::io::Write;
use std::path::Path;

use super::write_file;
use crate::error::Error;
use crate::view_factors::ViewFactors;

/// Writes the matrix as CSV: a header row and a first column of names, row leaves, column receives;
/// then `open`, what leaves the scene, and `back`, what meets the backs of surfaces.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_view_factors(path: impl AsRef<Path>, matrix: &ViewFactors) -> Result<(), Error> {
    write_file(path.as_ref(), |out| {
        let names: Vec<String> = matrix.names.iter().map(|n| quoted(n)).collect();
        writeln!(out, "from,{},open,back", names.join(","))?;
        for (i, name) in names.iter().enumerate() {
            write!(out, "{name}")?;
            for factor in matrix.factors[i].iter().chain([&matrix.open[i], &matrix.back[i]]) {
                write!(out, ",{factor:.9}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    })
}

/// A CSV field (RFC 4180): quoted where a comma, quote or line break is in it.
fn quoted(name: &str) -> String {
    match name.contains([',', '"', '\n', '\r']) {
        true => format!("\"{}\"", name.replace('"', "\"\"")),
        false => name.to_string(),
    }
}
