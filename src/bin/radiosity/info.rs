//! `radiosity info`: whether the files of a bake or a light map are all of one run.

use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::{Error, ErrorKind};
use serde_json::Value;

use crate::args::Stop;
use crate::progress;

/// Says whether files are those that their report names
#[derive(Args)]
#[command(after_help = "\
A run writes its report last. If it was killed before, its files stand beside the report of the \
run before it. Exit status: 0 when all files are as the report has them, 3 when some are not.")]
pub struct Options {
    /// Report of a bake or a light map: STEM.json
    #[arg(value_name = "STEM.json")]
    report: PathBuf,
}

impl Options {
    /// Runs the command.
    pub fn run(self) -> Result<(), Stop> {
        let path = &self.report;
        let wrong = |found: String| {
            let remedy = "name the report of a bake or a light map, STEM.json";
            Error::new(ErrorKind::File, path.display().to_string(), found, remedy)
        };
        let text = std::fs::read(path).map_err(|error| wrong(error.to_string()))?;
        let report: Value =
            serde_json::from_slice(&text).map_err(|error| wrong(format!("not JSON, {error}")))?;
        let files = report["files"].as_array().ok_or_else(|| wrong("names no files".into()))?;
        let mut others = 0;
        for file in files {
            let (Some(name), Some(bytes), Some(hash)) =
                (file["name"].as_str(), file["bytes"].as_u64(), file["xxh3"].as_str())
            else {
                return Err(wrong("files without name, size and hash".into()).into());
            };
            let state = state(&path.with_file_name(name), bytes, hash);
            others += usize::from(state != SAME);
            say!("{name:<40} {state}");
        }
        match others {
            0 => Ok(()),
            _ => {
                eprintln!(
                    "{others} of {} files are not those of this report: a later run was ended \
                     while it wrote, or they were changed since; bake again",
                    files.len()
                );
                Err(Stop::Missed)
            }
        }
    }
}

/// What is said of a file that is as its report has it.
const SAME: &str = "as in the report";

/// How the file at `path` compares with the size and hash in its report.
fn state(path: &Path, bytes: u64, hash: &str) -> String {
    match progress::size_and_hash(path) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => "missing".into(),
        Err(error) => error.to_string(),
        Ok((size, _)) if size != bytes => format!("another: {size} bytes, not {bytes}"),
        Ok((_, found)) if format!("{found:016x}") != hash => "another of the same size".into(),
        Ok(_) => SAME.into(),
    }
}
