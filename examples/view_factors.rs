//! View factors between the groups of OBJ scenes.
//!
//!     cargo run --release --example view_factors -- SCENE.obj… [options]

mod support;

use std::path::PathBuf;
use std::process::ExitCode;

use lexopt::prelude::*;
use radiosity::{Error, Mesh, ViewFactors, load_obj, write_view_factors};
use support::{Device, Maker};

const USAGE: &str = "\
usage: view_factors SCENE.obj… [--out DIR] [--element-size X] [--hemicube N]
                    [--adapter NAME | --cpu]

Writes the matrix of view factors between the groups (or objects) of each file as SCENE.csv beside
it, or in DIR, and prints it: row leaves, column receives; then `open`, what leaves the scene, and
`back`, what meets the backs of surfaces.

  --element-size X  longest edge of the pieces that are seen from [diagonal / 32]
  --hemicube N      pixels along an edge of a hemicube's top face, even [128]
  --adapter NAME    a graphics adapter with NAME in its name
  --cpu             rays on the CPU instead of hemicubes, N squared a row";

struct Settings {
    scenes: Vec<PathBuf>,
    out: Option<PathBuf>,
    element_size: Option<f64>,
    hemicube: u32,
    device: Device,
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
    fn run(&self, path: &PathBuf) -> Result<(), Error> {
        let beside = path.with_extension("csv");
        let csv = match (&self.out, beside.file_name()) {
            (Some(folder), Some(name)) => folder.join(name),
            _ => beside,
        };
        support::writable(&csv)?;
        let scene = load_obj(path)?;
        for warning in scene.warnings() {
            eprintln!("warning: {warning}");
        }
        let size = self.element_size.unwrap_or_else(|| support::default_element_size(&scene));
        let mesh = Mesh::new(scene, size)?;
        let mut maker = Maker::new(&self.device, &mesh, self.hemicube)?;
        let bar = indicatif::ProgressBar::new(mesh.element_count() as u64);
        let matrix = ViewFactors::new(&mesh, &mut maker, |done, _| {
            bar.set_position(done as u64);
            radiosity::Go::Continue(())
        })?;
        bar.finish_and_clear();
        let [name, kind, _] = maker.adapter();
        println!("{}: {} elements, {name} ({kind})", path.display(), mesh.element_count());
        if let Some(matrix) = matrix {
            print(&matrix);
            write_view_factors(csv, &matrix)?;
        }
        Ok(())
    }
}

fn print(m: &ViewFactors) {
    let width = m.names.iter().map(|n| n.chars().count()).max().unwrap_or(0).max(10);
    let header = m.names.iter().map(String::as_str).chain(["open", "back"]);
    let cells: Vec<String> = header.map(|n| format!("{n:>width$}")).collect();
    println!("{:>width$} {}", "F[row, col]", cells.join(" "));
    for (i, name) in m.names.iter().enumerate() {
        let row = m.factors[i].iter().chain([&m.open[i], &m.back[i]]);
        let cells: Vec<String> = row.map(|f| format!("{f:>width$.6}")).collect();
        println!("{name:>width$} {}", cells.join(" "));
    }
}

fn parse(mut args: lexopt::Parser) -> Result<Option<Settings>, lexopt::Error> {
    let mut s = Settings {
        scenes: vec![],
        out: None,
        element_size: None,
        hemicube: 128,
        device: Device::Gpu(None),
    };
    while let Some(arg) = args.next()? {
        match arg {
            Long("help") | Short('h') => return Ok(None),
            Long("out") => s.out = Some(args.value()?.into()),
            Long("element-size") => s.element_size = Some(args.value()?.parse()?),
            Long("hemicube") => s.hemicube = args.value()?.parse()?,
            Long("adapter") => s.device = Device::Gpu(Some(args.value()?.string()?)),
            Long("cpu") => s.device = Device::Cpu,
            Value(path) => s.scenes.push(path.into()),
            _ => return Err(arg.unexpected()),
        }
    }
    if s.scenes.is_empty() {
        return Err("no scene given".into());
    }
    Ok(Some(s))
}
