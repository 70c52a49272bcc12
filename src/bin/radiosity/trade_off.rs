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

use clap::Args;
use grid::{Grid, Run, Target};
use measure::Measured;
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, ErrorKind, Scene};
use reference::Reference;
use surface_points::SurfacePoints;

use crate::args::{self, DeviceOptions, Stop};
use crate::interrupt;
use crate::scene_options::{Input, SceneOptions};

/// Measures time and error of bakes of a scene, over their settings
#[derive(Args)]
#[command(after_help = "\
Bakes the scene with many settings, one varied at a time around those for an error of 2 %, and to \
errors that are asked for. Writes STEM.csv (a row a run), STEM.svg and STEM.png (error over time), \
and prints the time of a bake to an error beside that of the fastest settings that are as exact. \
Seconds are those of the stages of a bake and of the estimate of its error, without reading the \
file and opening the device; short runs are timed three times, and the least time counts. Errors \
are root mean squares over the area, as shares of radiosity. After Ctrl-C the table of the \
finished runs is written.")]
pub struct Options {
    /// Scene, an OBJ file
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    /// Points with their radiosity, a JSON file; errors are those at its points of kind "area"
    /// [default: a run three times finer than the finest, at 4096 points, without narrow gaps]
    #[arg(long, value_name = "FILE.json")]
    truth: Option<PathBuf>,
    /// Fewer and coarser runs, around the settings for 5 %
    #[arg(long)]
    quick: bool,
    /// Path of the files without their endings, or a folder for them [default: the scene without
    /// its ending, and _trade_off]
    #[arg(short, long, value_name = "STEM")]
    out: Option<PathBuf>,
    #[command(flatten)]
    reading: SceneOptions,
    #[command(flatten)]
    device: DeviceOptions,
    /// Path of the files without their endings.
    #[arg(skip)]
    stem: PathBuf,
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

impl Options {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        let mut stem = self.scene.with_extension("").into_os_string();
        stem.push("_trade_off");
        let formats = [("csv", ()), ("svg", ()), ("png", ())];
        self.stem = args::stem(self.out.take(), stem.into(), &formats);
        say!("{}", self.results()?.summary());
        args::end()
    }

    fn results(&self) -> Result<Results, Error> {
        args::check_writable(&self.stem)?;
        let truth = self.read_truth()?;
        let Input { scene, .. } = self.reading.read(&self.scene)?;
        let scene = Arc::new(scene);
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
        Error::new(ErrorKind::File, format!("chart {}", self.stem.display()), found, remedy)
    }

    fn write(&self, ending: &str, bytes: &[u8]) -> Result<(), Error> {
        let path = self.stem.with_added_extension(ending);
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
