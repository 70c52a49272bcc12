//! `radiosity verify`: how far off a solution is, by path tracing the user's own scene.

mod points;
mod verdict;

use std::fmt::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use radiosity::verify::{Estimate, GroupError, Settings, Stop as Reason, Verification, verify};
use radiosity::{Error, ErrorKind, Rgb, Scene, VertexMesh, read_ply};
use serde_json::{Value as Json, json};

use crate::args::{self, MeasureOptions, Parsed, Stop, give, value};
use crate::bake::files::estimated_error;
use crate::luminaires::Luminaires;
use crate::scene_options::{Input, SceneOptions};
use crate::{interrupt, progress};
use points::Points;
use verdict::verdict;

/// Measures the error of a solution of a scene, by path tracing
#[derive(Args)]
#[command(after_help = "\
Path traces the scene at random points of its surfaces and prints for each group, and for all, the \
root mean square over the area, less its tail, of |B - true B| / max(|true B|, 5 % of its mean): B \
is reflected radiosity, lengths are over the channels. Beside it is the error that SOLUTION.json \
has, the \
report of the bake, where there is one; the last line compares them. The options of the scene and \
its light have to be those of the bake. After Ctrl-C the points so far count.")]
pub struct Options {
    /// Scene: OBJ, glTF or STL
    #[arg(value_name = "SCENE.obj")]
    scene: PathBuf,
    /// Radiosity at vertices, a PLY file
    #[arg(value_name = "SOLUTION.ply", required_unless_present = "points")]
    solution: Option<PathBuf>,
    /// Standard error at which the measurement ends, as a share of the error
    #[arg(long, value_name = "X", default_value = "0.1", value_parser = value::<f64>("a number"))]
    precision: f64,
    /// Begin no round that would end after this time; inf for no limit
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = time)]
    time: Limit,
    #[command(flatten)]
    measure: MeasureOptions,
    /// Minimum number of points in each group
    #[arg(long, value_name = "N", default_value = "16")]
    #[arg(value_parser = value::<usize>("a whole number"))]
    points_per_group: usize,
    /// Count hidden points too, which see backs of surfaces or surfaces close by alone, as the
    /// ground under a box; they are left out otherwise, and their share is printed
    #[arg(long)]
    hidden: bool,
    /// Seed of the points and paths
    #[arg(long, value_name = "N", default_value = "0")]
    #[arg(value_parser = value::<u64>("a whole number"))]
    seed: u64,
    /// Write the table, all groups, as CSV
    #[arg(long, value_name = "FILE.csv")]
    csv: Option<PathBuf>,
    /// Write the points with error and radiosity, in colours from blue (none) over green (the error
    /// of all) to red (four times that or more), grey where hidden
    #[arg(long, value_name = "FILE.ply")]
    points_ply: Option<PathBuf>,
    /// Trace these points instead of verifying a solution: {"points": [{"p": [x,y,z], "n":
    /// [x,y,z]}, …]}; where "B", radiosity, and "se", its standard error, are given, print the
    /// difference in units of the standard error of both; --csv has radiosity and standard error
    #[arg(long, value_name = "FILE.json")]
    #[arg(conflicts_with_all = ["solution", "precision", "time", "points_per_group", "hidden"])]
    #[arg(conflicts_with_all = ["tail", "floor"])]
    #[arg(conflicts_with = "points_ply")]
    points: Option<PathBuf>,
    /// Paths a point of --points
    #[arg(long, value_name = "N", default_value = "65536", conflicts_with = "solution")]
    #[arg(value_parser = value::<NonZeroUsize>("a whole number above 0"))]
    paths: NonZeroUsize,
    #[command(flatten)]
    reading: SceneOptions,
}

/// A limit of time; none for no limit.
type Limit = Option<Duration>;

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        for file in self.csv.iter().chain(&self.points_ply) {
            args::check_writable(file)?;
        }
        let Input { scene, luminaires, .. } = self.reading.read(&self.scene)?;
        match (&self.points, &self.solution) {
            (Some(json), _) => {
                let points = Points::read(json)?;
                let traced = points.trace(&scene, self.paths.get(), self.seed, json)?;
                say!("{}", traced.summary());
                if let Some(file) = &self.csv {
                    args::write_file(file, &traced.csv());
                }
            }
            (None, Some(ply)) => self.verify(&scene, &luminaires, ply)?,
            (None, None) => return Err(Stop::usage("give the PLY file of a solution")),
        }
        args::end()
    }

    fn settings(&self) -> Settings {
        let mut settings = Settings::default();
        settings.seed = self.seed;
        settings.measure = self.measure.measure();
        settings.precision = self.precision;
        settings.points_per_group = self.points_per_group;
        settings.time = self.time;
        settings.hidden = self.hidden;
        settings
    }

    fn verify(&self, scene: &Scene, luminaires: &Luminaires, ply: &Path) -> Result<(), Error> {
        let start = Instant::now();
        let solution = progress::of_reading(ply, || read_ply(ply))?;
        let claimed = Claimed::of(&solution, ply);
        claimed.check_sky(scene, self.reading.sky.words(scene), ply)?;
        claimed.check_luminaires(&luminaires.report(), ply)?;
        interrupt::catch();
        let found = progress::of_count("points", |report| {
            verify(scene, &solution, &self.settings(), |progress| {
                report(progress.done, progress.of)
            })
        })?;
        let lines = lines(scene, &found, &claimed);
        say!("{}", table(&lines));
        say!("{}", self.end(scene, &found, start.elapsed()));
        if let Some(verdict) = verdict(claimed.total(), found.error) {
            say!("{verdict}");
        }
        if let Some(file) = &self.csv {
            args::write_file(file, &csv(&lines));
        }
        if let Some(file) = &self.points_ply {
            args::write_file(file, points::coloured_ply(&found).as_bytes());
        }
        Ok(())
    }

    /// How it ended, and what deserves a look.
    fn end(&self, scene: &Scene, found: &Verification, spent: Duration) -> String {
        let why = match (found.stop, self.time) {
            (Reason::Precise, _) => {
                format!("known to {} % of itself", (100.0 * self.precision) as f32)
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
            self.seed
        );
        let share = self.measure.measure().tail;
        if let Some(tail) = found.tail.filter(|_| share > 0.0) {
            let _ = write!(
                end,
                "\n{:.2} % of the area, where errors are largest, is the tail and left out: its \
                 error is {:.2} %{}",
                100.0 * share,
                100.0 * tail,
                tail_groups(scene, found)
            );
        }
        if found.hidden_share > 0.0 && !self.hidden {
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

/// The groups that hold most of the tail, in words.
fn tail_groups(scene: &Scene, found: &Verification) -> String {
    let mut groups: Vec<&GroupError> = found.groups.iter().collect();
    groups.sort_by(|a, b| b.tail_share.total_cmp(&a.tail_share));
    let name = |group: &GroupError| {
        let share = 100.0 * group.tail_share;
        format!("{share:.0} % of it on {}", scene.groups()[group.group])
    };
    let most = groups.iter().take(3).filter(|g| g.tail_share >= 0.05);
    let names: Vec<String> = most.map(|group| name(group)).collect();
    if names.is_empty() { String::new() } else { format!(", {}", names.join(", ")) }
}

fn time(text: &str) -> Parsed<Limit> {
    let limit = |seconds: f64| match seconds {
        f64::INFINITY => Some(None),
        _ => Duration::try_from_secs_f64(seconds).ok().map(Some),
    };
    text.parse().ok().and_then(limit).ok_or_else(|| give("seconds, such as 10, or inf"))
}

/// The report of a bake: the error that it estimated, and its light.
#[derive(Default)]
struct Claimed(Json);

impl Claimed {
    /// From the JSON file of the same name as `ply`, if it is of the same bake as the `solution`
    /// there; else what that says itself, if anything.
    fn of(solution: &VertexMesh, ply: &Path) -> Claimed {
        let file = ply.with_extension("json");
        let text = std::fs::read(&file).unwrap_or_default();
        let report = Claimed(serde_json::from_slice(&text).unwrap_or_default());
        let Some(own) = solution.comments.iter().find_map(|comment| estimated_error(comment))
        else {
            return report;
        };
        match report.total() {
            // Twice the rounding of the comment.
            Some(total) if (total - own).abs() <= 1e-5 => return report,
            Some(total) => eprintln!(
                "warning: {} is of another bake, with an error of {:.2} %, for {:.2} % here: left \
                 aside",
                file.display(),
                100.0 * total,
                100.0 * own,
            ),
            None => (),
        }
        Claimed(json!({ "error": { "total": own } }))
    }

    /// Refuses a solution that was baked under another sky than that of `scene`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] with the sky that it was baked under.
    fn check_sky(&self, scene: &Scene, own: Option<String>, ply: &Path) -> Result<(), Error> {
        let (same, baked) = match &self.0["sky"] {
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
        let found = format!("baked under a sky of {baked}");
        let remedy = format!("verify it under the same: --sky {baked}");
        Err(Error::new(ErrorKind::Setting, ply.display().to_string(), found, remedy))
    }

    /// Refuses a solution that was baked with other luminaires than `own`, those of the scene.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] with how many there were.
    fn check_luminaires(&self, own: &Json, ply: &Path) -> Result<(), Error> {
        let baked = &self.0["luminaires"];
        let count = |list: &Json| list.as_array().map_or(0, Vec::len);
        if baked.is_null() || baked == own || count(baked) + count(own) == 0 {
            return Ok(());
        }
        let found = format!("baked with {} luminaires, which are not these", count(baked));
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
    claimed: Option<f64>,
    error: Option<Estimate>,
}

/// Groups, the worst first, and all together.
fn lines(scene: &Scene, found: &Verification, claimed: &Claimed) -> Vec<Line> {
    let line = |group: &GroupError| {
        let name = &scene.groups()[group.group];
        Line {
            name: name.clone(),
            area_share: group.area_share,
            hidden_share: group.hidden_share,
            points: group.points,
            claimed: claimed.group(name),
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
        claimed: claimed.total(),
        error: found.error,
    });
    lines
}

/// The table as text, cut after 20 groups.
fn table(lines: &[Line]) -> String {
    let Some((all, groups)) = lines.split_last() else { return String::new() };
    let (shown, rest) = groups.split_at(groups.len().min(20));
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
            "{name:<width$} {:>7.2} {:>8.2} {:>7} {:>11} {measured:>15} {ratio:>6}",
            100.0 * line.area_share,
            100.0 * line.hidden_share,
            line.points,
            percent(line.claimed)
        )
    };
    let mut out = format!(
        "{:<width$} {:>7} {:>8} {:>7} {:>11} {:>15} {:>6}\n",
        "group", "area %", "hidden %", "points", "estimated %", "measured %", "ratio"
    );
    shown.iter().for_each(|line| out += &(row(line) + "\n"));
    if !rest.is_empty() {
        let _ = writeln!(out, "{} groups more, none measured worse", rest.len());
    }
    out + &row(all)
}

/// The table as CSV, errors as shares.
fn csv(lines: &[Line]) -> Vec<u8> {
    let head = "group,area_share,hidden_share,points,estimated,measured,standard_error,ratio";
    let number = |x: Option<f64>| x.map_or(String::new(), |x| x.to_string());
    let rows = lines.iter().map(|line| {
        vec![
            line.name.clone(),
            line.area_share.to_string(),
            line.hidden_share.to_string(),
            line.points.to_string(),
            number(line.claimed),
            number(line.error.map(|error| error.value)),
            number(line.error.map(|error| error.standard_error)),
            number(line.ratio()),
        ]
    });
    args::csv(head, rows)
}

impl Line {
    /// The claimed error over the measured one, where that is not zero.
    fn ratio(&self) -> Option<f64> {
        let measured = self.error.map(|error| error.value).filter(|&value| value > 0.0)?;
        Some(self.claimed? / measured)
    }
}
