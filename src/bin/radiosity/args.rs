//! What the commands share in reading their arguments, and in ending.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::str::FromStr;

use lexopt::prelude::*;
use radiosity::backend::AdapterKind;
use radiosity::{Backend, Error, ErrorKind, Rgb};

use crate::interrupt;

/// Why a command ended without having done its work.
pub enum Stop {
    /// Its help was asked for.
    Help,
    /// An option that it does not have, with its dashes.
    UnknownOption(String),
    /// Arguments that it cannot understand.
    Usage(String),
    /// The work failed.
    Failed(Error),
    /// The work failed, and the user has been told of it.
    Reported,
    /// Ctrl-C stopped the work; what there was has been written.
    Interrupted,
}

impl Stop {
    pub fn usage(message: impl Into<String>) -> Stop {
        Stop::Usage(message.into())
    }

    /// Tells the user, and gives the exit status of the program.
    pub fn report(self, command: &str, usage: &str) -> ExitCode {
        match self {
            Stop::Help => {
                say!("{usage}");
                ExitCode::SUCCESS
            }
            Stop::UnknownOption(option) => {
                let meant = match nearest_option(&option, usage) {
                    Some(known) => format!("; did you mean --{known}?"),
                    None => String::new(),
                };
                Stop::Usage(format!("there is no option '{option}'{meant}")).report(command, usage)
            }
            Stop::Usage(message) => {
                let (synopsis, _) = usage.split_once("\n\n").unwrap_or((usage, ""));
                let program = ["radiosity", command].join(" ");
                eprintln!("error: {message}\n\n{synopsis}\n\nFor help: {} --help", program.trim());
                ExitCode::from(2)
            }
            Stop::Failed(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
            Stop::Reported => ExitCode::FAILURE,
            Stop::Interrupted => ExitCode::from(interrupt::EXIT_STATUS),
        }
    }
}

/// Letters that an option has for each typing error in it, at least. Chosen by hand.
const LETTERS_AN_ERROR: usize = 3;

/// The option in `usage` that `wrong` begins, or else comes close to.
fn nearest_option<'u>(wrong: &str, usage: &'u str) -> Option<&'u str> {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '-';
    let name = |after: &'u str| after.split(|c| !is_part(c)).next().filter(|name| !name.is_empty());
    let names = || usage.split("--").skip(1).filter_map(name);
    let wrong = wrong.trim_start_matches('-');
    let nearest = || {
        let distances = names().map(|name| (strsim::osa_distance(wrong, name), name));
        let (distance, name) = distances.min_by_key(|(distance, _)| *distance)?;
        (LETTERS_AN_ERROR * distance <= wrong.chars().count()).then_some(name)
    };
    names().find(|name| name.starts_with(wrong)).or_else(nearest)
}

impl From<lexopt::Error> for Stop {
    fn from(error: lexopt::Error) -> Stop {
        match error {
            lexopt::Error::UnexpectedOption(option) => Stop::UnknownOption(option),
            error => Stop::Usage(error.to_string()),
        }
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Stop {
        Stop::Failed(error)
    }
}

/// The value of `option`, which was just read. `expected` says what it should be, for errors.
pub fn value<T: FromStr>(
    parser: &mut lexopt::Parser,
    option: &str,
    expected: &str,
) -> Result<T, Stop> {
    let text = parser.value()?.string()?;
    text.parse().map_err(|_| wrong_value(option, &text, expected))
}

/// The value of `option`: exactly `N` numbers with commas between.
pub fn numbers<T: FromStr, const N: usize>(
    parser: &mut lexopt::Parser,
    option: &str,
    expected: &str,
) -> Result<[T; N], Stop> {
    let text = parser.value()?.string()?;
    let numbers: Result<Vec<T>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let array = numbers.ok().and_then(|numbers| numbers.try_into().ok());
    array.ok_or_else(|| wrong_value(option, &text, expected))
}

/// The formats of files that `--write` names, of those that there are.
pub fn formats<F: Copy>(parser: &mut lexopt::Parser, all: &[(&str, F)]) -> Result<Vec<F>, Stop> {
    let text = parser.value()?.string()?;
    let format = |name: &str| all.iter().find(|(n, _)| *n == name).map(|(_, format)| *format);
    let named: Option<Vec<F>> = text.split(',').map(format).collect();
    named.ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|(name, _)| *name).collect();
        let expected = format!("some of {}, with commas between them", names.join(", "));
        wrong_value("write", &text, &expected)
    })
}

/// How a command ends whose results are written.
pub fn end() -> Result<(), Stop> {
    if interrupt::stopped() { Err(Stop::Interrupted) } else { Ok(()) }
}

/// `r,g,b`, or one number for all three.
pub fn rgb(text: &str) -> Option<Rgb> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse()).collect();
    match numbers.as_deref() {
        Ok(&[grey]) => Some(Rgb::splat(grey)),
        Ok(&[r, g, b]) => Some(Rgb::new(r, g, b)),
        _ => None,
    }
}

/// The error for a value that is not as expected.
pub fn wrong_value(option: &str, found: &str, expected: &str) -> Stop {
    Stop::Usage(format!("--{option} takes {expected}, not '{found}'"))
}

/// The one scene of a command that takes one.
pub fn only_scene(scenes: Vec<PathBuf>) -> Result<PathBuf, Stop> {
    let mut scenes = scenes.into_iter();
    match (scenes.next(), scenes.next()) {
        (Some(scene), None) => Ok(scene),
        (None, _) => Err(Stop::usage("no scene given: name an OBJ file")),
        (Some(_), Some(second)) => {
            let second = second.display();
            Err(Stop::Usage(format!("a second scene, '{second}': one at a time, please")))
        }
    }
}

/// The path of the files without their endings, of `--out`: in a folder, one that exists or that
/// ends in a separator, they are named as `default` is; an ending of `endings` is not repeated.
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

/// The endings that formats are named after.
pub fn names<F, const N: usize>(formats: &[(&'static str, F); N]) -> [&'static str; N] {
    std::array::from_fn(|k| formats[k].0)
}

/// What makes form factors, as the user names it.
#[derive(Clone, Debug, PartialEq)]
pub enum Device {
    /// Hemicubes on the adapter with this in its name; or on the best, and rays where there is
    /// none.
    Gpu(Option<String>),
    /// Rays on the CPU, as many a row as the hemicube's top face has pixels.
    Cpu,
}

impl Device {
    /// The adapter that `--adapter` names.
    pub fn named(parser: &mut lexopt::Parser) -> Result<Device, Stop> {
        Ok(Device::Gpu(Some(value(parser, "adapter", "a part of an adapter's name")?)))
    }

    /// The device. Where none was named and none can be had, rays on the CPU take its place.
    ///
    /// # Errors
    /// [`ErrorKind::Device`] when there is no adapter of that name, or it cannot be used.
    pub fn open(&self) -> Result<Backend, Error> {
        match self {
            Device::Gpu(Some(name)) => Backend::gpu(Some(name)),
            Device::Gpu(None) => Backend::gpu(None).or_else(|error| match error.kind() {
                ErrorKind::Device => {
                    eprintln!("warning: rays on the CPU, for want of a device: {error}");
                    Ok(Backend::Cpu)
                }
                _ => Err(error),
            }),
            Device::Cpu => Ok(Backend::Cpu),
        }
    }
}

/// The value of `--adapter-kind`.
pub fn adapter_kind(parser: &mut lexopt::Parser) -> Result<AdapterKind, Stop> {
    let text = parser.value()?.string()?;
    match &*text {
        "discrete" => Ok(AdapterKind::DiscreteGpu),
        "integrated" => Ok(AdapterKind::IntegratedGpu),
        "software" => Ok(AdapterKind::Cpu),
        _ => Err(wrong_value("adapter-kind", &text, "discrete, integrated or software")),
    }
}

/// Refuses an output that could not be written before any work is done for it.
///
/// # Errors
/// [`ErrorKind::File`] when no file can be created in the folder of `path`.
pub fn check_writable(path: &Path) -> Result<(), Error> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let probe = folder.join(format!(".radiosity-{}", std::process::id()));
    let result = std::fs::write(&probe, b"").and_then(|()| std::fs::remove_file(&probe));
    result.map_err(|e| {
        let place = format!("output folder {}", folder.display());
        let remedy = "choose a folder that exists and can be written";
        Error::new(ErrorKind::File, place, e.to_string(), remedy).with_source(e)
    })
}

/// Writes a file; errors name it.
///
/// # Errors
/// [`ErrorKind::File`] when that fails.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    std::fs::write(path, bytes).map_err(|e| {
        let remedy = "choose a folder that exists, can be written and has room";
        let found = format!("cannot be written: {e}");
        Error::new(ErrorKind::File, path.display().to_string(), found, remedy).with_source(e)
    })
}
