//! What closed forms for near receivers cost and gain, on the Cornell box. A table; nothing is
//! repeated. Runs in full only:
//!
//!     RADIOSITY_BENCH=full cargo bench --bench near_repair
//!
//! Per reach of the correction: raw reciprocity over all pairs of elements, A_i F_ij against
//! A_j F_ji, as an error of the smaller one's factor; then a bake, its hemicubes and seconds, and
//! its errors at points of path-traced truth.

mod common;

use std::time::Instant;

use common::{keep_going, truth};
use radiosity::backend::gpu::HemicubeRows;
use radiosity::form_factor::{ProximityCorrection, Row};
use radiosity::mesh::NodeId;
use radiosity::{Error, FormFactors, Mesh, Solver, VertexMesh};

const TRUTH: &str = include_str!("../tests/data/cornell_box.truth.json");

/// Longest edge of an element, mm.
const ELEMENT_SIZE: f64 = 30.0;

/// Pixels along an edge of a hemicube's top face.
const HEMICUBE: u32 = 128;

fn main() -> Result<(), Error> {
    if !common::asked_for("near_repair") {
        return Ok(());
    }
    let mesh = Mesh::new(common::cornell_box(), ELEMENT_SIZE)?;
    let gpu = common::gpu();
    println!("Cornell box, {} elements, hemicube {HEMICUBE}", mesh.element_count());
    println!(
        "{:14} {:>9} {:>9} {:>9} | {:>8} {:>6} | {:>7} {:>7} {:>7} {:>7}",
        "rows", "RMS", "worst", "corr.", "hemicub.", "s", "area", "median", "edge", "bias"
    );
    for (name, reach) in [("plain", -1.0), ("near 1", 1.0), ("near 3", 3.0)] {
        let hemicubes = || HemicubeRows::new(&gpu, &mesh, HEMICUBE);
        let mut rows = ProximityCorrection::new(hemicubes()?, &mesh, reach);
        let (rms, worst) = reciprocity(&mesh, &mut rows)?;
        let correction = rows.mean_correction();

        let start = Instant::now();
        let mut rows = ProximityCorrection::new(hemicubes()?, &mesh, reach);
        let solution = Solver::default().solve(&mesh, &mut rows, keep_going)?;
        let surface = VertexMesh::new(&mesh, &solution.radiosity);
        let seconds = start.elapsed().as_secs_f64();
        let errors = truth::compare(&surface, TRUTH);
        let (area, edge) = (errors["area"], errors["edge"]);
        println!(
            "{name:14} {rms:9.2e} {worst:9.2e} {correction:9.2e} | {:8} \
             {seconds:6.1} | {:6.2}% {:6.2}% \
             {:6.2}% {:+6.2}%",
            rows.inner().drawn(),
            100.0 * area.rms,
            100.0 * area.median,
            100.0 * edge.median,
            100.0 * edge.bias
        );
    }
    Ok(())
}

/// Root of the mean square and the largest of (A_i F_ij − A_j F_ji) / min(A_i, A_j), over pairs of
/// elements of which one sees the other.
fn reciprocity(mesh: &Mesh, maker: &mut dyn FormFactors) -> Result<(f64, f64), Error> {
    let elements: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
    let mut rows: Vec<Row> = Vec::with_capacity(elements.len());
    for batch in elements.chunks(maker.preferred_batch_len()) {
        rows.extend(maker.rows(mesh, batch, 1.0)?);
    }
    let flux = |i: usize, j: usize| {
        let found = rows[i].entries.binary_search_by_key(&(j as u32), |e| e.element);
        let share = found.map_or(0, |k| rows[i].entries[k].share);
        mesh.area(elements[i]) * Row::form_factor(share)
    };
    let (mut squares, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for (i, row) in rows.iter().enumerate() {
        for entry in &row.entries {
            let j = entry.element as usize;
            let (here, there) = (flux(i, j), flux(j, i));
            // Met from both sides: once.
            if there > 0.0 && j < i {
                continue;
            }
            let error = (here - there) / mesh.area(elements[i]).min(mesh.area(elements[j]));
            squares += error * error;
            count += 1.0;
            worst = worst.max(error.abs());
        }
    }
    Ok((f64::sqrt(squares / f64::max(count, 1.0)), worst))
}
