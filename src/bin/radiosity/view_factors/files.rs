//! The formats that a matrix of view factors is written in.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use npyz::WriterBuilder;
use radiosity::io::view_factors::{write_csv_list, write_csv_matrix, write_matrix_market};
use radiosity::io::write_npz;
use radiosity::view_factor::Estimate;
use radiosity::{Error, ErrorKind, ViewFactors};

use crate::args::{self, Stop};

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

/// One entry of the array in an `.npy` file.
#[derive(npyz::Serialize, npyz::AutoSerialize)]
struct Entry {
    f_from_row_to_column: f64,
    standard_error: f64,
}

impl Format {
    /// What files end in.
    pub const ENDINGS: [&str; 4] = ["csv", "mtx", "npy", "npz"];

    /// The value of `--format`.
    pub fn list(parser: &mut lexopt::Parser) -> Result<Vec<Format>, Stop> {
        let expected = "some of csv, list, mtx, npy, npz, with commas between";
        let text: String = args::value(parser, "format", expected)?;
        let formats: Option<Vec<Format>> = text.split(',').map(Format::named).collect();
        formats.ok_or_else(|| args::wrong_value("format", &text, expected))
    }

    fn named(name: &str) -> Option<Format> {
        match name {
            "csv" => Some(Format::Csv),
            "list" => Some(Format::List),
            "mtx" => Some(Format::MatrixMarket),
            "npy" => Some(Format::Npy),
            "npz" => Some(Format::Npz),
            _ => None,
        }
    }

    /// Those that are written unless others are asked for.
    pub fn default_for(groups: usize) -> Vec<Format> {
        if groups <= MAX_DENSE_GROUPS { vec![Format::Csv, Format::List] } else { vec![Format::Npz] }
    }

    /// # Errors
    /// [`ErrorKind::Setting`] where so many groups are too many for a square table.
    pub fn check(self, groups: usize) -> Result<(), Error> {
        let (name, is_dense) = match self {
            Format::Csv => ("csv", true),
            Format::Npy => ("npy", true),
            Format::List => ("list", false),
            Format::MatrixMarket => ("mtx", false),
            Format::Npz => ("npz", false),
        };
        if is_dense && groups > MAX_DENSE_GROUPS {
            let found = format!("a square table of {groups} groups");
            let remedy = format!("above {MAX_DENSE_GROUPS} take list, mtx or npz");
            return Err(Error::new(ErrorKind::Setting, format!("--format {name}"), found, remedy));
        }
        Ok(())
    }

    pub fn path(self, stem: &Path) -> PathBuf {
        stem.with_added_extension(match self {
            Format::Csv => "csv",
            Format::List => "list.csv",
            Format::MatrixMarket => "mtx",
            Format::Npy => "npy",
            Format::Npz => "npz",
        })
    }

    pub fn write(self, stem: &Path, matrix: &ViewFactors) -> Result<(), Error> {
        let path = self.path(stem);
        match self {
            Format::Csv => write_csv_matrix(path, matrix),
            Format::List => write_csv_list(path, matrix),
            Format::MatrixMarket => write_matrix_market(path, matrix),
            Format::Npy => write_npy(&path, matrix).map_err(|e| not_written(&path, &e)),
            Format::Npz => write_npz(path, matrix),
        }
    }
}

fn not_written(path: &Path, error: &std::io::Error) -> Error {
    let place = path.display().to_string();
    Error::new(ErrorKind::File, place, error.to_string(), "it must be writable")
}

fn write_npy(path: &Path, matrix: &ViewFactors) -> std::io::Result<()> {
    let n = matrix.names.len();
    let file = BufWriter::new(File::create(path)?);
    let options = npyz::WriteOptions::new().default_dtype().shape(&[n as u64, n as u64]);
    let mut writer = options.writer(file).begin_nd()?;
    for from in 0..n {
        for to in 0..n {
            let Estimate { value, error } = matrix.factor(from, to);
            writer.push(&Entry { f_from_row_to_column: value, standard_error: error })?;
        }
    }
    writer.finish()
}
