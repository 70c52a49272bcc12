//! Lesson 4 of 9: the steps of a bake one by one, for programs that want to replace some of them.
//!
//!     Scene ─> Mesh ─> FormFactors ─> Solver ─> GatheredMesh ─> file
//!
//!     cargo run --release --example own_pipeline

use std::ops::ControlFlow;

use radiosity::backend::cpu::RayGather;
use radiosity::backend::gpu::HemicubeRows;
use radiosity::form_factor::ProximityCorrection;
use radiosity::gather::{RefinementSettings, gather_at_vertices};
use radiosity::*;

fn main() -> Result<(), Error> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    // Elements with edges of at most 60 mm receive light; cut smaller where surfaces touch.
    let mesh = Mesh::new(load_scene(path)?, 60.0)?.split_at_contacts(2);
    println!("{} elements", mesh.element_count());

    // Form factors: hemicubes with 128 × 128 pixels on top, closed forms for receivers within one
    // patch diameter. Anything that implements `FormFactors` will do.
    let gpu = Gpu::new(None)?;
    let hemicubes = HemicubeRows::new(&gpu, &mesh, 128)?;
    let mut rows = ProximityCorrection::new(hemicubes, &mesh, 1.0);

    // The solver shoots light until 0.1 % is left.
    let solver = Solver { unshot: 1e-3, ..Solver::default() };
    let solution = solver.solve(&mesh, &mut rows, |progress| {
        eprintln!("{:.2} % unshot", 100.0 * progress.unshot_share);
        ControlFlow::Continue(())
    })?;
    println!("{} shots, {} hemicubes", solution.shots, solution.rows_made);

    // The corners of coarse elements gather that light; elements are split where it is not linear.
    let light = GatheredMesh::from_elements(&mesh, &solution.radiosity)?;
    let coarse = Mesh::new(load_scene(path)?, 150.0)?.split_at_contacts(2);
    let mut gather = RayGather::new(&coarse, 1024)?; // or TracedGather, or your own `Gather`
    let refinement = RefinementSettings::new(5.0); // no element below 5 mm is split
    let go = |_: &_| ControlFlow::Continue(());
    let fine = gather_at_vertices(&light, &coarse, &refinement, &mut gather, go)?;
    println!("{} vertices", fine.surface.positions.len());
    write_ply("own_pipeline.ply", &fine.surface)
}
