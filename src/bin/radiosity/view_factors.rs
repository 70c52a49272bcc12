//! `radiosity view-factors`: view factors between the groups of scenes, as tables.

mod check;
mod files;
pub mod merge;
mod rows;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use files::MatrixOptions;
use radiosity::io::SpecularSurfaces;
use radiosity::scene::{Warning, WarningKind};
use radiosity::view_factor::{ErrorStats, Estimate};
use radiosity::{Error, ErrorKind, ObjSettings, Scene, ViewFactors};

use crate::args::{self, Stop, value};
use crate::progress;

/// Groups whose factors are printed at most.
pub const MAX_PRINTED: usize = 16;

/// Makes view factors between the groups of scenes
#[derive(Args)]
#[command(after_help = "\
Writes the view factors of each file and prints them, with standard errors and with closure, \
reciprocity and bounds of the raw numbers. F[i, j] is the share of the flux leaving group i (row) \
that arrives at group j (column); `open` is the share that leaves the scene, `back` the share that \
arrives at the backs of surfaces.")]
pub struct Options {
    /// Scenes, OBJ files
    #[arg(value_name = "SCENE.obj", required = true)]
    scenes: Vec<PathBuf>,
    #[command(flatten)]
    to_error: ToError,
    /// Compare this number of rows, drawn at random, with exact ones, and print their errors; an
    /// exact row of a large scene takes seconds
    #[arg(long, value_name = "ROWS", value_parser = value::<usize>("a whole number of rows"))]
    #[arg(default_value = "0", hide_default_value = true)]
    check: usize,
    /// Make only rows A to B − 1, counted from 0, and write SCENE.A-B.rows: for several machines;
    /// `radiosity merge` makes a matrix of all rows
    #[arg(long, value_name = "A..B", value_parser = rows::range)]
    #[arg(conflicts_with_all = ["check", "enforce", "formats"])]
    rows: Option<Range<usize>>,
    #[command(flatten)]
    matrix: MatrixOptions,
    /// Folder for the files [default: that of each scene]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// View factors to an error that is asked for.
#[derive(Args)]
pub struct ToError {
    /// Each face is a group, named GROUP/1, GROUP/2, … in the order of the file; --two-sided takes
    /// GROUP too
    #[arg(long)]
    facets: bool,
    /// Absolute error of every factor, two standard errors
    #[arg(long, value_name = "E", default_value = "1e-4", value_parser = value::<f64>("a number"))]
    error: f64,
    /// Group that emits and receives on both sides; its area is that of both; may be repeated
    #[arg(long, value_name = "GROUP")]
    two_sided: Vec<String>,
    /// File that the finished rows are kept in, every few seconds and at Ctrl-C; it is resumed from
    /// where it exists
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Predict the memory of the factors, and refuse more than this
    #[arg(long, value_name = "GIB", value_parser = rows::memory)]
    memory: Option<f64>,
    /// Refuse a file that would have to be repaired
    #[arg(long)]
    strict: bool,
}

impl ToError {
    /// The scene of an OBJ file, in which mirrors and glass are surfaces as all others are.
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        let mut obj = ObjSettings::default();
        obj.specular = SpecularSurfaces::Ignore;
        obj.facets = self.facets;
        obj.strict = self.strict;
        progress::of_reading(path, || obj.load(path))
    }
}

impl Options {
    /// Runs the command: all scenes, whatever becomes of the others.
    pub fn run(self) -> Result<(), Stop> {
        if self.to_error.checkpoint.is_some() && self.scenes.len() > 1 {
            return Err(Stop::usage("--checkpoint keeps the rows of one scene"));
        }
        let mut failed = false;
        for scene in &self.scenes {
            match self.run_scene(scene) {
                Ok(()) => {}
                Err(Stop::Failed(e)) => {
                    eprintln!("error: {e}");
                    failed = true;
                }
                Err(stop) => return Err(stop),
            }
        }
        if failed { Err(Stop::Reported) } else { Ok(()) }
    }

    fn run_scene(&self, path: &Path) -> Result<(), Stop> {
        let stem = match (&self.out, path.file_stem()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.with_extension(""),
        };
        for format in self.matrix.formats.iter().flatten() {
            args::check_writable(&format.path(&stem))?;
        }
        let scene = self.to_error.scene(path)?;
        let formats = self.matrix.formats_for(scene.groups().len(), &stem)?;
        let of_light = |w: &&Warning| {
            matches!(w.kind, WarningKind::NoLight | WarningKind::FaceWithoutMaterial)
        };
        for warning in scene.warnings().iter().filter(|w| !of_light(w)) {
            eprintln!("warning: {warning}");
        }
        if let Some(rows) = &self.rows {
            return self.to_error.write_rows(&scene, rows.clone(), &stem);
        }
        let start = Instant::now();
        let mut matrix = self.to_error.matrix(&scene)?;
        let seconds = start.elapsed().as_secs_f64();
        let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
        let groups = matrix.names.len();
        say!("{}: {groups} groups, {nonzeros} nonzeros, {seconds:.3} s", path.display());
        print_checks(&matrix);
        self.check(&scene, &matrix)?;
        if self.matrix.enforce {
            matrix = enforce(&matrix);
        }
        Ok(write_all(&formats, &stem, &matrix)?)
    }

    /// Compares rows of `matrix` with exact ones, if that was asked for.
    fn check(&self, scene: &Scene, matrix: &ViewFactors) -> Result<(), Stop> {
        let ToError { error, two_sided, facets, .. } = &self.to_error;
        if self.check == 0 {
            return Ok(());
        }
        let groups = group_indices(scene, two_sided, *facets)?;
        check::check(scene, matrix, *error, &groups, self.check)
    }
}

/// Prints the factors if they are few, and writes them in all of `formats`.
fn write_all(formats: &[files::Format], stem: &Path, matrix: &ViewFactors) -> Result<(), Error> {
    if matrix.names.len() <= MAX_PRINTED {
        print_factors(matrix);
    }
    for format in formats {
        progress::of_writing(&format.path(stem), |_| format.write(stem, matrix))?;
    }
    Ok(())
}

/// Makes the matrix keep closure and reciprocity, and prints what that changed.
pub fn enforce(matrix: &ViewFactors) -> ViewFactors {
    let (enforced, report) = matrix.enforced();
    say!(
        "enforced: factors changed by {:.1e} RMS, {:.1e} at most; {} of {} rows closed; \
         closure left {:.1e}",
        report.rms_change,
        report.max_change,
        report.closed_rows,
        matrix.names.len(),
        report.closure_left
    );
    enforced
}

/// Whether `facet` is the name of a facet that `group` was cut into.
pub fn is_facet_of(facet: &str, group: &str) -> bool {
    facet.rsplit_once('/').is_some_and(|(of, n)| of == group && n.parse::<u32>().is_ok())
}

/// Group numbers of names: with `facets` also those of the facets that a group was cut into.
fn group_indices(scene: &Scene, names: &[String], facets: bool) -> Result<Vec<usize>, Error> {
    let mut indices = vec![];
    for name in names {
        let before = indices.len();
        let matching = |group: &String| group == name || facets && is_facet_of(group, name);
        let groups = scene.groups().iter().enumerate();
        indices.extend(groups.filter(|(_, group)| matching(group)).map(|(index, _)| index));
        if indices.len() == before {
            let found = format!("no group '{name}'");
            let mut remedy = scene.groups()[..scene.groups().len().min(MAX_PRINTED)].join(", ");
            remedy.insert_str(0, "the scene has ");
            if scene.groups().len() > MAX_PRINTED {
                remedy += &format!(" and {} more", scene.groups().len() - MAX_PRINTED);
            }
            return Err(Error::new(ErrorKind::Setting, "--two-sided", found, remedy));
        }
    }
    Ok(indices)
}

/// Prints closure, reciprocity and bounds of the raw numbers, and which groups see out.
pub fn print_checks(m: &ViewFactors) {
    let checks = m.checks();
    let name = |i: usize| &m.names[i];
    let (r, b) = (checks.reciprocity, checks.bounds);
    say!("closure: {:.1e} RMS, {:.1e} worst", checks.closure.rms, checks.closure.max);
    say!("reciprocity: {:.1e} RMS, {:.1e} worst", r.rms, r.max);
    if b.max > 0.0 {
        let (from, to) = (name(b.at.0), name(b.at.1));
        say!("bounds: exceeded by up to {:.1e}, from {from} to {to}", b.max);
    } else {
        say!("bounds: kept");
    }
    let ErrorStats { max: excess, at: (row, _), .. } = checks.row_sums;
    // Above the rounding of sums of thousands of factors.
    if excess > 1e-12 {
        let error = m.open[row].error;
        say!("sums of rows: above 1 by up to {excess:.1e} ± {error:.1e}, in {}", name(row));
    } else {
        say!("sums of rows: none above 1");
    }
    if let Some(&worst) = m.rows_over_unity().first() {
        eprintln!(
            "warning: more than all of {}'s flux arrives, {:.3e} too much: are two surfaces in one \
             place?",
            name(worst),
            -m.open[worst].value
        );
    }
    let leaks = m.open_rows();
    if let Some(&worst) = leaks.first() {
        eprintln!(
            "warning: {} of {} groups see out of the scene; {} loses most, {:.3e}",
            leaks.len(),
            m.names.len(),
            name(worst),
            m.open[worst].value
        );
    } else {
        say!("closed: no group sees out");
    }
}

/// Prints the factors of every group, each with its error.
fn print_factors(m: &ViewFactors) {
    let width = m.names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(4);
    say!("{:>width$} → {:<width$} {:>12} {:>9}", "from", "to", "F", "± error");
    let line = |from: &str, to: &str, e: Estimate| {
        say!("{from:>width$} → {to:<width$} {:12.9} {:9.1e}", e.value, e.error);
    };
    for (i, from) in m.names.iter().enumerate() {
        for f in &m.factors[i] {
            let e = Estimate { value: f.value, error: f.error };
            line(from, &m.names[f.to as usize], e);
        }
        line(from, "open", m.open[i]);
        line(from, "back", m.back[i]);
    }
}
