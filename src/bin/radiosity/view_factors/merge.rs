//! `radiosity merge`: rows of view factors from many machines, put together.

use std::path::PathBuf;

use clap::Args;
use radiosity::Error;
use radiosity::io::view_factors::read_rows;
use radiosity::view_factor::PartialMatrix;

use super::files::{FORMATS, MatrixOptions};
use super::{enforce, print_checks, write_all};
use crate::args::{self, Stop};
use crate::progress;

/// Merges rows of view factors from several machines to a matrix
#[derive(Args)]
#[command(after_help = "\
The rows are those of `radiosity view-factors --rows`, of one scene with the same settings. The \
matrix has the same bytes as one that is made at once.")]
pub struct Options {
    /// Files of rows
    #[arg(value_name = "FILE.rows", required = true)]
    paths: Vec<PathBuf>,
    #[command(flatten)]
    matrix: MatrixOptions,
    /// Path of the files without their endings [default: that of the first file, without A-B.rows]
    #[arg(short, long, value_name = "STEM")]
    out: Option<PathBuf>,
}

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        let Options { paths, matrix: options, out } = self;
        // SCENE.A-B.rows
        let stem = paths[0].with_extension("").with_extension("");
        let stem = args::stem(out, stem, &args::names(FORMATS));
        let read = |path: &PathBuf| progress::of_reading(path, || read_rows(path));
        let parts = paths.iter().map(read).collect::<Result<Vec<_>, Error>>()?;
        let mut matrix = PartialMatrix::merge(parts)?.into_matrix()?;
        let groups = matrix.names.len();
        let formats = options.formats_for(groups, &stem)?;
        let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
        say!("{}: {groups} groups, {nonzeros} nonzeros", stem.display());
        print_checks(&matrix);
        if options.enforce {
            matrix = enforce(&matrix);
        }
        Ok(write_all(&formats, &stem, &matrix)?)
    }
}
