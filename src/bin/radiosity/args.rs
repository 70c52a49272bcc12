//! What the commands share in reading their arguments, and in ending.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use clap::Args;
use clap::error::ErrorKind as Usage;
use radiosity::accuracy::Measure;
use radiosity::backend::AdapterKind;
use radiosity::work::is_first;
use radiosity::{Backend, Error, ErrorKind, Rgb, io};

use crate::{interrupt, progress, standard};

/// Why a command ended without having done its work.
pub enum Stop {
    /// Arguments that contradict each other.
    Usage(String),
    /// The work failed.
    Failed(Error),
    /// The work failed, and its errors are printed.
    Reported,
    /// Ctrl-C stopped the work; what there was has been written.
    Interrupted,
    /// Results are written, and their error is larger than what was asked for.
    Missed,
}

impl Stop {
    pub fn usage(message: impl Into<String>) -> Stop {
        Stop::Usage(message.into())
    }

    /// Prints the reason, and gives the exit status of the program. `command` has the usage.
    pub fn report(self, command: &mut clap::Command) -> ExitCode {
        match self {
            Stop::Usage(message) => print(&command.error(Usage::ArgumentConflict, message)),
            Stop::Failed(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
            Stop::Reported => ExitCode::FAILURE,
            Stop::Interrupted => ExitCode::from(interrupt::EXIT_STATUS),
            Stop::Missed => ExitCode::from(3),
        }
    }
}

/// Prints help or what is wrong with the usage, and gives the exit status. Nobody may read on, as
/// behind `| head`.
pub fn print(error: &clap::Error) -> ExitCode {
    _ = error.print();
    ExitCode::from(if error.use_stderr() { 2 } else { 0 })
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Failed(error)
    }
}

/// What an error is given as.
pub const SHARE: &str = "a share, such as 0.1 for 10 %";

/// A value, or what it should be.
pub type Parsed<T> = Result<T, String>;

/// The error for a value that is not as `expected`.
pub fn give(expected: &str) -> String {
    format!("give {expected}")
}

/// Reads what is written as a type's own values are. `expected` says what it should be, for errors.
pub fn value<T: FromStr + 'static>(
    expected: &'static str,
) -> impl Fn(&str) -> Parsed<T> + Clone + Send + Sync + 'static {
    move |text| text.parse().map_err(|_| give(expected))
}

/// Numbers with commas between them.
pub type List<T> = Vec<T>;

/// Reads numbers with commas between them.
pub fn list<T: FromStr + 'static>(
    expected: &'static str,
) -> impl Fn(&str) -> Parsed<List<T>> + Clone + Send + Sync + 'static {
    move |text| {
        let numbers: Result<Vec<T>, _> = text.split(',').map(|part| part.trim().parse()).collect();
        numbers.map_err(|_| give(expected))
    }
}

/// Reads exactly `N` numbers with commas between them.
pub fn numbers<T: FromStr + 'static, const N: usize>(
    expected: &'static str,
) -> impl Fn(&str) -> Parsed<[T; N]> + Clone + Send + Sync + 'static {
    move |text| list(expected)(text)?.try_into().map_err(|_| give(expected))
}

/// Values and their names.
pub type Names<T> = &'static [(&'static str, T)];

/// Reads one of `all` names.
pub fn one_of<T: Copy + Send + Sync + 'static>(
    all: Names<T>,
) -> impl Fn(&str) -> Parsed<T> + Clone + Send + Sync + 'static {
    move |text| {
        let named = all.iter().find(|(name, _)| *name == text);
        named
            .map(|(_, value)| *value)
            .ok_or_else(|| give(&format!("one of {}", names(all).join(", "))))
    }
}

/// Reads some of `all` names, with commas between them.
pub fn some_of<T: Copy + Send + Sync + 'static>(
    all: Names<T>,
) -> impl Fn(&str) -> Parsed<List<T>> + Clone + Send + Sync + 'static {
    move |text| {
        let values: Parsed<List<T>> = text.split(',').map(one_of(all)).collect();
        let expected = || format!("some of {}, with commas between them", names(all).join(", "));
        values.map_err(|_| give(&expected()))
    }
}

/// The names alone.
pub fn names<T>(all: Names<T>) -> Vec<&'static str> {
    all.iter().map(|(name, _)| *name).collect()
}

/// How a command ends whose results are written.
pub fn end() -> Result<(), Stop> {
    if interrupt::stopped() { Err(Stop::Interrupted) } else { Ok(()) }
}

/// The same for results that were to have an error.
pub fn end_at(is_reached: bool) -> Result<(), Stop> {
    end()?;
    if is_reached { Ok(()) } else { Err(Stop::Missed) }
}

/// `r,g,b`, or one number for all three.
pub fn rgb(text: &str) -> Parsed<Rgb> {
    let expected = "r,g,b, or one number for all three";
    match list(expected)(text)?[..] {
        [grey] => Ok(Rgb::splat(grey)),
        [r, g, b] => Ok(Rgb::new(r, g, b)),
        _ => Err(give(expected)),
    }
}

/// Where a command writes its files.
#[derive(Args)]
pub struct Output {
    /// Path of the files without their endings, or a folder for files of the scene's name [default:
    /// beside the scene]
    #[arg(short, long, value_name = "STEM")]
    out: Option<PathBuf>,
    /// [`stem`] of it.
    #[arg(skip)]
    stem: PathBuf,
}

impl Output {
    /// Whether standard output takes the place of files.
    pub fn is_dash(&self) -> bool {
        self.out.as_deref().is_some_and(standard::is_dash)
    }

    /// Names the files as `default` is where they are given no name, and checks whether they can be
    /// written before any work is done for them.
    ///
    /// # Errors
    /// Those of [`check_writable`].
    pub fn name(&mut self, default: PathBuf, endings: &[&str]) -> Result<(), Error> {
        if self.is_dash() {
            let (found, remedy) =
                ("of standard output is the PLY file of a bake alone", "name files");
            return Err(Error::new(ErrorKind::Setting, "--out -", found, remedy));
        }
        self.stem = stem(self.out.take(), default, endings);
        check_writable(&self.stem)
    }

    /// The file with this ending.
    pub fn path(&self, ending: &str) -> PathBuf {
        self.stem.with_added_extension(ending)
    }

    /// Writes the report of a command as its last file, with the names, sizes and hashes of the
    /// others: [`info`](crate::info) tells by them whether all are of one run.
    pub fn write_report(&self, mut report: serde_json::Value) {
        report["files"] = progress::written_files();
        self.write("json", format!("{report:#}\n").as_bytes());
    }

    /// Writes the file with this ending: [`write_file`].
    pub fn write(&self, ending: &str, bytes: &[u8]) {
        write_file(&self.path(ending), bytes);
    }
}

/// The path of the files without their endings, of `--out`: in a folder, one that exists or that
/// ends in a separator, they are named as `default` is; an ending that a format is named after is
/// not repeated.
pub fn stem(out: Option<PathBuf>, default: PathBuf, endings: &[&str]) -> PathBuf {
    let Some(mut out) = out else { return default };
    let is_folder = out.as_os_str().to_string_lossy().ends_with(std::path::is_separator);
    if is_folder || out.is_dir() {
        return out.join(default.file_name().unwrap_or_default());
    }
    let ending = out.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if ending.is_some_and(|ending| endings.contains(&&*ending)) {
        out.set_extension("");
    }
    out
}

/// The names of kinds of adapters.
const KINDS: Names<AdapterKind> = &[
    ("discrete", AdapterKind::DiscreteGpu),
    ("integrated", AdapterKind::IntegratedGpu),
    ("software", AdapterKind::Cpu),
];

/// Which errors count.
#[derive(Args, Clone, Copy)]
pub struct MeasureOptions {
    /// Share of the area, where errors are largest, that does not count and has an error of its
    /// own; 0 for the plain root mean square [default: 0.01]
    #[arg(long, value_name = "SHARE", value_parser = value::<f64>(SHARE))]
    tail: Option<f64>,
    /// Points darker than this share of the mean reflected radiosity count as that bright [default:
    /// 0.05]
    #[arg(long, value_name = "SHARE", hide = true, value_parser = value::<f64>(SHARE))]
    floor: Option<f64>,
}

impl MeasureOptions {
    /// The measure that they give.
    pub fn measure(self) -> Measure {
        let mut measure = Measure::default();
        measure.tail = self.tail.unwrap_or(measure.tail);
        measure.floor = self.floor.unwrap_or(measure.floor);
        measure
    }
}

/// What makes form factors and gathers.
#[derive(Args)]
#[command(next_help_heading = "Device")]
pub struct DeviceOptions {
    /// Rays on the CPU alone. Without it: the graphics adapter, and rays on the CPU where there is
    /// none and where they are faster
    #[arg(long, overrides_with = "adapter")]
    cpu: bool,
    /// Graphics adapter with NAME in its name; the variable WGPU_ADAPTER_NAME does the same
    #[arg(long, value_name = "NAME", overrides_with = "cpu")]
    adapter: Option<String>,
    /// Choose between hemicubes and rays as on a discrete, integrated or software adapter [default:
    /// as the driver says]
    #[arg(long, value_name = "KIND", hide = true, value_parser = one_of(KINDS))]
    adapter_kind: Option<AdapterKind>,
}

impl DeviceOptions {
    /// The device. Where none is named and none can be had, rays on the CPU are used instead.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] when there is no adapter of that name, or it cannot be used.
    pub fn open(&self) -> Result<Backend, Error> {
        progress::of_stage("opening the device", || {
            let device = match &self.adapter {
                _ if self.cpu => Backend::Cpu,
                Some(name) => Backend::gpu(Some(name))?,
                None => Backend::gpu(None).or_else(|error| match error.kind() {
                    ErrorKind::Device => {
                        eprintln!("warning: rays on the CPU, for want of a device: {error}");
                        Ok(Backend::Cpu)
                    }
                    _ => Err(error),
                })?,
            };
            Ok(match (device, self.adapter_kind) {
                (Backend::Gpu(gpu), Some(kind)) => Backend::Gpu(gpu.assuming(kind)),
                (device, _) => device,
            })
        })
    }
}

/// Refuses an output that could not be written before any work is done for it.
///
/// # Errors
/// [`ErrorKind::File`] when no file can be created in the folder of `path`.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    if !is_first() {
        return Ok(());
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let probe = folder.join(format!(".radiosity-{}", std::process::id()));
    let result = std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe));
    result.map_err(|e| {
        let place = format!("output folder {}", folder.display());
        let remedy = "choose a folder that exists and can be written";
        Error::new(ErrorKind::File, place, e.to_string(), remedy).with_source(e)
    })
}

/// A CSV file: the names of the columns, with commas between them, and rows of as many cells.
pub fn csv(head: &str, rows: impl IntoIterator<Item = Vec<String>>) -> Vec<u8> {
    let mut table = csv::Writer::from_writer(vec![]);
    for row in std::iter::once(head.split(',').map(String::from).collect()).chain(rows) {
        table.write_record(row).expect("rows of one length");
    }
    table.into_inner().expect("a vector takes all bytes")
}

/// Writes a file: [`progress::of_writing`].
pub fn write_file(path: &Path, bytes: &[u8]) {
    progress::of_writing(path, |path| io::Output::from(path).write_bytes(bytes));
}
