//! `radiosity view-factors`: view factors between the groups of scenes, as tables.

mod check;
mod files;
pub mod merge;
mod rows;

use std::num::NonZeroU32;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Instant;

use files::Format;
use lexopt::prelude::*;
use radiosity::backend::AdapterInfo;
use radiosity::scene::WarningKind;
use radiosity::view_factor::{ErrorStats, Estimate};
use radiosity::{BakeSettings, Error, ErrorKind, Mesh, Scene, ViewFactors, Warning};

use crate::args::{self, Device, Stop};
use crate::progress;
use crate::scene_options::SceneOptions;

pub const USAGE: &str = "\
usage: radiosity view-factors SCENE.obj… [--facets] [--error E] [--two-sided NAME]… [--check ROWS]
                    [--checkpoint FILE] [--memory GIB] [--enforce] [--format F,…] [--out DIR]
       radiosity view-factors SCENE.obj --rows A..B [--facets] [--error E] [--two-sided NAME]…
                    [--checkpoint FILE] [--out DIR]
       radiosity view-factors SCENE.obj… --sampled [--facets] [--element-size X] [--hemicube N]
                    [--adapter NAME | --cpu] [--enforce] [--format F,…] [--out DIR]

Writes the view factors between the groups (or objects) of each file beside it, or in DIR, and
prints them with their standard errors and what raw numbers say of closure, reciprocity and bounds.
F[i, j] is the share of the flux leaving group i (row) that arrives at group j (column); `open` is
what leaves the scene, `back` what meets the backs of surfaces.

  --facets          between faces instead: each is a group of its own, in the file's order, named
                    GROUP/1, GROUP/2, …; --two-sided takes the names of GROUPs too
  --error E         absolute error wanted of every factor, two standard errors [1e-4]; far
                    smaller errors where exact factors take no minutes
  --two-sided NAME  this group gives and takes on both sides; its area is that of both
  --check ROWS      hold so many rows, drawn at random, against exact ones, and print how far off
                    they are; an exact row of a large scene takes seconds
  --rows A..B       only rows A to B − 1, counted from 0, to SCENE.A-B.rows: for many machines;
                    `radiosity merge` makes a matrix of all of them
  --checkpoint FILE keep the rows that are done there, every few seconds and at Ctrl-C; go on from
                    it if it is there
  --memory GIB      predict how many factors there will be, and refuse what would take more
  --enforce         make the matrix keep closure and reciprocity, and say what that changed
  --format F,…      csv: the matrix, SCENE.csv; list: nonzeros with standard errors and areas,
                    SCENE.list.csv; mtx: Matrix Market, SCENE.mtx; npy: SCENE.npy, a square array of
                    f_from_row_to_column and standard_error; npz: sparse rows as SciPy's load_npz
                    reads them, with standard errors, areas, open and back, SCENE.npz; square
                    tables have 8192 groups at most [csv,list, or npz for more]
  --sampled         from hemicubes, one an element: for scenes of more than some ten thousand
                    polygons; the error is what it is
  --element-size X  longest edge of the elements that are seen from [diagonal / 32]
  --hemicube N      pixels along an edge of a hemicube's top face, even [128]
  --adapter NAME    a graphics adapter with NAME in its name
  --cpu             rays on the CPU instead of hemicubes, N squared a row
  --strict          refuse what would be repaired in the file";

/// Groups whose factors are printed at most.
pub const MAX_PRINTED: usize = 16;

/// Above the rounding of a sum of thousands of factors.
const ROUNDING_OF_SUMS: f64 = 1e-12;

/// Absolute error of a factor where none is asked for.
const DEFAULT_ERROR: f64 = 1e-4;

/// Pixels along an edge of a hemicube's top face where none are asked for.
const DEFAULT_HEMICUBE: u32 = 128;

/// What is asked of the command.
struct Options {
    scenes: Vec<PathBuf>,
    reading: SceneOptions,
    /// The folder for files, or none for that of each scene.
    out: Option<PathBuf>,
    /// None for what suits the number of groups.
    formats: Option<Vec<Format>>,
    enforce: bool,
    method: Method,
}

enum Method {
    ToError { to_error: ToError, check: usize, rows: Option<Range<usize>> },
    Sampled { element_size: Option<f64>, hemicube: u32, device: Device },
}

/// View factors to an error that is asked for.
pub struct ToError {
    /// Standard errors are half of it at most.
    pub error: f64,
    /// Names of groups.
    pub two_sided: Vec<String>,
    /// Whether each face is a group, and `two_sided` may name those of the file.
    pub facets: bool,
    /// Where rows that are done are kept.
    pub checkpoint: Option<PathBuf>,
    /// Memory that it may take, GiB.
    pub memory: Option<f64>,
}

impl Default for ToError {
    fn default() -> ToError {
        ToError {
            error: DEFAULT_ERROR,
            two_sided: vec![],
            facets: false,
            checkpoint: None,
            memory: None,
        }
    }
}

/// Runs the command: all scenes, whatever becomes of the others.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    let mut failed = false;
    for scene in &options.scenes {
        match options.run(scene) {
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

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let (mut scenes, mut out, mut enforce) = (vec![], None, false);
        let mut formats = None;
        let (mut error, mut two_sided, mut check) = (None, vec![], None);
        let (mut sampled, mut element_size, mut hemicube) = (false, None, None);
        let (mut device, mut facets) = (None, false);
        let (mut rows, mut checkpoint, mut memory) = (None, None, None);
        let mut reading = SceneOptions::ignoring_specular();
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("out") => out = Some(parser.value()?.into()),
                Long("format") => formats = Some(Format::list(parser)?),
                Long("facets") => {
                    facets = true;
                    reading.by_facets();
                }
                Long("enforce") => enforce = true,
                Long("error") => error = Some(args::value(parser, "error", "a number")?),
                Long("check") => {
                    check = Some(args::value(parser, "check", "a whole number of rows")?);
                }
                Long("rows") => rows = Some(rows::range(parser)?),
                Long("memory") => memory = Some(rows::memory(parser)?),
                Long("checkpoint") => checkpoint = Some(parser.value()?.into()),
                Long("two-sided") => {
                    two_sided.push(args::value(parser, "two-sided", "a group's name")?);
                }
                Long("sampled") => sampled = true,
                Long("element-size") => {
                    element_size = Some(args::value(parser, "element-size", "a number")?);
                }
                Long("hemicube") => {
                    hemicube = Some(args::value(parser, "hemicube", "a whole number of pixels")?);
                }
                Long("adapter") => device = Some(Device::named(parser)?),
                Long("cpu") => device = Some(Device::Cpu),
                Value(path) => scenes.push(path.into()),
                Long(name) => {
                    let name = name.to_string();
                    // Factors are of fronts, and --two-sided names the groups with two.
                    if matches!(&*name, "sides" | "specular" | "luminaire" | "luminaires")
                        || !reading.option(&name, parser)?
                    {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                _ => return Err(arg.unexpected().into()),
            }
        }
        if scenes.is_empty() {
            return Err(Stop::usage("no scene given: name one or more OBJ files"));
        }
        if checkpoint.is_some() && scenes.len() > 1 {
            return Err(Stop::usage("--checkpoint keeps the rows of one scene"));
        }
        if rows.is_some() && (check.is_some() || enforce || formats.is_some()) {
            let needing = "--check, --enforce and --format need all rows: `radiosity merge`";
            return Err(Stop::usage(needing));
        }
        let is_kept = rows.is_some() || checkpoint.is_some();
        let is_sized = check.is_some() || memory.is_some();
        let only_to_error = error.is_some() || !two_sided.is_empty() || is_sized || is_kept;
        let only_sampled = element_size.is_some() || hemicube.is_some() || device.is_some();
        let method = if sampled {
            if only_to_error {
                let not_for = "--error, --two-sided, --check, --memory, --rows and --checkpoint \
                               are not for --sampled";
                return Err(Stop::usage(not_for));
            }
            let hemicube = hemicube.unwrap_or(DEFAULT_HEMICUBE);
            let device = device.unwrap_or(Device::Gpu(None));
            Method::Sampled { element_size, hemicube, device }
        } else {
            if only_sampled {
                let needing = "--element-size, --hemicube, --adapter and --cpu need --sampled";
                return Err(Stop::usage(needing));
            }
            let error = error.unwrap_or(DEFAULT_ERROR);
            let to_error = ToError { error, two_sided, facets, checkpoint, memory };
            Method::ToError { to_error, check: check.unwrap_or(0), rows }
        };
        Ok(Options { scenes, reading, out, formats, enforce, method })
    }

    fn run(&self, path: &Path) -> Result<(), Stop> {
        let stem = match (&self.out, path.file_stem()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.with_extension(""),
        };
        for format in self.formats.iter().flatten() {
            args::check_writable(&format.path(&stem))?;
        }
        let scene = progress::of_reading(path, || self.reading.load(path))?;
        let groups = scene.groups().len();
        let formats = self.formats.clone().unwrap_or_else(|| Format::default_for(groups));
        for format in &formats {
            format.check(groups)?;
            args::check_writable(&format.path(&stem))?;
        }
        let of_light = |w: &&Warning| {
            matches!(w.kind, WarningKind::NoLight | WarningKind::FaceWithoutMaterial)
        };
        for warning in scene.warnings().iter().filter(|w| !of_light(w)) {
            eprintln!("warning: {warning}");
        }
        if let Method::ToError { to_error, rows: Some(rows), .. } = &self.method {
            return to_error.write_rows(&scene, rows.clone(), &stem);
        }
        let start = Instant::now();
        let mut matrix = self.method.matrix(&scene)?;
        let seconds = start.elapsed().as_secs_f64();
        let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
        let groups = matrix.names.len();
        say!("{}: {groups} groups, {nonzeros} nonzeros, {seconds:.3} s", path.display());
        print_checks(&matrix);
        self.method.check(&scene, &matrix)?;
        if self.enforce {
            matrix = enforce(&matrix);
        }
        Ok(write_all(&formats, &stem, &matrix)?)
    }
}

/// Prints the factors if they are few, and writes them in all of `formats`.
fn write_all(formats: &[Format], stem: &Path, matrix: &ViewFactors) -> Result<(), Error> {
    if matrix.names.len() <= MAX_PRINTED {
        print_factors(matrix);
    }
    for format in formats {
        progress::of_writing(&format.path(stem), |_| format.write(stem, matrix))?;
    }
    Ok(())
}

impl Method {
    /// The view factors between the groups of `scene`.
    fn matrix(&self, scene: &Scene) -> Result<ViewFactors, Stop> {
        let matrix = match self {
            Method::ToError { to_error, .. } => return to_error.matrix(scene),
            Method::Sampled { element_size, hemicube, device } => {
                let size = element_size
                    .unwrap_or_else(|| BakeSettings::elements_only(scene).solve.element_size);
                let mesh = Mesh::new(scene.clone(), size)?;
                let device = device.open()?;
                let mut rows = device.rows(&mesh, *hemicube, NonZeroU32::MIN)?;
                let AdapterInfo { name, kind, .. } = device.adapter();
                say!("{} elements, {name} ({kind})", mesh.element_count());
                progress::of_count("elements", |report| {
                    ViewFactors::sampled(&mesh, &mut rows, report)
                })?
            }
        };
        matrix.ok_or(Stop::Interrupted)
    }

    /// Holds as many rows of `matrix` as are asked for against exact ones.
    fn check(&self, scene: &Scene, matrix: &ViewFactors) -> Result<(), Stop> {
        match self {
            Method::ToError { to_error, check: rows @ 1.., .. } => {
                let groups = group_indices(scene, &to_error.two_sided, to_error.facets)?;
                check::check(scene, matrix, to_error.error, &groups, *rows)
            }
            _ => Ok(()),
        }
    }
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
    if excess > ROUNDING_OF_SUMS {
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
