//! The command-line program.
//!
//! ```text
//! radiosity bake          SCENE.obj    radiosity at vertices   -> PLY, GLB, JSON, EXR, PNG
//! radiosity light-map     SCENE.obj    irradiance in a texture -> EXR, GLB
//! radiosity view-factors  SCENE.obj…   factors between groups  -> CSV, Matrix Market, NPY
//! radiosity merge         SCENE.…rows  the same, of their rows
//! radiosity heat          SCENE.obj    radiative heat balance   -> CSV
//! radiosity grid          SCENE.obj    light on measuring grids  -> CSV, PNG
//! radiosity probes        SCENE.obj    spherical harmonics       -> JSON, CSV
//! radiosity trade-off     SCENE.obj    error over time         -> CSV, SVG, PNG
//! radiosity verify        SCENE.obj …  error of a solution     -> CSV, PLY
//! ```
//!
//! Results go to files, summaries to standard output, progress, warnings and errors to standard
//! error. Exit status: 0 when all was done, 1 when the work failed, 2 for wrong usage, 130 when
//! Ctrl-C stopped it.

/// Prints a line, also where nobody reads on, as behind `| head`: `println!` panics there.
macro_rules! say {
    ($($line:tt)*) => {{
        use std::io::Write as _;
        _ = writeln!(std::io::stdout(), $($line)*);
    }};
}

mod args;
mod bake;
mod canvas;
mod grid;
mod heat;
mod interrupt;
mod light;
mod light_map;
mod luminaires;
mod probes;
mod progress;
mod report;
mod scene_options;
mod sky;
mod trade_off;
mod verify;
mod view_factors;

use std::ffi::OsStr;
use std::process::ExitCode;

use args::Stop;
use lexopt::prelude::*;
use view_factors::merge;

const USAGE: &str = "\
usage: radiosity COMMAND SCENE.obj… [options]

  bake          the radiosity of a scene, at the vertices of a mesh
  light-map     the irradiance of a scene's surfaces, in a texture
  view-factors  view factors between the groups of scenes
  merge         rows of view factors from many machines, put together
  heat          temperatures and net fluxes of groups, by their view factors
  grid          irradiance or illuminance on measuring grids
  probes        irradiance at points in the air as spherical harmonics, for games
  trade-off     what a bake of a scene costs and how far it is off, over its settings
  verify        how far off a solution of a scene is, by path tracing

Options of a command: radiosity COMMAND --help. Of the program: --help, --version.";

/// A command: its name, its help text, and what runs it on the arguments that follow the name.
struct Command {
    name: &'static str,
    usage: &'static str,
    run: fn(&mut lexopt::Parser) -> Result<(), Stop>,
}

const COMMANDS: [Command; 9] = [
    Command { name: "bake", usage: bake::USAGE, run: bake::run },
    Command { name: "light-map", usage: light_map::USAGE, run: light_map::run },
    Command { name: "view-factors", usage: view_factors::USAGE, run: view_factors::run },
    Command { name: "merge", usage: merge::USAGE, run: merge::run },
    Command { name: "heat", usage: heat::USAGE, run: heat::run },
    Command { name: "grid", usage: grid::USAGE, run: grid::run },
    Command { name: "probes", usage: probes::USAGE, run: probes::run },
    Command { name: "trade-off", usage: trade_off::USAGE, run: trade_off::run },
    Command { name: "verify", usage: verify::USAGE, run: verify::run },
];

fn main() -> ExitCode {
    let mut parser = lexopt::Parser::from_env();
    match command(&mut parser) {
        Ok(Some(command)) => match (command.run)(&mut parser) {
            Ok(()) => ExitCode::SUCCESS,
            Err(stop) => stop.report(command.name, command.usage),
        },
        Ok(None) => ExitCode::SUCCESS,
        Err(stop) => stop.report("", USAGE),
    }
}

/// The command that the first argument names, or none where there is nothing left to do.
fn command(parser: &mut lexopt::Parser) -> Result<Option<&'static Command>, Stop> {
    match parser.next()? {
        Some(Long("help") | Short('h')) => Err(Stop::Help),
        Some(Long("version") | Short('V')) => {
            say!("radiosity {}", env!("CARGO_PKG_VERSION"));
            Ok(None)
        }
        Some(Value(name)) if name == "help" => match parser.next()? {
            Some(Value(name)) => {
                say!("{}", named(&name)?.usage);
                Ok(None)
            }
            _ => Err(Stop::Help),
        },
        Some(Value(name)) => named(&name).map(Some),
        Some(other) => Err(other.unexpected().into()),
        None => Err(Stop::usage("no command given")),
    }
}

/// The command of this name.
fn named(name: &OsStr) -> Result<&'static Command, Stop> {
    COMMANDS.iter().find(|command| *command.name == *name).ok_or_else(|| {
        let names = COMMANDS.map(|command| command.name).join(", ");
        Stop::usage(format!("no command '{}': there are {names}", name.display()))
    })
}
