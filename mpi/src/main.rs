//! View factors of a scene on many machines, by MPI.
//!
//! ```text
//! mpirun -n 4 radiosity-mpi view-factors CITY.obj --facets --error 1e-4 --out city.npz
//! ```
//!
//! Every process reads the scene. Rays, pairs and exact rows are dealt out one by one and
//! exchanged.
//! The numbers are the same for any number of processes. A process that dies ends the run, and the
//! same command goes on from its checkpoint.

mod view_factors;
mod world;

use std::process::ExitCode;

use lexopt::prelude::*;
use mpi::traits::Communicator;
use world::World;

const USAGE: &str = "\
usage: mpirun -n N radiosity-mpi view-factors SCENE [--facets] [--error E] [--two-sided NAME]…
                                 [--checkpoint FILE] --out FILE.npz

  view-factors     as `radiosity view-factors`, to an .npz file";

/// Why a command ends early.
type Failure = Box<dyn std::error::Error>;

fn main() -> ExitCode {
    let Some(universe) = mpi::initialize() else {
        eprintln!("error: MPI cannot be initialised");
        return ExitCode::FAILURE;
    };
    let mut world = World(universe.world());
    match run(&mut world) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            // Others may wait for this process.
            world.0.abort(1)
        }
    }
}

fn run(world: &mut World) -> Result<(), Failure> {
    let mut parser = lexopt::Parser::from_env();
    match parser.next()? {
        Some(Value(name)) if name == "view-factors" => view_factors::run(&mut parser, world),
        _ => {
            if world.0.rank() == 0 {
                println!("{USAGE}");
            }
            Ok(())
        }
    }
}
