//! The command-line program.
//!
//! ```text
//! radiosity bake          SCENE.obj    radiosity at vertices   -> PLY, GLB, JSON, EXR, PNG
//! radiosity light-map     SCENE.obj    irradiance in a texture -> EXR, GLB
//! radiosity view-factors  SCENE.obj…   factors between groups  -> CSV, Matrix Market, NPY
//! radiosity merge         SCENE.…rows  the same, of their rows
//! radiosity heat          SCENE.obj    radiative heat balance   -> CSV
//! radiosity grid          SCENE.obj    light on measuring grids  -> CSV, PNG
//! radiosity ugr           SCENE.obj    glare of observers        -> CSV
//! radiosity probes        SCENE.obj    spherical harmonics       -> JSON, CSV
//! radiosity trade-off     SCENE.obj    error over time         -> CSV, PNG
//! radiosity verify        SCENE.obj …  error of a solution     -> CSV, PLY
//! radiosity info          STEM.json    whether files are of one run
//! radiosity scaling       COSTS.json   time of a run on many processes
//! ```
//!
//! Results go to files, summaries to standard output, progress, warnings and errors to standard
//! error. Exit status: 0 when all was done, 1 when the work failed or a file was not written, 2 for
//! wrong usage, 3 when results are written whose error is larger than what was asked for, 130 when
//! Ctrl-C stopped it.

// The same bytes on every platform: see clippy.toml.
#![cfg_attr(not(test), warn(clippy::disallowed_methods))]

/// Prints a line: [`standard::say`].
macro_rules! say {
    ($($line:tt)*) => { $crate::standard::say(format_args!($($line)*)) };
}

mod args;
mod bake;
mod camera_option;
mod canvas;
mod grid;
mod heat;
mod info;
mod interrupt;
mod light;
mod light_map;
mod luminaires;
mod measured_sky;
mod probes;
mod progress;
mod report;
mod scaling;
mod scene_options;
mod sky;
mod standard;
mod sun;
mod trade_off;
mod ugr;
mod verify;
mod view_factors;
mod viewer_options;
#[cfg(feature = "mpi")]
#[path = "../../../mpi/src/world.rs"]
mod world;

use std::path::PathBuf;
use std::process::ExitCode;

use args::Stop;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use view_factors::merge;

/// Radiosity of scenes: at vertices, in textures, on grids and at probes; view factors and
/// radiative heat between their groups
#[derive(Parser)]
#[command(name = "radiosity", version, args_override_self = true, max_term_width = 100)]
struct Program {
    #[command(subcommand)]
    command: Command,
    /// Write what the tasks of the run cost to this file, for `radiosity scaling`
    #[arg(long, global = true, hide = true, value_name = "FILE")]
    costs: Option<PathBuf>,
}

#[derive(Subcommand)]
enum Command {
    Bake(Box<bake::Bake>),
    LightMap(Box<light_map::Options>),
    ViewFactors(Box<view_factors::Options>),
    Merge(merge::Options),
    Heat(Box<heat::Options>),
    Grid(Box<grid::Options>),
    Probes(Box<probes::Options>),
    Ugr(Box<ugr::Options>),
    TradeOff(Box<trade_off::Options>),
    Verify(Box<verify::Options>),
    Info(info::Options),
    Scaling(scaling::Options),
}

#[cfg(not(feature = "mpi"))]
fn main() -> ExitCode {
    run()
}

/// In each of the processes that `mpirun` starts.
#[cfg(feature = "mpi")]
fn main() -> ExitCode {
    world::run(run)
}

fn run() -> ExitCode {
    let mut program = program();
    let parsed = program.try_get_matches_from_mut(std::env::args_os()).and_then(|mut matches| {
        let name = matches.subcommand_name().unwrap_or_default().to_string();
        Ok((name, Program::from_arg_matches_mut(&mut matches)?))
    });
    let (name, Program { command, costs }) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => return args::print(&error),
    };
    let done = match costs {
        Some(path) => scaling::recorded(&path, || run_command(command)),
        None => run_command(command),
    };
    let unwritten = progress::report_unwritten();
    match done {
        Ok(()) | Err(Stop::Missed | Stop::Interrupted) if unwritten => ExitCode::FAILURE,
        Ok(()) => ExitCode::SUCCESS,
        Err(stop) => stop.report(program.find_subcommand_mut(name).expect("it was run")),
    }
}

fn run_command(command: Command) -> Result<(), Stop> {
    match command {
        Command::Bake(options) => options.run(),
        Command::LightMap(options) => options.run(),
        Command::ViewFactors(options) => options.run(),
        Command::Merge(options) => options.run(),
        Command::Heat(options) => options.run(),
        Command::Grid(options) => options.run(),
        Command::Probes(options) => options.run(),
        Command::Ugr(options) => options.run(),
        Command::TradeOff(options) => options.run(),
        Command::Verify(options) => options.run(),
        Command::Info(options) => options.run(),
        Command::Scaling(options) => options.run(),
    }
}

/// The program as it reads its arguments: values may begin with a hyphen, as directions do.
fn program() -> clap::Command {
    let with_hyphens = |arg: clap::Arg| {
        let has_value = arg.get_action().takes_values() && !arg.is_positional();
        arg.allow_hyphen_values(has_value)
    };
    Program::command().mut_subcommands(|command| command.mut_args(with_hyphens))
}

#[cfg(test)]
mod tests {
    /// Names of options that are not hidden.
    fn listed(command: &str) -> Vec<String> {
        let mut program = super::program();
        program.build();
        let command = program.find_subcommand(command).unwrap();
        let options = command.get_arguments().filter(|arg| !arg.is_hide_set());
        options.filter_map(|arg| arg.get_long().map(String::from)).collect()
    }

    #[test]
    fn arguments_contradict_nothing() {
        super::program().debug_assert();
    }

    #[test]
    fn help_of_a_bake_is_short() {
        let listed = listed("bake");
        assert!(listed.len() <= 25, "{}: {listed:?}", listed.len());
    }
}
