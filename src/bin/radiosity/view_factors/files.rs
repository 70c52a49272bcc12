//! The formats that a matrix of view factors is written in.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Args;
use npyz::WriterBuilder;
use radiosity::io::view_factors::{write_csv_list, write_csv_matrix, write_matrix_market};
use radiosity::io::{Output, write_npz};
use radiosity::view_factor::Estimate;
use radiosity::{Error, ErrorKind, ViewFactors};

use crate::args::{self, List, Names, some_of};

/// Groups of a square table at most: 134 million numbers, some gigabyte of text.
const MAX_DENSE_GROUPS: usize = 1 << 13;

#[derive(Clone, Copy, PartialEq)]
pub enum Format {
    Csv,
    List,
    MatrixMarket,
    Npy,
    Npz,
}

/// The formats by their names. A list is a CSV file too.
pub const FORMATS: Names<Format> = &[
    ("csv", Format::Csv),
    ("list", Format::List),
    ("mtx", Format::MatrixMarket),
    ("npy", Format::Npy),
    ("npz", Format::Npz),
];

/// What becomes of a matrix.
#[derive(Args)]
pub struct MatrixOptions {
    /// Change the matrix so that it keeps closure and reciprocity, and print the change
    #[arg(long)]
    pub enforce: bool,
    /// Files: csv, the matrix; list, its nonzeros with standard errors and areas, as CSV; mtx,
    /// Matrix Market; npy, a square array of f_from_row_to_column and standard_error; npz, sparse
    /// rows as SciPy's load_npz reads them, with standard errors, areas, open and back. Square
    /// tables are limited to 8192 groups [default: csv,list; npz for more groups]
    #[arg(long = "format", value_name = "FORMATS", value_parser = some_of(FORMATS))]
    pub formats: Option<List<Format>>,
}

/// One entry of the array in an `.npy` file.
#[derive(npyz::Serialize, npyz::AutoSerialize)]
struct Entry {
    f_from_row_to_column: f64,
    standard_error: f64,
}

impl MatrixOptions {
    /// The formats of a matrix of so many groups, whose files can be written beside `stem`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] where the groups are too many for a square table; those of
    /// [`args::check_writable`].
    pub fn formats_for(&self, groups: usize, stem: &Path) -> Result<Vec<Format>, Error> {
        let default = match groups <= MAX_DENSE_GROUPS {
            true => vec![Format::Csv, Format::List],
            false => vec![Format::Npz],
        };
        let formats = self.formats.clone().unwrap_or(default);
        for format in &formats {
            format.check(groups)?;
            args::check_writable(&format.path(stem))?;
        }
        Ok(formats)
    }
}

impl Format {
    fn name(self) -> &'static str {
        FORMATS.iter().find(|(_, format)| *format == self).map_or("", |(name, _)| name)
    }

    fn check(self, groups: usize) -> Result<(), Error> {
        if groups <= MAX_DENSE_GROUPS || !matches!(self, Format::Csv | Format::Npy) {
            return Ok(());
        }
        let place = format!("--format {}", self.name());
        let found = format!("a square table of {groups} groups");
        let remedy = format!("above {MAX_DENSE_GROUPS} take list, mtx or npz");
        Err(Error::new(ErrorKind::Setting, place, found, remedy))
    }

    pub fn path(self, stem: &Path) -> PathBuf {
        match self {
            Format::List => stem.with_added_extension("list.csv"),
            _ => stem.with_added_extension(self.name()),
        }
    }

    pub fn write(self, path: &Path, matrix: &ViewFactors) -> Result<(), Error> {
        match self {
            Format::Csv => write_csv_matrix(path, matrix),
            Format::List => write_csv_list(path, matrix),
            Format::MatrixMarket => write_matrix_market(path, matrix),
            Format::Npy => Output::from(path).write(|out| write_npy(out, matrix)),
            Format::Npz => write_npz(path, matrix),
        }
    }
}

fn write_npy(out: &mut dyn Write, matrix: &ViewFactors) -> std::io::Result<()> {
    let n = matrix.names.len();
    let options = npyz::WriteOptions::new().default_dtype().shape(&[n as u64, n as u64]);
    let mut writer = options.writer(out).begin_nd()?;
    for from in 0..n {
        for to in 0..n {
            let Estimate { value, error } = matrix.factor(from, to);
            writer.push(&Entry { f_from_row_to_column: value, standard_error: error })?;
        }
    }
    writer.finish()
}
