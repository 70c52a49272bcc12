//! `radiosity verify`: how far off a solution is, by path tracing the user's own scene.

mod points;
mod verdict;

use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use lexopt::prelude::*;
use radiosity::verify::{Estimate, GroupError, Settings, Stop as Reason, Verification, verify};
use radiosity::{Error, ErrorKind, Rgb, Scene, VertexMesh, read_ply};
use serde_json::{Value as Json, json};

use crate::args::{self, Stop};
use crate::bake::files::estimated_error;
use crate::scene_options::SceneOptions;
use crate::{interrupt, progress};
use points::Points;
use verdict::verdict;

pub const USAGE: &str = "\
usage: radiosity verify SCENE.obj SOLUTION.ply [--precision X] [--time SECONDS] [--places N]
                    [--hidden] [--seed N] [--csv FILE] [--points-ply FILE]
       radiosity verify SCENE.obj --points FILE.json [--paths N] [--seed N] [--csv FILE]

Measures how far off SOLUTION.ply is, independently of what made it: path traces SCENE.obj at random
points of its surfaces, and prints for each group, and for all, the root mean square over the area
of |B - true B| / max(|true B|, 5 % of its mean): B is the reflected radiosity, lengths are over
the channels. Beside it stands what the bake told, from SOLUTION.json, if that is there, and the
last line compares the two. After Ctrl-C what was measured so far is printed.

  --precision X     go on until the standard error is below this share of the error [0.1]
  --time SECONDS    begin no round that would end later; inf for no limit [120]
  --places N        points that each group has at least [16]
  --hidden          count what nobody sees too: points that look at backs of surfaces, as the
                    ground under a box or a wall right behind a plate; said, and left out if not
  --seed N          another seed, other points and paths [0]
  --csv FILE        write the table, all groups, as CSV
  --strict          refuse what would be repaired in the file
  --max-reflectance X  what a reflectance of 1 or more becomes [0.98]
  --emit MATERIAL=r,g,b  this material emits this radiance; may be repeated (as the bake had)
  --transmit MATERIAL=r,g,b  this material lets this share through (as the bake had)
  --sky r,g,b       radiance of a uniform sky, or none; another sky, a sun and luminaires are given
                    by the options that the bake had, those of `radiosity bake --help`
  --sides WHICH     auto, front or both (as the bake had) [auto]
  --specular WHICH  clear, diffuse, black or ignore (as the bake had) [clear]
  --points-ply FILE write the points, with error and radiosity, coloured from blue (none) over green
                    (the error of all) to red (four times that or more), grey where hidden
Radiosity at given points, to judge this instrument itself:
  --points FILE     JSON: {\"points\": [{\"p\": [x,y,z], \"n\": [x,y,z]}, …]}; where \"B\" is given,
                    radiosity, and \"se\", its standard error, prints how far the paths are off in
                    units of the standard error of both; with --csv writes radiosity and standard
                    error
  --paths N         paths a point [65536]";

/// Groups in the printed table at most.
const MAX_PRINTED: usize = 20;

/// Paths a point for given points, where no number is asked for.
const DEFAULT_PATHS: usize = 65536;

/// What is asked of the command.
struct Options {
    scene: PathBuf,
    reading: SceneOptions,
    settings: Settings,
    csv: Option<PathBuf>,
    what: What,
}

enum What {
    Solution { ply: PathBuf, points_ply: Option<PathBuf> },
    Points { json: PathBuf, paths: usize },
}

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser) -> Result<(), Stop> {
    let options = Options::parse(parser)?;
    options.run()?;
    args::end()
}

impl Options {
    fn parse(parser: &mut lexopt::Parser) -> Result<Options, Stop> {
        let (mut files, mut csv, mut points_ply) = (vec![], None, None);
        let (mut points, mut paths) = (None, None);
        let (mut only_solution, mut settings) = (false, Settings::default());
        let mut reading = SceneOptions::default();
        while let Some(arg) = parser.next()? {
            only_solution |=
                matches!(arg, Long("precision" | "time" | "places" | "hidden" | "points-ply"));
            match arg {
                Long("help") | Short('h') => return Err(Stop::Help),
                Long("precision") => {
                    settings.precision = args::value(parser, "precision", "a number")?;
                }
                Long("time") => settings.time = time(parser)?,
                Long("places") => {
                    settings.points_per_group = args::value(parser, "places", "a whole number")?;
                }
                Long("hidden") => settings.hidden = true,
                Long("seed") => settings.seed = args::value(parser, "seed", "a whole number")?,
                Long("csv") => csv = Some(PathBuf::from(parser.value()?)),
                Long("points-ply") => points_ply = Some(PathBuf::from(parser.value()?)),
                Long("points") => points = Some(PathBuf::from(parser.value()?)),
                Long("paths") => {
                    let expected = "a whole number above 0";
                    paths = Some(args::value::<NonZeroUsize>(parser, "paths", expected)?);
                }
                Value(path) => files.push(PathBuf::from(path)),
                Long(name) => {
                    let name = name.to_string();
                    if !reading.option(&name, parser)? {
                        return Err(Long(&name).unexpected().into());
                    }
                }
                _ => return Err(arg.unexpected().into()),
            }
        }
        let what = match points {
            Some(json) => {
                if only_solution {
                    let options = "--precision, --time, --places, --hidden and --points-ply";
                    return Err(Stop::usage(format!("{options} are for a solution")));
                }
                What::Points { json, paths: paths.map_or(DEFAULT_PATHS, NonZeroUsize::get) }
            }
            None if paths.is_some() => return Err(Stop::usage("--paths is for --points")),
            None if files.len() < 2 => {
                return Err(Stop::usage("give an OBJ file and the PLY file of its solution"));
            }
            None => What::Solution { ply: files.remove(1), points_ply },
        };
        Ok(Options { scene: args::only_scene(files)?, reading, settings, csv, what })
    }

    fn run(&self) -> Result<(), Error> {
        let points_ply = match &self.what {
            What::Solution { points_ply, .. } => points_ply.as_ref(),
            What::Points { .. } => None,
        };
        for file in self.csv.iter().chain(points_ply) {
            args::check_writable(file)?;
        }
        let scene = progress::of_reading(&self.scene, || {
            Ok::<_, Error>(self.reading.load(&self.scene)?.resolve_sides())
        })?;
        self.reading.print_warnings(&scene);
        match &self.what {
            What::Solution { ply, points_ply } => self.verify(&scene, ply, points_ply.as_deref()),
            What::Points { json, paths } => {
                let points = Points::read(json)?;
                let traced = points.trace(&scene, *paths, self.settings.seed, json)?;
                say!("{}", traced.summary());
                self.csv.iter().try_for_each(|f| args::write_file(f, traced.csv().as_bytes()))
            }
        }
    }

    fn verify(&self, scene: &Scene, ply: &Path, points_ply: Option<&Path>) -> Result<(), Error> {
        let start = Instant::now();
        let solution = progress::of_reading(ply, || read_ply(ply))?;
        let told = Told::of(&solution, ply);
        told.check_sky(scene, self.reading.sky.words(scene), ply)?;
        told.check_luminaires(&self.reading.luminaires.report(), ply)?;
        interrupt::catch();
        let found = progress::of_count("points", |report| {
            verify(scene, &solution, &self.settings, |progress| {
                report(progress.done, progress.of)?;
                interrupt::flow()
            })
        })?;
        let lines = lines(scene, &found, &told);
        say!("{}", table(&lines));
        say!("{}", self.end(&found, start.elapsed()));
        if let Some(verdict) = verdict(told.total(), found.error) {
            say!("{verdict}");
        }
        if let Some(file) = &self.csv {
            args::write_file(file, csv(&lines).as_bytes())?;
        }
        points_ply
            .map_or(Ok(()), |file| args::write_file(file, points::coloured_ply(&found).as_bytes()))
    }

    /// How it ended, and what deserves a look.
    fn end(&self, found: &Verification, spent: Duration) -> String {
        let why = match (found.stop, self.settings.time) {
            (Reason::Precise, _) => {
                format!("known to {} % of itself", (100.0 * self.settings.precision) as f32)
            }
            (Reason::Negligible, _) => "negligible".into(),
            (Reason::Time, Some(time)) => {
                format!("less exact than asked for: the limit of {} s was hit", time.as_secs_f64())
            }
            (Reason::Cancelled, _) => "less exact than asked for: stopped".into(),
            (reason, _) => format!("less exact than asked for: {reason:?}").to_lowercase(),
        };
        let (points, paths) = (found.points.len(), found.paths);
        let mut end = format!(
            "{why}; {points} points, {paths} paths each, {:.1} s, seed {}",
            spent.as_secs_f64(),
            self.settings.seed
        );
        if found.hidden_share > 0.0 && !self.settings.hidden {
            let with_it = found.error_with_hidden.map_or(0.0, |error| error.value);
            let _ = write!(
                end,
                "\n{:.2} % of the area is hidden or sees next to nothing, and left out: with it \
                 the error is {:.2} %",
                100.0 * found.hidden_share,
                100.0 * with_it
            );
        }
        if found.missing > 0 {
            let _ = write!(
                end,
                "\n{} points lie on no face of the solution and were left out",
                found.missing
            );
        }
        end
    }
}

/// The limit of `--time`; none for inf.
fn time(parser: &mut lexopt::Parser) -> Result<Option<Duration>, Stop> {
    let expected = "seconds, such as 10, or inf";
    let seconds: f64 = args::value(parser, "time", expected)?;
    if seconds == f64::INFINITY {
        return Ok(None);
    }
    let time = Duration::try_from_secs_f64(seconds);
    time.map(Some).map_err(|_| args::wrong_value("time", &seconds.to_string(), expected))
}

/// Twice what an error is rounded by in the comment of a PLY file.
const COMMENT_ROUNDING: f64 = 1e-5;

/// What the report of a bake says of its error.
#[derive(Default)]
struct Told(Json);

impl Told {
    /// From the JSON file of the same name as `ply`, if it is of the same bake as the `solution`
    /// there; else what that says itself, if anything.
    fn of(solution: &VertexMesh, ply: &Path) -> Told {
        let file = ply.with_extension("json");
        let text = std::fs::read(&file).unwrap_or_default();
        let report = Told(serde_json::from_slice(&text).unwrap_or_default());
        let Some(own) = solution.comments.iter().find_map(|comment| estimated_error(comment))
        else {
            return report;
        };
        match report.total() {
            Some(total) if (total - own).abs() <= COMMENT_ROUNDING => return report,
            Some(total) => eprintln!(
                "warning: {} is of another bake, with an error of {:.2} %, for {:.2} % here: left \
                 aside",
                file.display(),
                100.0 * total,
                100.0 * own,
            ),
            None => (),
        }
        Told(json!({ "error": { "total": own } }))
    }

    /// Refuses a solution that was baked under another sky than that of `scene`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] with the sky that it was baked under.
    fn check_sky(&self, scene: &Scene, own: Option<String>, ply: &Path) -> Result<(), Error> {
        let (same, told) = match &self.0["sky"] {
            Json::String(words) => (own.as_ref() == Some(words), words.clone()),
            Json::Array(channels) => {
                let [r, g, b] =
                    [0, 1, 2].map(|k| channels.get(k).and_then(Json::as_f64).unwrap_or(0.0));
                let uniform = scene.sky().uniform_radiance().filter(|_| own.is_none());
                // Digits of a file may be rounded once more.
                let same = uniform.is_some_and(|radiance| {
                    Rgb::new(r, g, b).abs_diff_eq(radiance, 1e-12 * radiance.max_element())
                });
                (same, format!("{r},{g},{b}"))
            }
            _ => return Ok(()),
        };
        if same {
            return Ok(());
        }
        let found = format!("baked under a sky of {told}");
        let remedy = format!("verify it under the same: --sky {told}");
        Err(Error::new(ErrorKind::Setting, ply.display().to_string(), found, remedy))
    }

    /// Refuses a solution that was baked with other luminaires than `own`, those of the scene.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] with how many there were.
    fn check_luminaires(&self, own: &Json, ply: &Path) -> Result<(), Error> {
        let told = &self.0["luminaires"];
        let count = |list: &Json| list.as_array().map_or(0, Vec::len);
        if told.is_null() || told == own || count(told) + count(own) == 0 {
            return Ok(());
        }
        let found = format!("baked with {} luminaires, which are not these", count(told));
        let remedy = "verify it with the same: --luminaire and --luminaires as for the bake";
        Err(Error::new(ErrorKind::Setting, ply.display().to_string(), found, remedy))
    }

    fn total(&self) -> Option<f64> {
        self.0["error"]["total"].as_f64()
    }

    fn group(&self, name: &str) -> Option<f64> {
        let groups = self.0["error"]["groups"].as_array()?;
        groups.iter().find(|group| group["group"] == name)?["error"].as_f64()
    }
}

/// A line of the table.
struct Line {
    name: String,
    area_share: f64,
    hidden_share: f64,
    points: usize,
    told: Option<f64>,
    error: Option<Estimate>,
}

/// Groups, the worst first, and all together.
fn lines(scene: &Scene, found: &Verification, told: &Told) -> Vec<Line> {
    let line = |group: &GroupError| {
        let name = &scene.groups()[group.group];
        Line {
            name: name.clone(),
            area_share: group.area_share,
            hidden_share: group.hidden_share,
            points: group.points,
            told: told.group(name),
            error: group.error,
        }
    };
    let mut lines: Vec<Line> = found.groups.iter().map(line).collect();
    let key = |line: &Line| line.error.map_or(-1.0, |error| error.value);
    lines.sort_by(|a, b| key(b).total_cmp(&key(a)));
    lines.push(Line {
        name: "all".into(),
        area_share: 1.0,
        hidden_share: found.hidden_share,
        points: found.points.len(),
        told: told.total(),
        error: found.error,
    });
    lines
}

/// The table as text, cut after [`MAX_PRINTED`] groups.
fn table(lines: &[Line]) -> String {
    let Some((all, groups)) = lines.split_last() else { return String::new() };
    let (shown, rest) = groups.split_at(groups.len().min(MAX_PRINTED));
    let lengths = shown.iter().map(|line| line.name.chars().count());
    let width = lengths.max().unwrap_or(0).clamp(5, 40);
    let percent = |share: Option<f64>| share.map_or("–".into(), |x| format!("{:.2}", 100.0 * x));
    let row = |line: &Line| {
        let measured = line.error.map_or("–".into(), |Estimate { value, standard_error }| {
            format!("{:.2} ± {:.2}", 100.0 * value, 100.0 * standard_error)
        });
        let ratio = line.ratio().map_or("–".into(), |ratio| format!("{ratio:.2}"));
        let name: String = line.name.chars().take(width).collect();
        format!(
            "{name:<width$} {:>7.2} {:>8.2} {:>7} {:>7} {measured:>15} {ratio:>13}",
            100.0 * line.area_share,
            100.0 * line.hidden_share,
            line.points,
            percent(line.told)
        )
    };
    let mut out = format!(
        "{:<width$} {:>7} {:>8} {:>7} {:>7} {:>15} {:>13}\n",
        "group", "area %", "hidden %", "points", "told %", "measured %", "told/measured"
    );
    shown.iter().for_each(|line| out += &(row(line) + "\n"));
    if !rest.is_empty() {
        let _ = writeln!(out, "{} groups more, none measured worse", rest.len());
    }
    out + &row(all)
}

/// The table as CSV, errors as shares.
fn csv(lines: &[Line]) -> String {
    let mut out =
        "group,area_share,points,told,measured,standard_error,told/measured\n".to_string();
    let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
    for line in lines {
        let quoted = format!("\"{}\"", line.name.replace('"', "\"\""));
        let name = if line.name.contains([',', '"', '\n', '\r']) { &quoted } else { &line.name };
        let _ = writeln!(
            out,
            "{name},{},{},{},{},{},{},{}",
            line.area_share,
            line.hidden_share,
            line.points,
            number(line.told),
            number(line.error.map(|error| error.value)),
            number(line.error.map(|error| error.standard_error)),
            number(line.ratio())
        );
    }
    out
}

impl Line {
    /// What was told over what was measured, where that is not zero.
    fn ratio(&self) -> Option<f64> {
        let measured = self.error.map(|error| error.value).filter(|&value| value > 0.0)?;
        Some(self.told? / measured)
    }
}
