//! Lesson 7 of 9: a lamp is dimmed, a block is moved, and the solve goes on from where it was.
//!
//!     cargo run --release --example incremental

use std::ops::ControlFlow;

use glam::{DAffine3, DVec3};
use radiosity::backend::cpu::RayRows;
use radiosity::solver::SolveSession;
use radiosity::{Error, Mesh, Solver, load_scene};

fn main() -> Result<(), Error> {
    let scene = load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj"))?;
    let mut materials = scene.materials().to_vec();
    for material in &mut materials {
        material.exitance *= 0.5;
    }
    let dimmed = scene.with_materials(materials)?;
    let shift = DAffine3::from_translation(DVec3::new(30.0, 0.0, 0.0));
    let moved = dimmed.with_transformed_group("short_block", shift)?;
    let mesh = Mesh::new(scene, 60.0)?;
    let dimmed = mesh.with_scene(dimmed)?; // the same elements, other materials
    let moved = dimmed.with_scene(moved)?; // the same elements, other places
    let go = |_: &_| ControlFlow::Continue(());
    let mut rows = RayRows::new(&mesh, 4096)?;
    let mut session = Solver::default().begin(&mesh)?;
    session.run(&mut rows, go)?;
    print("solved", &session)?;
    session.update_materials(&dimmed)?; // keeps all rows
    session.run(&mut rows, go)?;
    print("dimmed", &session)?;
    let mut new_rows = RayRows::new(&moved, 4096)?;
    session.update_geometry(&moved, &mut rows, &mut new_rows, go)?; // remakes rows that see it
    session.run(&mut new_rows, go)?;
    print("moved", &session)
}

fn print(name: &str, session: &SolveSession) -> Result<(), Error> {
    let solution = session.solution()?;
    println!("{name}: {} rows, {} shots so far", solution.rows_made, solution.shots);
    Ok(())
}
