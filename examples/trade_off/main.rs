//! What a bake of a scene costs and how far it is off, over its settings: a table and a picture to
//! choose from.
//!
//!     cargo run --release --example trade_off -- SCENE.obj [options]

mod grid;
mod measure;
mod picture;
mod plot;
#[path = "../support/mod.rs"]
mod support;
#[path = "../../tests/common/truth.rs"]
mod truth;

use std::ffi::OsString;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use grid::{Ask, Grid, Run};
use lexopt::prelude::*;
use measure::{Judge, Measured, Places};
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, ErrorKind, Scene, load_obj};
use support::Choice;

const USAGE: &str = "\
usage: trade_off SCENE.obj [--truth FILE] [--out STEM] [--quick] [--adapter NAME | --cpu]

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
  --adapter NAME  a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --cpu           rays on the CPU instead of hemicubes

Seconds are those of the stages of a bake, the judging of its own error included; reading the file
and opening the device come once and do not count. Short runs are done three times, and the least
time is given; still, the machine should be idle. Errors are root mean squares over the area, as
shares of the radiosity.";

struct Options {
    scene: PathBuf,
    truth: Option<PathBuf>,
    out: PathBuf,
    quick: bool,
    device: Choice,
}

fn main() -> ExitCode {
    let options = match parse(lexopt::Parser::from_env()) {
        Ok(Some(options)) => options,
        Ok(None) => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(e) => {
            eprintln!("error: {e}\n\n{USAGE}");
            return ExitCode::from(2);
        }
    };
    match options.run() {
        Ok(table) => {
            println!("{table}");
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// The options given, or `None` for help.
fn parse(mut args: lexopt::Parser) -> Result<Option<Options>, lexopt::Error> {
    let mut scene: Option<OsString> = None;
    let (mut truth, mut out, mut quick, mut device) = (None, None, false, Choice::Gpu(None));
    while let Some(arg) = args.next()? {
        match arg {
            Long("help") | Short('h') => return Ok(None),
            Long("truth") => truth = Some(args.value()?.into()),
            Long("out") => out = Some(args.value()?.into()),
            Long("quick") => quick = true,
            Long("adapter") => device = Choice::Gpu(Some(args.value()?.string()?)),
            Long("cpu") => device = Choice::Cpu,
            Value(path) if scene.is_none() => scene = Some(path),
            _ => return Err(arg.unexpected()),
        }
    }
    let scene = PathBuf::from(scene.ok_or("no scene given")?);
    let out = out.unwrap_or_else(|| {
        let mut stem = scene.with_extension("").into_os_string();
        stem.push("_trade_off");
        stem.into()
    });
    Ok(Some(Options { scene, truth, out, quick, device }))
}

/// All that was found out.
struct Found {
    grid: Grid,
    measured: Vec<Measured>,
    /// Fixed settings that none are both faster and better than, by time; the dial's own choices are
    /// not among them.
    front: Vec<usize>,
    judge: Judge,
    scene: String,
    adapter: String,
}

impl Options {
    fn run(&self) -> Result<String, Error> {
        support::writable(&self.out)?;
        let truth = self.read_truth()?;
        let scene = Arc::new(load_obj(&self.scene)?);
        scene.warnings().iter().for_each(|warning| eprintln!("warning: {warning}"));
        let device = self.device.open()?;
        let grid = Grid::new(&scene, self.quick);
        // Whatever comes once, such as shaders, is not to count.
        bake(&Ask::Settings(Box::new(BakeSettings::for_error(0.3, &scene))), &scene, &device)?;
        let judge = match truth {
            Some(truth) => truth,
            None => {
                let finest = grid.finest / 3.0;
                eprintln!("for reference: settings meant for {}", grid::percent(finest));
                let mut settings = BakeSettings::for_error(finest, &scene);
                settings.gather.iter_mut().for_each(|gather| gather.refinement.sweeps += 1);
                let baked = bake(&Ask::Settings(Box::new(settings)), &scene, &device)?;
                Judge::Finest(Places::on(&baked.light, &device)?)
            }
        };
        let (count, start) = (grid.runs.len(), Instant::now());
        let mut measured: Vec<Measured> = vec![];
        for (k, Run { knob, value, ask }) in grid.runs.iter().enumerate() {
            eprint!("run {} of {count}: {knob} {value}", k + 1);
            let baked = bake(ask, &scene, &device)?;
            let one = Measured::new(&baked, &judge).map_err(|found| self.bad_truth(&found))?;
            eprintln!(": {:.2} s, error {:.2} %", one.seconds, 100.0 * one.errors.area);
            measured.push(one);
        }
        for round in 1..ROUNDS {
            eprintln!("short runs again, {} of {ROUNDS} times", round + 1);
            for (Run { ask, .. }, one) in grid.runs.iter().zip(&mut measured) {
                if one.seconds < SHORT {
                    one.seconds = one.seconds.min(measure::seconds(&bake(ask, &scene, &device)?));
                }
            }
        }
        eprintln!("all runs took {:.0} s", start.elapsed().as_secs_f64());
        let name = self.scene.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let adapter = device.adapter()[0].clone();
        let front = front(&grid.runs, &measured);
        let found = Found { grid, measured, front, judge, scene: name, adapter };
        self.write("csv", found.csv().into())?;
        self.write("svg", picture::svg(&found).map_err(|e| self.bad_picture(&e))?.into())?;
        let png = picture::png(&found).map_err(|e| self.bad_picture(&e))?;
        self.write("png", png)?;
        Ok(found.table())
    }

    fn read_truth(&self) -> Result<Option<Judge>, Error> {
        let Some(path) = &self.truth else { return Ok(None) };
        let text = std::fs::read_to_string(path).map_err(|e| {
            let place = path.display().to_string();
            Error::new(ErrorKind::File, place, e.to_string(), "give a file that can be read")
                .with_source(e)
        })?;
        Judge::truth(&text).map(Some).map_err(|found| self.bad_truth(&found))
    }

    fn bad_truth(&self, found: &str) -> Error {
        let path = self.truth.as_deref().unwrap_or(&self.scene);
        let remedy = "give points as in tests/data/cornell_box.truth.json, of this scene";
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy)
    }

    fn bad_picture(&self, found: &str) -> Error {
        let remedy = "the table of all runs has been written";
        Error::new(ErrorKind::File, format!("picture {}", self.out.display()), found, remedy)
    }

    fn write(&self, ending: &str, bytes: Vec<u8>) -> Result<(), Error> {
        let path = self.out.with_added_extension(ending);
        std::fs::write(&path, bytes).map_err(|e| {
            let remedy = "choose a folder that exists and can be written";
            Error::new(ErrorKind::File, path.display().to_string(), e.to_string(), remedy)
                .with_source(e)
        })?;
        eprintln!("wrote {}", path.display());
        Ok(())
    }
}

/// Runs below this many seconds are timed so many times, and the least counts: others may use the
/// machine too.
const SHORT: f64 = 4.0;
const ROUNDS: u32 = 3;

fn bake(ask: &Ask, scene: &Arc<Scene>, device: &Backend) -> Result<BakeResult, Error> {
    match ask {
        Ask::Settings(settings) => {
            settings.bake(scene.clone(), device, |_| ControlFlow::Continue(()))
        }
        Ask::Dial(error) => {
            BakeTarget::Error(*error).bake(scene.clone(), device, |_| ControlFlow::Continue(()))
        }
    }
}

/// Fixed settings that none are both faster and better than, by time.
fn front(runs: &[Run], measured: &[Measured]) -> Vec<usize> {
    let mut order: Vec<usize> =
        (0..runs.len()).filter(|&k| matches!(runs[k].ask, Ask::Settings(_))).collect();
    order.sort_by(|&a, &b| measured[a].seconds.total_cmp(&measured[b].seconds));
    let mut least = f64::INFINITY;
    order.retain(|&k| {
        let better = measured[k].errors.area < least;
        least = least.min(measured[k].errors.area);
        better
    });
    order
}

impl Found {
    /// The fastest fixed settings whose error is no larger than that of run `k`.
    fn as_good(&self, k: usize) -> Option<usize> {
        let error = self.measured[k].errors.area;
        self.front.iter().copied().find(|&f| self.measured[f].errors.area <= error)
    }

    fn csv(&self) -> String {
        let mut out = String::from(
            "knob,value,element_size,contacts,hemicube,rotations,near,unshot,patch_tolerance,gather,\
             gather_size,gather_contacts,rays,bend,curve,smallest,sweeps,bake_seconds,error_over_area,\
             error_all_points,error_against,estimate,vertices,shot_elements,elements,hemicubes,\
             gathers,on_front\n",
        );
        for (k, (run, m)) in self.grid.runs.iter().zip(&self.measured).enumerate() {
            let e = &m.settings;
            let gather = e.gather.as_ref().map_or("none,,,,,,,".to_string(), |g| {
                let s = &g.refinement;
                let (size, contacts, rays) = (g.element_size, g.contact_levels, g.rays);
                let (bend, curve) = (s.tolerance, s.curve);
                let (smallest, sweeps) = (s.smallest, s.sweeps);
                format!("needed,{size:.6},{contacts},{rays},{bend},{curve},{smallest:.6},{sweeps}")
            });
            let all = m.errors.all.map_or(String::new(), |all| format!("{all:.6}"));
            let _ = writeln!(
                out,
                "{},{},{:.6},{},{},{},{},{},{},{gather},{:.4},{:.6},{all},{},{:.6},{},{},{},{},{},{}",
                run.knob,
                run.value,
                e.solve.element_size,
                e.solve.contact_levels,
                e.solve.hemicube_resolution,
                e.solve.rotations,
                e.solve.near_reach,
                e.solve.solver.unshot,
                e.solve.solver.patch_tolerance,
                m.seconds,
                m.errors.area,
                self.judge.name(),
                m.estimate,
                m.vertices,
                m.shot_elements,
                m.elements,
                m.hemicubes,
                m.gathers,
                u8::from(self.front.contains(&k))
            );
        }
        out
    }

    /// The dial against the front.
    fn table(&self) -> String {
        let mut out = format!(
            "{:>6} {:>9} {:>9} {:>9} | {:>9} {:>9} {:>7}  {}\n",
            "asked", "measured", "estimate", "seconds", "fastest s", "its error", "ratio", "by"
        );
        for (k, (run, m)) in self.grid.runs.iter().zip(&self.measured).enumerate() {
            let Ask::Dial(error) = run.ask else { continue };
            let _ = write!(
                out,
                "{:>6} {:>8.2}% {:>8.2}% {:>9.2} | ",
                grid::percent(error),
                100.0 * m.errors.area,
                100.0 * m.estimate,
                m.seconds
            );
            let _ = match self.as_good(k) {
                Some(best) => {
                    let (b, r) = (&self.measured[best], &self.grid.runs[best]);
                    let (seconds, error) = (b.seconds, 100.0 * b.errors.area);
                    let ratio = m.seconds / seconds;
                    let (knob, value) = (r.knob, &r.value);
                    writeln!(out, "{seconds:>9.2} {error:>8.2}% {ratio:>7.2}  {knob} {value}")
                }
                None => writeln!(out, "no fixed settings are as good"),
            };
        }
        out.push_str(
            "ratio: the dial's time over that of the fastest fixed settings with no larger error",
        );
        out
    }
}
