//! Files of view factors: output of tables, input and output of finished rows.
//!
//! | function | file | zeros | errors |
//! |---|---|---|---|
//! | [`write_csv_matrix`] | CSV, one row per group: for spreadsheets | `0` | no |
//! | [`write_csv_list`] | CSV, one line per nonzero | left out | yes |
//! | [`write_matrix_market`] | Matrix Market, one line per nonzero | left out | no |
//! | [`write_rows`], [`read_rows`] | some of the rows, for resuming only | left out | yes |
//!
//! In all of them the emitting group comes first: rows emit, columns receive. Areas are in the
//! scene's length unit squared, factors are dimensionless. `open`, `back` and `area` are in
//! parentheses where a group is called so ([`ViewFactors::column_name`]).

use std::path::Path;

use super::{Input, Output};
use crate::error::Error;
use crate::view_factor::{Estimate, Missing, PartialMatrix, ViewFactors};

/// Writes the matrix as CSV: a header row and a first column of names, rows emit, columns receive;
/// then `open`, the fraction that leaves the scene, `back`, the fraction that hits backs of
/// surfaces, and the `area` of each row's group. Values have nine decimals; below 1e-5, five
/// digits. Zero is `0`; pairs not seen by any pixel or ray are left empty.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_csv_matrix<'o>(out: impl Into<Output<'o>>, matrix: &ViewFactors) -> Result<(), Error> {
    out.into().write(|out| {
        let names: Vec<String> = matrix.names.iter().map(|n| quoted(n)).collect();
        let own = ["open", "back", "area"].map(|name| matrix.column_name(name)).join(",");
        writeln!(out, "F from row to column,{},{own}", names.join(","))?;
        for (i, name) in names.iter().enumerate() {
            write!(out, "{name}")?;
            let mut row = matrix.factors[i].iter().peekable();
            for j in 0..names.len() as u32 {
                match row.next_if(|f| f.to == j) {
                    Some(f) => write!(out, ",{}", rounded(f.value).0)?,
                    None if matrix.absent == Missing::Zero => write!(out, ",0")?,
                    None => write!(out, ",")?,
                }
            }
            let [open, back] = [&matrix.open[i], &matrix.back[i]].map(|e| rounded(e.value).0);
            writeln!(out, ",{open},{back},{}", matrix.areas[i])?;
        }
        Ok(())
    })
}

/// Writes every nonzero as a line of CSV with its standard error, rounding of the printed value
/// included: for matrices with many zeros, and for errors. After the groups that a group sees come
/// `open`, the fraction that leaves the scene, and `back`, the fraction that hits backs of
/// surfaces.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_csv_list<'o>(out: impl Into<Output<'o>>, matrix: &ViewFactors) -> Result<(), Error> {
    out.into().write(|out| {
        let names: Vec<String> = matrix.names.iter().map(|n| quoted(n)).collect();
        let [open, back] = ["open", "back"].map(|name| matrix.column_name(name));
        writeln!(out, "from,to,factor,standard_error,from_area,to_area")?;
        for (i, name) in names.iter().enumerate() {
            let area = matrix.areas[i];
            for f in &matrix.factors[i] {
                let (to, other) = (&names[f.to as usize], matrix.areas[f.to as usize]);
                let factor = with_error(Estimate { value: f.value, error: f.error });
                writeln!(out, "{name},{to},{factor},{area},{other}")?;
            }
            for (to, share) in [(&open, matrix.open[i]), (&back, matrix.back[i])] {
                writeln!(out, "{name},{to},{},{area},", with_error(share))?;
            }
        }
        Ok(())
    })
}

/// Writes finished rows, for [`read_rows`]. If interrupted, the file has either its old or its new
/// content.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_rows(path: impl AsRef<Path>, rows: &PartialMatrix) -> Result<(), Error> {
    let path = path.as_ref();
    let temporary = path.with_added_extension("new");
    Output::from(&temporary).write_bytes(&rows.to_bytes())?;
    std::fs::rename(&temporary, path).map_err(|e| Output::from(path).cannot_write(e))
}

/// Reads rows written by [`write_rows`].
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be read, has another format, or is damaged.
pub fn read_rows<'i>(file: impl Into<Input<'i>>) -> Result<PartialMatrix, Error> {
    let file = file.into();
    let bytes = file.read(u64::MAX, "give a readable file")?;
    PartialMatrix::from_bytes(&bytes).map_err(|e| e.inside(file.path()))
}

/// Writes the nonzeros in Matrix Market's coordinate format (R. F. Boisvert, R. Pozo,
/// K. A. Remington, NISTIR 5935, 1996), rows emit and columns receive, both counted from 1; names,
/// areas, `open` and `back` of the groups are in comments.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written.
pub fn write_matrix_market<'o>(
    out: impl Into<Output<'o>>,
    matrix: &ViewFactors,
) -> Result<(), Error> {
    out.into().write(|out| {
        let n = matrix.names.len();
        writeln!(out, "%%MatrixMarket matrix coordinate real general")?;
        writeln!(
            out,
            "% view factors: entry (i, j) is the share of the flux leaving group i (row)"
        )?;
        writeln!(
            out,
            "% that arrives at group j (column); what is absent is {}",
            match matrix.absent {
                Missing::Zero => "zero",
                Missing::Unmet => "not seen, zero or small",
            }
        )?;
        writeln!(out, "% group area open back name")?;
        for (i, name) in matrix.names.iter().enumerate() {
            let (open, back) = (matrix.open[i].value, matrix.back[i].value);
            writeln!(
                out,
                "% {} {:e} {open:e} {back:e} {}",
                i + 1,
                matrix.areas[i],
                one_line(name)
            )?;
        }
        let count: usize = matrix.factors.iter().map(Vec::len).sum();
        writeln!(out, "{n} {n} {count}")?;
        for (i, row) in matrix.factors.iter().enumerate() {
            for f in row {
                writeln!(out, "{} {} {:e}", i + 1, f.to + 1, f.value)?;
            }
        }
        Ok(())
    })
}

/// A value with nine decimals, or five digits if it is small, and the unit of its last digit.
fn rounded(value: f64) -> (String, f64) {
    if value.abs() >= 1e-5 || value == 0.0 {
        return (format!("{value:.9}"), 1e-9);
    }
    (format!("{value:.4e}"), 1e-4 * libm::pow(10f64, libm::log10(value.abs()).floor()))
}

/// A value and its error with that of rounding: a uniform distribution over one unit of the last
/// digit.
fn with_error(Estimate { value, error }: Estimate) -> String {
    let (text, unit) = rounded(value);
    format!("{text},{:.2e}", libm::hypot(error, unit / 12f64.sqrt()))
}

/// A CSV field (RFC 4180): quoted if it contains a comma, quote or line break.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_string()
    }
}

/// A name without line breaks, for a comment.
fn one_line(name: &str) -> String {
    name.replace(['\n', '\r'], " ")
}
