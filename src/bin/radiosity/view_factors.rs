//! `radiosity view-factors`: view factors between the groups of scenes, as tables.

mod check;
mod files;
pub mod merge;
mod report;
mod rows;

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use files::MatrixOptions;
use radiosity::io::SpecularSurfaces;
use radiosity::scene::{Warning, WarningKind};
use radiosity::view_factor::{MatrixRows, backs_met};
use radiosity::{Error, ErrorKind, Scene, SceneSettings, ViewFactors};
pub use report::print_checks;

use crate::args::{self, Stop, value};
use crate::{progress, standard};

/// Groups whose factors are printed at most.
pub const MAX_PRINTED: usize = 16;

/// Makes view factors between the groups of scenes
#[derive(Args)]
#[command(after_help = "\
Writes the view factors of each file and prints them, with standard errors and with closure, \
reciprocity and bounds of the raw numbers. F[i, j] is the share of the flux leaving group i (row) \
that arrives at group j (column); `open` is the share that leaves the scene, `back` the share that \
arrives at the backs of surfaces. A group of --two-sided has two rows and columns: GROUP, its \
front, and GROUP (back). Where a group is called `open`, `back` or `area`, it is the table's own \
column that is called (open), (back) or (area).")]
pub struct Options {
    /// Scenes, OBJ or STL files
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
    /// Group that emits and receives on both sides, a row each; may be repeated
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
    /// The scene of a file, in which mirrors and glass are surfaces as all others are. Prints what
    /// was odd about it.
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        let mut obj = SceneSettings::default();
        obj.specular = SpecularSurfaces::Ignore;
        obj.facets = self.facets;
        obj.strict = self.strict;
        let scene = progress::of_reading(path, || obj.load(path))?;
        let of_light = |w: &&Warning| {
            matches!(w.kind, WarningKind::NoLight | WarningKind::FaceWithoutMaterial)
        };
        for warning in scene.warnings().iter().filter(|w| !of_light(w)) {
            eprintln!("warning: {warning}");
        }
        Ok(scene)
    }

    /// Whether some group has two sides.
    pub fn has_two_sided(&self) -> bool {
        !self.two_sided.is_empty()
    }

    /// The rows of the matrix of `scene`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a two-sided group that is not in the scene.
    pub fn matrix_rows(&self, scene: &Scene) -> Result<MatrixRows, Error> {
        let two_sided = group_indices(scene, &self.two_sided, self.facets)?;
        Ok(MatrixRows::new(scene.groups(), &two_sided))
    }

    /// Warns where flux arrives at backs of `scene`, and says of which groups.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a two-sided group that is not in the scene.
    pub fn print_backs_met(&self, scene: &Scene, matrix: &ViewFactors) -> Result<(), Error> {
        let Some(&worst) = matrix.rows_that_meet_backs().first() else { return Ok(()) };
        let two_sided = group_indices(scene, &self.two_sided, self.facets)?;
        let met = backs_met(scene, &two_sided, worst)?;
        report::print_backs_met(matrix, scene, worst, &met);
        Ok(())
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
            _ => standard::stem(path),
        };
        for format in self.matrix.formats.iter().flatten() {
            args::check_writable(&format.path(&stem))?;
        }
        let scene = self.to_error.scene(path)?;
        let groups = self.to_error.matrix_rows(&scene)?.names.len();
        let formats = self.matrix.formats_for(groups, &stem)?;
        if let Some(rows) = &self.rows {
            return self.to_error.write_rows(&scene, rows.clone(), &stem);
        }
        let start = Instant::now();
        let Some(mut matrix) = self.to_error.matrix(&scene)? else { return Ok(()) };
        let seconds = start.elapsed().as_secs_f64();
        let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
        say!("{}: {groups} groups, {nonzeros} nonzeros, {seconds:.3} s", path.display());
        print_checks(&matrix);
        self.to_error.print_backs_met(&scene, &matrix)?;
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
    report::print_column_names(matrix);
    if matrix.names.len() <= MAX_PRINTED {
        report::print_factors(matrix);
    }
    for format in formats {
        progress::of_writing(&format.path(stem), |path| format.write(path, matrix));
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
