//! Lesson 5 of 9: view factors between the groups of a scene, for heat transfer. Exact but for the
//! error asked for; no graphics device is used.
//!
//!     cargo run --release --example view_factors -- SCENE.obj

use std::ops::ControlFlow;

use radiosity::io::view_factors::write_csv_matrix;
use radiosity::{Error, ViewFactors, load_scene};

fn main() -> Result<(), Error> {
    let default = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let scene = load_scene(std::env::args().nth(1).unwrap_or(default.into()))?;
    let two_sided = []; // numbers of groups that give and take on both sides
    let matrix = ViewFactors::new(&scene, 1e-3, &two_sided, |done, of| {
        eprint!("\r{done} of {of} ");
        ControlFlow::Continue(())
    })?;
    let matrix = matrix.expect("only a Break of the callback leaves none");
    for (from, name) in matrix.names.iter().enumerate() {
        println!("from {name}, {:.0} mm²", matrix.areas[from]);
        for factor in &matrix.factors[from] {
            let to = &matrix.names[factor.to as usize];
            println!("  {:.6} ± {:.0e} to {to}", factor.value, factor.error);
        }
        println!("  {:.6} out of the scene", matrix.open[from].value);
    }
    // How well raw numbers keep the rules, and a matrix that keeps them exactly.
    let checks = matrix.checks();
    println!("closure {:.1e}, reciprocity {:.1e}", checks.closure.rms, checks.reciprocity.rms);
    let (enforced, report) = matrix.enforced();
    println!("enforced: changed by {:.1e} RMS", report.rms_change);
    write_csv_matrix("view_factors.csv", &enforced)
}
