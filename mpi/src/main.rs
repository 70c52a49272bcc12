//! View factors and radiosity of a scene on many machines, by MPI.
//!
//! ```text
//! mpirun -n 4 radiosity-mpi view-factors CITY.obj --facets --error 1e-4 --out city.npz
//! mpirun -n 4 radiosity-mpi solve ROOM.obj --element-size 50 --out room.ply
//! ```
//!
//! Every process reads the scene. Rays, pairs and exact rows of view factors are dealt out one by
//! one and exchanged; rows of a solve are made by all for process 0. The numbers are the same for
//! any number of processes. A process that dies ends the run; view factors go on from their
//! checkpoint, and a solve from its state.

mod solve;
mod view_factors;
mod world;

use std::process::ExitCode;

use lexopt::prelude::*;
use mpi::traits::Communicator;
use world::World;

const USAGE: &str = "\
usage: mpirun -n N radiosity-mpi view-factors SCENE [--facets] [--error E] [--two-sided NAME]…
                                 [--checkpoint FILE] --out FILE.npz
       mpirun -n N radiosity-mpi solve SCENE.obj [--element-size X] [--hemicube N] [--cpu]
                                 [--unshot U] [--gather E] [--state FILE] --out FILE.ply

  view-factors     as `radiosity view-factors`, to an .npz file
  solve            the light between the elements of a scene, by hemicubes on a device a process,
                   as radiosity at the vertices
  --element-size X longest edge of an element [diagonal / 32]
  --hemicube N     pixels along an edge of a hemicube's top face, even [128]
  --cpu            rays on the CPU instead, N squared a row
  --unshot U       share of the light that may be left unshot [1e-3]
  --gather E       then vertices gather that light, as many as a bake to the error E begins with
  --state FILE     keep the solve there, and go on from it if it is there";

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
        Some(Value(name)) if name == "solve" => solve::run(&mut parser, world),
        _ => {
            if world.0.rank() == 0 {
                println!("{USAGE}");
            }
            Ok(())
        }
    }
}
