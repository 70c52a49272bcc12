//! `radiosity probes`: irradiance at points in the air as spherical harmonics, for games.

use std::path::PathBuf;

use lexopt::prelude::*;
use radiosity::glam::DVec3;
use radiosity::probe::{Probe, ProbeGrid, probes_at};
use radiosity::scene::Aabb;
use radiosity::{Error, Scene};
use serde_json::json;

use crate::args::{self, Stop};
use crate::light::{Light, LightOptions, light_usage};
use crate::{interrupt, progress};

pub const USAGE: &str = concat!(
    "\
usage: radiosity probes SCENE.obj --spacing X | --counts NX,NY,NZ [--box x0,y0,z0,x1,y1,z1]
                        [--error X] [--out STEM] [--adapter NAME | --cpu]

Bakes the scene and gathers at a regular grid of probes in the air what arrives from all sides:
irradiance over the normal as spherical harmonics to order 2, nine coefficients a channel. Writes
STEM.probes.json and STEM.probes.csv, a line a probe. Probes in the cells of the box: those along x
follow one another, then rows along y, then layers along z. `inside` are those that see more backs
than all else: within solids or behind walls. docs/grids_and_probes.md has formulas and formats.

  --spacing X       edge of a cell, about, in the scene's unit
  --counts NX,NY,NZ cells along x, y and z
  --box …           lowest and highest corner [those of the scene]
  --out STEM        where the files go, and how they begin [the scene without its ending]; a folder
                    takes files of the scene's name
",
    light_usage!()
);

/// What is asked of the command.
struct Options {
    scene: PathBuf,
    light: LightOptions,
    cells: Cells,
    bounds: Option<Aabb>,
    stem: PathBuf,
}

/// How many probes there are.
enum Cells {
    Spacing(f64),
    Counts([usize; 3]),
}

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    args::check_writable(&options.file("csv"))?;
    let scene = options.light.scene(&options.scene)?;
    let grid = options.grid(&scene)?;
    let light = options.light.bake(scene)?;
    let probes = options.gather(&grid, &light)?.ok_or(Stop::Interrupted)?;
    let inside = probes.iter().filter(|probe| probe.is_inside()).count();
    let [x, y, z] = grid.counts;
    say!("{} probes, {x} by {y} by {z}, {inside} of them inside of something", probes.len());
    progress::of_writing(&options.file("json"), |path| {
        args::write_file(path, &json(&grid, &probes))
    })?;
    progress::of_writing(&options.file("csv"), |path| args::write_file(path, &csv(&probes)))?;
    progress::print_written();
    args::end()
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let (mut scenes, mut cells, mut bounds, mut out) = (vec![], None, None, None);
        let mut light = LightOptions::new();
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("spacing") => {
                    cells = Some(Cells::Spacing(args::value(parser, "spacing", "a length")?));
                }
                Long("counts") => {
                    let expected = "three whole numbers";
                    cells = Some(Cells::Counts(args::numbers(parser, "counts", expected)?));
                }
                Long("box") => {
                    let expected = "six numbers: the lowest and the highest corner";
                    let [a, b, c, d, e, f] = args::numbers(parser, "box", expected)?;
                    bounds = Some(Aabb { low: DVec3::new(a, b, c), high: DVec3::new(d, e, f) });
                }
                Long("out") => out = Some(PathBuf::from(parser.value()?)),
                Value(path) => scenes.push(path.into()),
                Long(name) => {
                    let name = name.to_string();
                    if !light.option(&name, parser)? {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                _ => return Err(arg.unexpected().into()),
            }
        }
        let scene = args::only_scene(scenes)?;
        let cells = cells.ok_or_else(|| Stop::usage("how many probes? --spacing or --counts"))?;
        let stem = args::stem(out, scene.with_extension(""), &["csv", "json"]);
        Ok(Options { scene, light, cells, bounds, stem })
    }

    fn file(&self, extension: &str) -> PathBuf {
        let mut name = self.stem.clone().into_os_string();
        name.push(format!(".probes.{extension}"));
        name.into()
    }

    fn grid(&self, scene: &Scene) -> Result<ProbeGrid, Error> {
        let bounds = self.bounds.unwrap_or_else(|| scene.bounds());
        match self.cells {
            Cells::Spacing(spacing) => ProbeGrid::with_spacing(&bounds, spacing),
            Cells::Counts(counts) => ProbeGrid::with_counts(&bounds, counts),
        }
    }

    /// The probes; none where Ctrl-C stopped it.
    fn gather(&self, grid: &ProbeGrid, light: &Light) -> Result<Option<Vec<Probe>>, Error> {
        let lit = &light.baked.light;
        let mut gatherer = light.device.gather_to_noise(lit, self.light.error())?;
        progress::of_count("probes", |report| {
            probes_at(lit, &grid.positions(), grid.size(), &mut *gatherer, |done, of| {
                report(done, of)?;
                interrupt::flow()
            })
        })
    }
}

/// All of it, with what the numbers mean.
fn json(grid: &ProbeGrid, probes: &[Probe]) -> Vec<u8> {
    let head = json!({
        "quantity": "irradiance over the unit normal n, W/m2 per channel: \
                     E(n) = sum of irradiance[k] * Y_k(n)",
        "basis": [
            "sqrt(1/pi)/2", "sqrt(3/pi)/2*y", "sqrt(3/pi)/2*z", "sqrt(3/pi)/2*x",
            "sqrt(15/pi)/2*x*y", "sqrt(15/pi)/2*y*z", "sqrt(5/pi)/4*(3*z*z-1)",
            "sqrt(15/pi)/2*x*z", "sqrt(15/pi)/4*(x*x-y*y)"
        ],
        "low": grid.low.to_array(),
        "spacing": grid.spacing.to_array(),
        "counts": grid.counts,
    });
    let probe = |probe: &Probe| {
        let coefficients = probe.irradiance.coefficients.map(|c| c.to_array());
        json!({
            "position": probe.position.to_array(),
            "inside": probe.is_inside(),
            "backs": probe.backface,
            "escaped": probe.escaped,
            "deviation": probe.deviation,
            "irradiance": coefficients,
        })
        .to_string()
    };
    // A line a probe, below the head.
    let head = head.to_string();
    let probes: Vec<String> = probes.iter().map(probe).collect();
    let open = head.strip_suffix('}').unwrap_or(&head);
    format!("{open},\"probes\":[\n{}\n]}}\n", probes.join(",\n")).into_bytes()
}

/// A line a probe, with a header.
fn csv(probes: &[Probe]) -> Vec<u8> {
    let mut out = b"x,y,z,inside,backs,escaped,deviation".to_vec();
    for k in 0..9 {
        out.extend(format!(",r{k},g{k},b{k}").bytes());
    }
    out.push(b'\n');
    for probe in probes {
        let [x, y, z] = probe.position.to_array();
        let inside = u8::from(probe.is_inside());
        let Probe { backface, escaped, deviation, .. } = probe;
        let start = format!("{x},{y},{z},{inside},{backface},{escaped},{deviation}");
        let numbers = probe.irradiance.coefficients.iter().flat_map(DVec3::to_array);
        let line: String = numbers.map(|number| format!(",{number}")).collect();
        out.extend(format!("{start}{line}\n").bytes());
    }
    out
}
