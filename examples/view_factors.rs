//! View factors between the groups of OBJ scenes.
//!
//!     cargo run --release --example view_factors -- SCENE.obj… [options]

mod support;

use std::fs::File;
use std::io::BufWriter;
use std::num::NonZeroU32;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use indicatif::ProgressBar;
use lexopt::prelude::*;
use npyz::WriterBuilder;
use radiosity::{
    Error, ErrorKind, Estimate, Mesh, Scene, ViewFactors, load_obj, write_matrix_market,
    write_view_factor_list, write_view_factors,
};
use support::Choice;

const USAGE: &str = "\
usage: view_factors SCENE.obj… [--error E] [--two-sided NAME]… [--enforce] [--format F,…]
                    [--out DIR]
       view_factors SCENE.obj… --sampled [--element-size X] [--hemicube N]
                    [--adapter NAME | --cpu] [--enforce] [--format F,…] [--out DIR]

Writes the view factors between the groups (or objects) of each file beside it, or in DIR, and
prints them with their standard errors and what raw numbers say of closure, reciprocity and bounds.
F[i, j] is the share of the flux leaving group i (row) that arrives at group j (column); `open` is
what leaves the scene, `back` what meets the backs of surfaces.

  --error E         absolute error wanted of every factor [1e-4]
  --two-sided NAME  this group gives and takes on both sides; its area is that of both
  --enforce         make the matrix keep closure and reciprocity, and say what that changed
  --format F,…      csv: the matrix, SCENE.csv; list: nonzeros with standard errors and areas,
                    SCENE.list.csv; mtx: Matrix Market, SCENE.mtx; npy: SCENE.npy, a square array of
                    f_from_row_to_column and standard_error [csv,list]
  --sampled         from hemicubes, one an element: for scenes of more than some ten thousand
                    polygons; the error is what it is
  --element-size X  longest edge of the elements that are seen from [diagonal / 32]
  --hemicube N      pixels along an edge of a hemicube's top face, even [128]
  --adapter NAME    a graphics adapter with NAME in its name
  --cpu             rays on the CPU instead of hemicubes, N squared a row";

/// Groups whose factors are printed at most.
const MOST_PRINTED: usize = 16;

struct Settings {
    scenes: Vec<PathBuf>,
    out: Option<PathBuf>,
    formats: Vec<Format>,
    enforce: bool,
    method: Method,
}

enum Method {
    Exact { error: f64, two_sided: Vec<String> },
    Sampled { element_size: Option<f64>, hemicube: u32, device: Choice },
}

#[derive(Clone, Copy, PartialEq)]
enum Format {
    Csv,
    List,
    MatrixMarket,
    Npy,
}

/// One entry of the array in an `.npy` file.
#[derive(npyz::Serialize, npyz::AutoSerialize)]
struct Entry {
    f_from_row_to_column: f64,
    standard_error: f64,
}

fn main() -> ExitCode {
    let settings = match parse(lexopt::Parser::from_env()) {
        Ok(Some(settings)) => settings,
        Ok(None) => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(e) => {
            eprintln!("error: {e}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    let mut code = ExitCode::SUCCESS;
    for scene in &settings.scenes {
        if let Err(e) = settings.run(scene) {
            eprintln!("error: {e}");
            code = ExitCode::FAILURE;
        }
    }
    code
}

impl Settings {
    fn run(&self, path: &Path) -> Result<(), Error> {
        let stem = match (&self.out, path.file_stem()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => path.with_extension(""),
        };
        for format in &self.formats {
            support::writable(&format.path(&stem))?;
        }
        let scene = load_obj(path)?;
        for warning in scene.warnings() {
            eprintln!("warning: {warning}");
        }
        let start = Instant::now();
        let bar = ProgressBar::new(0);
        let progress = |done: usize, all: usize| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
            ControlFlow::Continue(())
        };
        let matrix = match &self.method {
            Method::Exact { error, two_sided } => {
                let groups = indices(&scene, two_sided)?;
                ViewFactors::new(&scene, *error, &groups, progress)?
            }
            Method::Sampled { element_size, hemicube, device } => {
                let size = element_size.unwrap_or_else(|| support::default_element_size(&scene));
                let mesh = Mesh::new(scene, size)?;
                let device = device.open()?;
                let mut maker = device.rows(&mesh, *hemicube, NonZeroU32::MIN)?;
                let [name, kind, _] = device.adapter();
                println!("{} elements, {name} ({kind})", mesh.element_count());
                ViewFactors::sampled(&mesh, &mut maker, progress)?
            }
        };
        bar.finish_and_clear();
        let Some(mut matrix) = matrix else { return Ok(()) };
        let seconds = start.elapsed().as_secs_f64();
        println!("{}: {} groups, {seconds:.3} s", path.display(), matrix.names.len());
        judge(&matrix);
        if self.enforce {
            let (enforced, c) = matrix.enforced();
            println!(
                "enforced: factors changed by {:.1e} RMS, {:.1e} at most; {} of {} rows closed; \
                 closure left {:.1e}",
                c.rms,
                c.worst,
                c.closed,
                matrix.names.len(),
                c.left
            );
            matrix = enforced;
        }
        if matrix.names.len() <= MOST_PRINTED {
            print(&matrix);
        }
        self.formats.iter().try_for_each(|f| f.write(&stem, &matrix))
    }
}

/// Group numbers of names.
fn indices(scene: &Scene, names: &[String]) -> Result<Vec<usize>, Error> {
    let index = |name: &String| {
        let found = scene.groups().iter().position(|g| g == name);
        found.ok_or_else(|| {
            let all = scene.groups().join(", ");
            let remedy = format!("the scene has {all}");
            Error::new(ErrorKind::Setting, "--two-sided", format!("no group '{name}'"), remedy)
        })
    };
    names.iter().map(index).collect()
}

/// Says what raw numbers show, and which groups see out.
fn judge(m: &ViewFactors) {
    let checks = m.checks();
    let name = |i: usize| &m.names[i];
    let (r, b) = (checks.reciprocity, checks.bounds);
    println!("closure: {:.1e} RMS, {:.1e} worst", checks.closure.rms, checks.closure.worst);
    println!("reciprocity: {:.1e} RMS, {:.1e} worst", r.rms, r.worst);
    if b.worst > 0.0 {
        let (from, to) = (name(b.at.0), name(b.at.1));
        println!("bounds: exceeded by up to {:.1e}, from {from} to {to}", b.worst);
    } else {
        println!("bounds: kept");
    }
    if let Some(&worst) = m.overfull().first() {
        eprintln!(
            "warning: more than all of {}'s flux arrives, {:.3e} too much: are two surfaces in one \
             place?",
            name(worst),
            -m.open[worst].value
        );
    }
    let leaks = m.leaks();
    if let Some(&worst) = leaks.first() {
        eprintln!(
            "warning: {} of {} groups see out of the scene; {} loses most, {:.3e}",
            leaks.len(),
            m.names.len(),
            name(worst),
            m.open[worst].value
        );
    } else {
        println!("closed: no group sees out");
    }
}

fn print(m: &ViewFactors) {
    let width = m.names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(4);
    println!("{:>width$} → {:<width$} {:>12} {:>9}", "from", "to", "F", "± error");
    let line = |from: &str, to: &str, e: Estimate| {
        println!("{from:>width$} → {to:<width$} {:12.9} {:9.1e}", e.value, e.error);
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

impl Format {
    fn path(self, stem: &Path) -> PathBuf {
        let mut name = stem.as_os_str().to_owned();
        name.push(match self {
            Format::Csv => ".csv",
            Format::List => ".list.csv",
            Format::MatrixMarket => ".mtx",
            Format::Npy => ".npy",
        });
        name.into()
    }

    fn write(self, stem: &Path, matrix: &ViewFactors) -> Result<(), Error> {
        let path = self.path(stem);
        match self {
            Format::Csv => write_view_factors(path, matrix),
            Format::List => write_view_factor_list(path, matrix),
            Format::MatrixMarket => write_matrix_market(path, matrix),
            Format::Npy => write_npy(&path, matrix).map_err(|e| {
                let place = path.display().to_string();
                Error::new(ErrorKind::File, place, e.to_string(), "it must be writable")
            }),
        }
    }
}

fn write_npy(path: &Path, matrix: &ViewFactors) -> std::io::Result<()> {
    let n = matrix.names.len();
    let file = BufWriter::new(File::create(path)?);
    let options = npyz::WriteOptions::new().default_dtype().shape(&[n as u64, n as u64]);
    let mut writer = options.writer(file).begin_nd()?;
    for (i, j) in (0..n * n).map(|k| (k / n, k % n)) {
        let Estimate { value, error } = matrix.factor(i, j);
        writer.push(&Entry { f_from_row_to_column: value, standard_error: error })?;
    }
    writer.finish()
}

fn parse(mut args: lexopt::Parser) -> Result<Option<Settings>, lexopt::Error> {
    let (mut scenes, mut out, mut enforce) = (vec![], None, false);
    let mut formats = vec![Format::Csv, Format::List];
    let (mut error, mut two_sided) = (None, vec![]);
    let (mut sampled, mut element_size, mut hemicube, mut device) = (false, None, None, None);
    while let Some(arg) = args.next()? {
        match arg {
            Long("help") | Short('h') => return Ok(None),
            Long("out") => out = Some(args.value()?.into()),
            Long("format") => formats = args.value()?.parse_with(parse_formats)?,
            Long("enforce") => enforce = true,
            Long("error") => error = Some(args.value()?.parse()?),
            Long("two-sided") => two_sided.push(args.value()?.string()?),
            Long("sampled") => sampled = true,
            Long("element-size") => element_size = Some(args.value()?.parse()?),
            Long("hemicube") => hemicube = Some(args.value()?.parse()?),
            Long("adapter") => device = Some(Choice::Gpu(Some(args.value()?.string()?))),
            Long("cpu") => device = Some(Choice::Cpu),
            Value(path) => scenes.push(path.into()),
            _ => return Err(arg.unexpected()),
        }
    }
    if scenes.is_empty() {
        return Err("no scene given".into());
    }
    let method = match sampled {
        true if error.is_some() || !two_sided.is_empty() => {
            return Err("--error and --two-sided are not for --sampled".into());
        }
        true => Method::Sampled {
            element_size,
            hemicube: hemicube.unwrap_or(128),
            device: device.unwrap_or(Choice::Gpu(None)),
        },
        false if element_size.is_some() || hemicube.is_some() || device.is_some() => {
            return Err("--element-size, --hemicube, --adapter and --cpu need --sampled".into());
        }
        false => Method::Exact { error: error.unwrap_or(1e-4), two_sided },
    };
    Ok(Some(Settings { scenes, out, formats, enforce, method }))
}

fn parse_formats(text: &str) -> Result<Vec<Format>, String> {
    let format = |name: &str| match name {
        "csv" => Ok(Format::Csv),
        "list" => Ok(Format::List),
        "mtx" => Ok(Format::MatrixMarket),
        "npy" => Ok(Format::Npy),
        _ => Err(format!("'{name}' is none of csv, list, mtx, npy")),
    };
    text.split(',').map(format).collect()
}
