//! The Cornell box, from file to vertices, against path-traced truth.

use radiosity::backend::cpu::RayRows;
use radiosity::{Mesh, Solution, Solver, VertexMesh};

use crate::common::{cornell_box, keep_going, truth};

const TRUTH: &str = include_str!("../data/cornell_box.truth.json");

pub fn solve(mesh: &Mesh, rows: &mut dyn radiosity::FormFactors) -> Solution {
    Solver::default().solve(mesh, rows, keep_going).expect("a solution")
}

/// Prints the errors per kind of point, and checks those of kind `area`.
pub fn check(mesh: &Mesh, solution: &Solution, rms: f64, median: f64) {
    let surface = VertexMesh::new(mesh, &solution.radiosity);
    let errors = truth::compare(&surface, TRUTH);
    for (kind, e) in &errors {
        println!(
            "{kind:9} {:4} points: RMS {:.4}, median {:.4}, worst {:.4}",
            e.count, e.rms, e.median, e.worst
        );
    }
    let area = errors["area"];
    assert!(area.count >= 100 && area.rms <= rms && area.median <= median, "{area:?}");
    assert!(solution.ledger.imbalance() <= 1e-9);
    assert!(solution.ledger.unshot_share() <= 1e-3);
}

#[test]
fn cornell_box_by_rays_matches_path_tracer() {
    // Elements twice as large, so that rays are not waited for; the error of interpolation grows by
    // up to the square of that.
    let mesh = cornell_box(60.0);
    let solution = solve(&mesh, &mut RayRows::new(&mesh, 4096).unwrap());
    check(&mesh, &solution, 4.0 * 0.05, 4.0 * 0.01);
}
