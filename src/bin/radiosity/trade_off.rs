//! `radiosity trade-off`: what a bake of a scene costs and how far it is off, over its settings, as
//! a table and a chart.
//!
//! ```text
//! Grid: settings to try ──> bake each ──> Measured: seconds, error against a Reference
//!                                              │
//!                      CSV: all runs; SVG and PNG: error over time;
//!                      summary: error targets against the best of the fixed settings
//! ```

mod chart;
mod face;
mod grid;
mod measure;
mod plot;
mod reference;
mod surface_points;
mod table;

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use grid::{Grid, Run, Target};
use lexopt::prelude::*;
use measure::Measured;
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, ErrorKind, Scene};
use reference::Reference;
use surface_points::SurfacePoints;

use crate::args::{self, Device, Stop};
use crate::scene_options::SceneOptions;
use crate::{interrupt, progress};

pub const USAGE: &str = "\
usage: radiosity trade-off SCENE.obj [--truth FILE] [--out STEM] [--quick]
            [--adapter NAME | --cpu]

Bakes SCENE with many settings, one knob at a time around those meant for 2 %, and with those that
the dial (an accuracy asked for) chooses. Measures time and error of each. Writes STEM.csv (a row a
run), STEM.svg and STEM.png (error over time), and prints what the dial's choices take against the
fastest settings that are as good. STEM is the scene without its ending and with _trade_off, unless
given.

  --truth FILE    a JSON file of points with their radiosity; errors are those at its points of
                  kind \"area\". Without it errors are against a run three times finer than the
                  finest, which has errors of its own, at 4096 places; gaps that nobody looks
                  into are left out
  --quick         fewer runs, none of them fine, around those meant for 5 %
  --strict        refuse what would be repaired in the file
  --max-reflectance X  what a reflectance of 1 or more becomes [0.98]
  --emit MATERIAL=r,g,b  this material emits this radiance; may be repeated
  --transmit MATERIAL=r,g,b  this material is translucent: this share of the light on either side
                    leaves diffusely from the other; may be repeated
  --sky r,g,b       radiance of a uniform sky around the scene, or none [1 if nothing emits];
                    for other skies and a sun see `radiosity bake --help`
  --sides WHICH     sides of surfaces that reflect: auto, those that light can reach, however they
                    are wound, front or both [auto]
  --specular WHICH  what mirrors and glass count as: clear, light passes glass, diffuse, their
                    diffuse part, black, or ignore [clear]
  --adapter NAME  a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --cpu           rays on the CPU instead of hemicubes

Seconds are those of the stages of a bake, the judging of its own error included; reading the file
and opening the device come once and do not count. Short runs are done three times, and the least
time is given; still, the machine should be idle. After Ctrl-C the
table of the runs that are done is written. Errors are root mean squares over the area, as
shares of the radiosity.";

/// What is asked of the command.
struct Options {
    scene: PathBuf,
    reading: SceneOptions,
    /// A file of points with their true radiosity.
    truth: Option<PathBuf>,
    /// Path of the output without its ending.
    out: PathBuf,
    quick: bool,
    device: Device,
}

/// All that was measured.
struct Results {
    grid: Grid,
    measured: Vec<Measured>,
    /// Fixed settings that no others are both faster and better than, by time; choices of an error
    /// target are not among them.
    front: Vec<usize>,
    reference: Reference,
    scene: String,
    adapter: String,
}

/// Runs shorter than this many seconds are timed [`ROUNDS`] times, and the least time counts: other
/// programs may use the machine too. Chosen by hand; no measurement kept.
const SHORT_RUN: f64 = 4.0;

/// How often short runs are timed.
const ROUNDS: u32 = 3;

/// The error of the run before all others, which compiles shaders and is not timed.
const WARM_UP_ERROR: f64 = 0.3;

/// How many times finer than the finest run the reference is, where there is no truth.
const REFERENCE_FINER: f64 = 3.0;

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    say!("{}", options.run()?.summary());
    args::end()
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let (mut scenes, mut truth, mut out) = (vec![], None, None);
        let (mut quick, mut device) = (false, Device::Gpu(None));
        let mut reading = SceneOptions::default();
        while let Some(arg) = parser.next()? {
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("truth") => truth = Some(parser.value()?.into()),
                Long("out") => out = Some(parser.value()?.into()),
                Long("quick") => quick = true,
                Long("adapter") => device = Device::named(parser)?,
                Long("cpu") => device = Device::Cpu,
                Value(path) => scenes.push(path.into()),
                Long(name) => {
                    let name = name.to_string();
                    if !reading.option(&name, parser)? {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                _ => return Err(arg.unexpected().into()),
            }
        }
        let scene = args::only_scene(scenes)?;
        let mut stem = scene.with_extension("").into_os_string();
        stem.push("_trade_off");
        let out = args::stem(out, stem.into(), &["csv", "svg", "png"]);
        Ok(Options { scene, reading, truth, out, quick, device })
    }

    fn run(&self) -> Result<Results, Error> {
        args::check_writable(&self.out)?;
        let truth = self.read_truth()?;
        let scene = progress::of_reading(&self.scene, || self.reading.load(&self.scene))?;
        let scene = Arc::new(scene);
        self.reading.print_warnings(&scene);
        let device = self.device.open()?;
        let mut grid = Grid::new(&scene, self.quick);
        interrupt::catch();
        BakeSettings::for_error(WARM_UP_ERROR, &scene).bake(scene.clone(), &device, go)?;
        let reference = match truth {
            Some(truth) => truth,
            None => finest_run(&grid, &scene, &device)?,
        };
        let measured = self.measure(&grid, &reference, &scene, &device)?;
        grid.runs.truncate(measured.len());
        let results = Results {
            front: front(&grid.runs, &measured),
            grid,
            measured,
            reference,
            scene: self.scene.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            adapter: device.adapter().name,
        };
        if !results.measured.is_empty() {
            self.write("csv", results.csv().as_bytes())?;
        }
        if interrupt::stopped() {
            let runs = results.measured.len();
            eprintln!("stopped: the table has {runs} of the runs; no chart is drawn of a part");
            return Ok(results);
        }
        self.write("svg", chart::svg(&results).map_err(|e| self.bad_chart(&e))?.as_bytes())?;
        self.write("png", &chart::png(&results).map_err(|e| self.bad_chart(&e))?)?;
        Ok(results)
    }

    /// Bakes and measures every run of `grid`.
    fn measure(
        &self,
        grid: &Grid,
        reference: &Reference,
        scene: &Arc<Scene>,
        device: &Backend,
    ) -> Result<Vec<Measured>, Error> {
        let (count, start) = (grid.runs.len(), Instant::now());
        let mut all: Vec<Measured> = vec![];
        for (k, Run { knob, value, target }) in grid.runs.iter().enumerate() {
            eprint!("run {} of {count}: {knob} {value}", k + 1);
            let baked = bake(target, scene, device)?;
            if interrupt::stopped() {
                eprintln!(": stopped");
                return Ok(all);
            }
            let one = Measured::new(&baked, reference).map_err(|found| self.bad_truth(&found))?;
            eprintln!(": {:.2} s, error {:.2} %", one.seconds, 100.0 * one.errors.area);
            all.push(one);
        }
        for round in 1..ROUNDS {
            eprintln!("short runs again, {} of {ROUNDS} times", round + 1);
            for (run, one) in grid.runs.iter().zip(&mut all) {
                if one.seconds < SHORT_RUN {
                    let seconds = bake(&run.target, scene, device)?.timings.total();
                    if interrupt::stopped() {
                        return Ok(all);
                    }
                    one.seconds = one.seconds.min(seconds);
                }
            }
        }
        eprintln!("all runs took {:.0} s", start.elapsed().as_secs_f64());
        Ok(all)
    }

    fn read_truth(&self) -> Result<Option<Reference>, Error> {
        let Some(path) = &self.truth else { return Ok(None) };
        let text = std::fs::read_to_string(path).map_err(|e| {
            let place = path.display().to_string();
            Error::new(ErrorKind::File, place, e.to_string(), "give a file that can be read")
                .with_source(e)
        })?;
        Reference::truth(&text).map(Some).map_err(|found| self.bad_truth(&found))
    }

    fn bad_truth(&self, found: &str) -> Error {
        let path = self.truth.as_deref().unwrap_or(&self.scene);
        let remedy = "give points as in tests/data/cornell_box.truth.json, of this scene";
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy)
    }

    fn bad_chart(&self, found: &str) -> Error {
        let remedy = "the table of all runs has been written";
        Error::new(ErrorKind::File, format!("chart {}", self.out.display()), found, remedy)
    }

    fn write(&self, ending: &str, bytes: &[u8]) -> Result<(), Error> {
        let path = self.out.with_added_extension(ending);
        args::write_file(&path, bytes)?;
        eprintln!("wrote {}", path.display());
        Ok(())
    }
}

/// A run finer than all of `grid`, to compare them with.
fn finest_run(grid: &Grid, scene: &Arc<Scene>, device: &Backend) -> Result<Reference, Error> {
    let error = grid.finest / REFERENCE_FINER;
    eprintln!("for reference: settings meant for {}", grid::percent(error));
    let mut settings = BakeSettings::for_error(error, scene);
    if let Some(gather) = &mut settings.gather {
        gather.refinement.gather_passes += 1;
    }
    let baked = settings.bake(scene.clone(), device, go)?;
    Ok(Reference::Finest(SurfacePoints::new(&baked.light, device)?))
}

fn bake(target: &Target, scene: &Arc<Scene>, device: &Backend) -> Result<BakeResult, Error> {
    match target {
        Target::Settings(settings) => settings.bake(scene.clone(), device, go),
        Target::Error(error) => BakeTarget::Error(*error).bake(scene.clone(), device, go),
    }
}

/// Progress that stops the work on Ctrl-C.
fn go<T>(_: &T) -> ControlFlow<()> {
    interrupt::flow()
}

/// Fixed settings that no others are both faster and better than, by time.
fn front(runs: &[Run], measured: &[Measured]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..runs.len()).filter(|&k| matches!(runs[k].target, Target::Settings(_))).collect();
    order.sort_by(|&a, &b| measured[a].seconds.total_cmp(&measured[b].seconds));
    let mut least = f64::INFINITY;
    order.retain(|&k| {
        let better = measured[k].errors.area < least;
        least = least.min(measured[k].errors.area);
        better
    });
    order
}
