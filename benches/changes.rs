//! A lamp dimmed and a block moved: what going on from the old solution takes, beside starting
//! over.
//! A table; nothing is repeated. Runs in full only:
//!
//!     RADIOSITY_BENCH=full cargo bench --bench changes
//!
//! After each change: the hemicubes that it takes to go on and to start over, and how far both are
//! from starting over with a thousandth of the unshot share: the sum over elements of the
//! differences of flux, as a share of what is emitted, and the largest difference relative to the
//! mean radiosity.

mod common;

use std::time::Instant;

use common::keep_going;
use glam::{DAffine3, DVec3};
use radiosity::backend::BackendRows;
use radiosity::form_factor::ProximityCorrection;
use radiosity::solver::SolveSession;
use radiosity::{Backend, Error, Mesh, Rgb, Scene, Solution, Solver};

type Rows = ProximityCorrection<BackendRows>;

/// Longest edge of an element, mm.
const ELEMENT_SIZE: f64 = 30.0;

/// Pixels along an edge of a hemicube's top face.
const HEMICUBE: u32 = 128;

/// What is left of the lamp's exitance.
const DIMMED_TO: f64 = 0.5;

/// How far the short block is moved, mm.
const SHIFT: DVec3 = DVec3::new(30.0, 0.0, 0.0);

/// The solution that others are compared with has this share of their unshot flux.
const SETTLED: f64 = 1e-3;

fn main() -> Result<(), Error> {
    if !common::asked_for("changes") {
        return Ok(());
    }
    let device = Backend::Gpu(common::gpu());
    let scene = common::cornell_box();
    let dimmed = dimmed(&scene)?;
    let moved = dimmed.with_transformed_group("short_block", DAffine3::from_translation(SHIFT))?;
    let before = Mesh::new(scene, ELEMENT_SIZE)?;
    let dimmed = before.with_scene(dimmed)?;
    let moved = dimmed.with_scene(moved)?;
    println!("Cornell box, {} elements, hemicube {HEMICUBE}", before.element_count());
    println!(
        "{:22} {:>9} {:>8} {:>7} {:>9} {:>9} {:>9}",
        "", "hemicubes", "shots", "s", "off", "worst", "unshot"
    );

    let solver = Solver::default();
    let mut table = Table::default();
    let start = Instant::now();
    let mut old_rows = rows(&device, &before)?;
    let mut session = solver.begin(&before)?;
    session.run(&mut old_rows, keep_going)?;
    table.line("as it was", &session.solution()?, start, None);

    let settled = start_over(&device, &dimmed, "dimmed: starting over")?;
    let start = Instant::now();
    session.update_materials(&dimmed)?;
    session.run(&mut old_rows, keep_going)?;
    table.line("dimmed: going on", &session.solution()?, start, Some((&dimmed, &settled)));

    let settled = start_over(&device, &moved, "moved: starting over")?;
    let start = Instant::now();
    let mut new_rows = rows(&device, &moved)?;
    move_block(&mut session, &moved, &mut old_rows, &mut new_rows)?;
    session.run(&mut new_rows, keep_going)?;
    table.line("moved: going on", &session.solution()?, start, Some((&moved, &settled)));
    Ok(())
}

fn rows(device: &Backend, mesh: &Mesh) -> Result<Rows, Error> {
    let rows = device.rows(mesh, HEMICUBE)?;
    Ok(ProximityCorrection::new(rows, mesh, 1.0))
}

fn dimmed(scene: &Scene) -> Result<Scene, Error> {
    let mut materials = scene.materials().to_vec();
    for material in &mut materials {
        material.exitance *= DIMMED_TO;
    }
    scene.with_materials(materials)
}

/// Gives the session the moved geometry, and tells how many rows that took.
fn move_block<'a>(
    session: &mut SolveSession<'a>,
    mesh: &'a Mesh,
    old_rows: &mut Rows,
    new_rows: &mut Rows,
) -> Result<(), Error> {
    let made = session.solution()?.rows_made;
    session.update_geometry(mesh, old_rows, new_rows, keep_going)?;
    let remade = session.solution()?.rows_made - made;
    println!("    {remade} drawn again, {:.1e} in doubt", session.stale_flux_bound());
    Ok(())
}

/// Solves from nothing and prints that; then goes on to what is compared with, and returns it.
fn start_over(device: &Backend, mesh: &Mesh, name: &str) -> Result<Solution, Error> {
    let (solver, start) = (Solver::default(), Instant::now());
    let mut rows = rows(device, mesh)?;
    let mut session = solver.begin(mesh)?;
    session.run(&mut rows, keep_going)?;
    let (solution, seconds) = (session.solution()?, start.elapsed());
    session.set_limits(SETTLED * solver.unshot, None)?;
    session.run(&mut rows, keep_going)?;
    let settled = session.into_solution()?;
    Table::default().line(name, &solution, Instant::now() - seconds, Some((mesh, &settled)));
    Ok(settled)
}

/// Rows and shots up to the line before.
#[derive(Default)]
struct Table {
    rows: u64,
    shots: u64,
}

impl Table {
    /// Prints what `solution` took since the line before, and since `start`.
    fn line(
        &mut self,
        name: &str,
        solution: &Solution,
        start: Instant,
        reference: Option<(&Mesh, &Solution)>,
    ) {
        let seconds = start.elapsed().as_secs_f64();
        let (rows, shots) = (solution.rows_made - self.rows, solution.shots - self.shots);
        (self.rows, self.shots) = (solution.rows_made, solution.shots);
        let differences = reference.map_or(String::new(), |(mesh, reference)| {
            let (share, worst) = differences(mesh, solution, reference);
            format!("{share:9.2e} {worst:9.2e}")
        });
        let unshot = solution.ledger.unshot_share();
        println!("{name:22} {rows:9} {shots:8} {seconds:7.1} {differences:19} {unshot:9.2e}");
    }
}

/// Sum of the differences of flux as a share of the emitted, and the largest difference of a
/// radiosity relative to the mean; the worst channel.
fn differences(mesh: &Mesh, a: &Solution, b: &Solution) -> (f64, f64) {
    let (mut sum, mut flux, mut total_area, mut worst) = (Rgb::ZERO, Rgb::ZERO, 0.0, Rgb::ZERO);
    for e in 0..mesh.element_count() {
        let difference = (a.radiosity[e] - b.radiosity[e]).abs();
        let area = mesh.area(mesh.element(e));
        total_area += area;
        sum += difference * area;
        flux += b.radiosity[e] * area;
        worst = worst.max(difference);
    }
    ((sum / b.ledger.emitted).max_element(), (worst / (flux / total_area)).max_element())
}
