//! `radiosity merge`: rows of view factors from many machines, put together.

use std::path::{Path, PathBuf};

use lexopt::prelude::*;
use radiosity::Error;
use radiosity::io::view_factors::read_rows;
use radiosity::view_factor::PartialMatrix;

use super::files::Format;
use super::{enforce, print_checks, write_all};
use crate::args::{self, Stop};
use crate::progress;

pub const USAGE: &str = "\
usage: radiosity merge FILE.rows… [--enforce] [--format F,…] [--out STEM]

Puts rows together that `radiosity view-factors --rows` has written, all of one scene with the same
settings, and writes the matrix: the same bytes as if one machine had made it.

  --enforce     make the matrix keep closure and reciprocity, and say what that changed
  --format F,…  as in `radiosity view-factors`
  --out STEM    path of the files without extension [that of the first file, without A-B.rows]";

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let (mut paths, mut formats, mut out, mut enforced) = (vec![], None, None, false);
    while let Some(arg) = parser.next()? {
        match arg {
            Long("help") | Short('h') => return Err(Stop::Help),
            Long("enforce") => enforced = true,
            Long("format") => formats = Some(Format::list(parser)?),
            Long("out") => out = Some(PathBuf::from(parser.value()?)),
            Value(path) => paths.push(PathBuf::from(path)),
            _ => return Err(arg.unexpected().into()),
        }
    }
    let Some(first) = paths.first() else {
        return Err(Stop::usage("no rows given: name the files that --rows has written"));
    };
    // SCENE.A-B.rows
    let stem = first.with_extension("").with_extension("");
    let stem = args::stem(out, stem, &Format::ENDINGS);
    let parts = paths.iter().map(|path: &PathBuf| progress::of_reading(path, || read_rows(path)));
    let parts = parts.collect::<Result<Vec<_>, Error>>()?;
    let mut matrix = PartialMatrix::merge(parts)?.into_matrix()?;
    let groups = matrix.names.len();
    let formats = formats.unwrap_or_else(|| Format::default_for(groups));
    for format in &formats {
        format.check(groups)?;
        args::check_writable(&format.path(&stem))?;
    }
    let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
    say!("{}: {groups} groups, {nonzeros} nonzeros", Path::new(&stem).display());
    print_checks(&matrix);
    if enforced {
        matrix = enforce(&matrix);
    }
    Ok(write_all(&formats, &stem, &matrix)?)
}
