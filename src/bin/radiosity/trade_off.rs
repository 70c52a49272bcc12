//! `radiosity trade-off`: what a bake of a scene costs and how far it is off, over its settings, as
//! a table and a chart.
//!
//! ```text
//! runs: settings to try ──> bake each ──> Measured: seconds, error at points that are path traced
//!                                              │    once, with the finest run
//!                        CSV and text: all runs; PNG: error over time
//! ```

mod plot;
mod runs;
mod table;

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use radiosity::accuracy::Measure;
use radiosity::verify::{Estimate, Settings, Verification, Verifier};
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, ErrorKind, Scene};
use runs::{Run, Target};

use crate::args::{self, DeviceOptions, MeasureOptions, Output, Stop, value};
use crate::scene_options::{Input, SceneOptions};
use crate::{interrupt, progress, standard};

/// Measures time and error of bakes of a scene, over their settings
#[derive(Args)]
#[command(after_help = "\
Bakes the scene with many settings, one varied at a time around those for an error of 2 %, and to \
errors that are asked for. Writes STEM.csv (a row a run) and STEM.png (error over time), and \
prints the runs by time. Seconds are those of the stages of a bake and of the estimate of its \
error, without reading the file and opening the device; short runs are timed three times, and the \
least time counts. Errors are measured as `radiosity verify` does, all at the same points: these \
are path traced once, until the error of the finest run is known well enough, or for 120 s. \
After Ctrl-C the table of the finished runs is written. STEM is the scene's path and _trade_off \
unless --out gives another.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    #[command(flatten)]
    measure: MeasureOptions,
    /// Standard error at which there are enough points and paths, as a share of the error of the
    /// finest run
    #[arg(long, value_name = "X", default_value = "0.1", value_parser = value::<f64>("a number"))]
    precision: f64,
    /// Fewer and coarser runs, around the settings for 5 %
    #[arg(long)]
    quick: bool,
    #[command(flatten)]
    output: Output,
    #[command(flatten)]
    reading: SceneOptions,
    #[command(flatten)]
    device: DeviceOptions,
}

/// What came out of one bake.
struct Measured {
    /// All stages of the bake; neither reading the file nor opening the device.
    seconds: f64,
    /// By the measure.
    error: Estimate,
    /// The plain root mean square: with the tail.
    error_with_tail: Estimate,
    /// The error that the bake itself estimates.
    estimated: f64,
    vertices: usize,
    /// The settings used in the end.
    settings: BakeSettings,
}

/// All that was measured.
struct Results {
    runs: Vec<(Run, Measured)>,
    /// Indices of the fixed settings that no others are both faster and better than, by time.
    front: Vec<usize>,
    measure: Measure,
    scene: String,
    adapter: String,
}

/// What bakes are made of and with.
struct Bench {
    scene: Arc<Scene>,
    device: Backend,
    measure: Measure,
}

impl Options {
    /// Runs the command.
    pub fn run(mut self) -> Result<(), Stop> {
        let mut stem = standard::stem(&self.scene).into_os_string();
        stem.push("_trade_off");
        self.output.name(stem.into(), &["csv", "png"])?;
        let Input { scene, .. } = self.reading.read(&self.scene)?;
        let results = self.results(Arc::new(scene))?;
        if !results.runs.is_empty() {
            say!("{}", results.text());
            self.output.write("csv", &results.csv());
        }
        if interrupt::stopped() {
            eprintln!("stopped: the table has the runs that were finished; there is no chart");
        } else {
            let bad = |found| {
                let remedy = "the table of all runs has been written";
                Error::new(ErrorKind::File, "the chart", found, remedy)
            };
            self.output.write("png", &results.png().map_err(bad)?);
        }
        progress::print_written();
        args::end()
    }

    fn results(&self, scene: Arc<Scene>) -> Result<Results, Error> {
        let measure = self.measure.measure();
        let mut settings = Settings::default();
        settings.measure = measure;
        settings.precision = self.precision;
        let mut verifier = Verifier::new(&scene, &settings)?;
        let runs = runs::runs(&scene, self.quick);
        let bench = Bench { scene: scene.clone(), device: self.device.open()?, measure };
        interrupt::catch();
        // Compiles shaders, and is not timed.
        bench.bake("warming up", &Target::Error(0.3))?;
        let runs = bench.measure_all(runs, &mut verifier)?;
        Ok(Results {
            front: front(&runs),
            runs,
            measure,
            scene: self.scene.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            adapter: bench.device.adapter().name,
        })
    }
}

impl Bench {
    /// All `runs`, or those before Ctrl-C, with what was measured. The first adds the points at
    /// which all are measured.
    fn measure_all(
        &self,
        runs: Vec<Run>,
        verifier: &mut Verifier,
    ) -> Result<Vec<(Run, Measured)>, Error> {
        let (count, mut all) = (runs.len(), vec![]);
        for (k, run) in runs.into_iter().enumerate() {
            let name = format!("run {} of {count}: {}", k + 1, run.name());
            let baked = self.bake(&name, &run.target)?;
            let surface = &baked.light.surface;
            let found = match k {
                0 => progress::of_count("points", |report| {
                    verifier.measure(surface, |progress| report(progress.done, progress.of))
                }),
                _ => verifier.measure_at_same_points(surface),
            }?;
            if interrupt::stopped() {
                return Ok(all);
            }
            let one = Measured::new(&baked, &found);
            eprintln!("{name}: {:.2} s, error {:.2} %", one.seconds, 100.0 * one.error.value);
            all.push((run, one));
        }
        let rounds = 3;
        for round in 1..rounds {
            let name = format!("short runs again, {} of {rounds} times", round + 1);
            eprintln!("{name}");
            // Other programs may use the machine too: the least time of a short run counts.
            for (run, one) in all.iter_mut().filter(|(_, one)| one.seconds < 4.0) {
                let seconds = self.bake(&name, &run.target)?.timings.total();
                if interrupt::stopped() {
                    return Ok(all);
                }
                one.seconds = one.seconds.min(seconds);
            }
        }
        Ok(all)
    }

    /// Bakes with `name` shown; Ctrl-C stops it.
    fn bake(&self, name: &str, target: &Target) -> Result<BakeResult, Error> {
        let (scene, go) = (self.scene.clone(), |_: &_| interrupt::flow());
        progress::of_stage(name, || match target {
            Target::Settings(settings) => {
                let mut settings = settings.clone();
                settings.measure = self.measure;
                settings.bake(scene, &self.device, go)
            }
            Target::Error(error) => {
                let by_measure = |settings: &mut BakeSettings| settings.measure = self.measure;
                BakeTarget::Error(*error).bake_with(scene, &self.device, by_measure, go)
            }
        })
    }
}

impl Measured {
    fn new(baked: &BakeResult, found: &Verification) -> Measured {
        Measured {
            seconds: baked.timings.total(),
            error: found.error.unwrap_or_default(),
            error_with_tail: found.error_with_tail.unwrap_or_default(),
            estimated: baked.estimate.total,
            vertices: baked.light.surface.positions.len(),
            settings: baked.settings.clone(),
        }
    }

    /// The error, or its standard error where that is larger: a smaller error is not distinguished
    /// from it.
    fn known_error(&self) -> f64 {
        self.error.value.max(self.error.standard_error).max(1e-6)
    }
}

/// Indices of the fixed settings that no others are both faster and better than, by time.
fn front(runs: &[(Run, Measured)]) -> Vec<usize> {
    let is_fixed = |&k: &usize| runs[k].0.target.error().is_none();
    let mut order: Vec<usize> = (0..runs.len()).filter(is_fixed).collect();
    order.sort_by(|&a, &b| runs[a].1.seconds.total_cmp(&runs[b].1.seconds));
    let mut least = f64::INFINITY;
    order.retain(|&k| {
        let error = runs[k].1.known_error();
        let better = error < least;
        least = least.min(error);
        better
    });
    order
}
