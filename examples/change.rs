//! A lamp dimmed and an object moved: what it takes to go on from the old solution, beside starting
//! over.
//!
//!     cargo run --release --example change -- SCENE.obj MATERIAL FACTOR GROUP DX,DY,DZ
//!         [--element-size S] [--hemicube N] [--unshot U] [--tolerance T] [--full-share F] [--cpu]
//!
//! MATERIAL's exitance is multiplied by FACTOR, then GROUP is shifted by so much. After each change:
//! the hemicubes that it takes to go on and to start over, and how far off both are from starting over
//! and going on to a thousandth of the unshot share: the sum over elements of the differences of flux,
//! as a share of what is emitted, and the largest difference relative to the mean radiosity.

use std::num::NonZeroU32;
use std::ops::ControlFlow;
use std::process::ExitCode;
use std::time::Instant;

use glam::{DAffine3, DVec3};
use lexopt::prelude::*;
use radiosity::{
    Backend, BackendRows, Error, Mesh, ProximityCorrection, Rgb, Solution, Solver, load_obj,
};

type Failure = Box<dyn std::error::Error>;
type Rows = ProximityCorrection<BackendRows>;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

struct Args {
    values: Vec<String>,
    element_size: f64,
    hemicube: u32,
    solver: Solver,
    full_share: Option<f64>,
    device: Backend,
}

fn args() -> Result<Args, Failure> {
    let mut parser = lexopt::Parser::from_env();
    let (mut values, mut cpu) = (vec![], false);
    let (mut element_size, mut hemicube, mut full_share) = (None, 128, None);
    let mut solver = Solver::default();
    while let Some(arg) = parser.next()? {
        match arg {
            Long("element-size") => element_size = Some(parser.value()?.parse()?),
            Long("hemicube") => hemicube = parser.value()?.parse()?,
            Long("unshot") => solver.unshot = parser.value()?.parse()?,
            Long("tolerance") => solver.patch_tolerance = parser.value()?.parse()?,
            Long("full-share") => full_share = Some(parser.value()?.parse()?),
            Long("cpu") => cpu = true,
            Value(value) => values.push(value.string()?),
            other => return Err(other.unexpected().into()),
        }
    }
    if values.len() != 5 {
        return Err("give SCENE.obj MATERIAL FACTOR GROUP DX,DY,DZ".into());
    }
    let element_size = element_size.unwrap_or(f64::NAN);
    let device = if cpu { Backend::Cpu } else { Backend::gpu(None)? };
    Ok(Args { values, element_size, hemicube, solver, full_share, device })
}

fn run() -> Result<(), Failure> {
    let Args { values, element_size, hemicube, solver, full_share, device } = args()?;
    let [path, material, factor, group, shift] = &values[..] else { unreachable!("counted") };
    let shift: Vec<f64> = shift.split(',').map(str::parse).collect::<Result<_, _>>()?;
    let shift = DVec3::from_slice(shift.get(..3).ok_or("DX,DY,DZ are three numbers")?);
    let factor: f64 = factor.parse()?;
    let scene = load_obj(path)?;
    let size = if element_size.is_nan() { scene.bounds().diagonal() / 40.0 } else { element_size };

    let mut materials = scene.materials().to_vec();
    let lamp = materials.iter_mut().find(|m| m.name == *material).ok_or("no such material")?;
    lamp.exitance *= factor;
    let dimmed = scene.with_materials(materials)?;
    let moved = dimmed.with_transformed_group(group, DAffine3::from_translation(shift))?;

    let before = Mesh::new(scene, size)?;
    let dimmed = before.with_scene(dimmed)?;
    let after = dimmed.with_scene(moved)?;
    let [name, kind, driver] = device.adapter();
    println!(
        "{path}, {} elements, hemicube {hemicube}, {name} ({kind}), {driver}",
        before.element_count()
    );
    println!("unshot {}, tolerance {}", solver.unshot, solver.patch_tolerance);
    println!(
        "{:22} {:>9} {:>8} {:>7} {:>9} {:>9} {:>9}",
        "", "hemicubes", "shots", "s", "off", "worst", "unshot"
    );

    let rows = |mesh: &Mesh| -> Result<Rows, Error> {
        let rows = device.rows(mesh, hemicube, NonZeroU32::MIN)?;
        let rows = match full_share {
            Some(share) => rows.with_full_share(share),
            None => rows,
        };
        Ok(ProximityCorrection::new(rows, mesh, 1.0))
    };
    let mut told = Told::default();
    let go = |_: &_| ControlFlow::Continue(());

    let start = Instant::now();
    let mut maker = rows(&before)?;
    let mut solve = solver.begin(&before)?;
    solve.run(&mut maker, go)?;
    told.line("as it was", &solve.solution()?, start.elapsed().as_secs_f64(), None);

    for (what, mesh) in [("dimmed", &dimmed), ("moved", &after)] {
        let start = Instant::now();
        let mut over_maker = rows(mesh)?;
        let mut over = solver.begin(mesh)?;
        over.run(&mut over_maker, go)?;
        let (over_solution, over_seconds) = (over.solution()?, start.elapsed().as_secs_f64());
        over.set_limits(solver.unshot / 1000.0, None)?;
        over.run(&mut over_maker, go)?;
        let settled = over.into_solution()?;
        let judge = Some((mesh, &settled));
        let over = format!("{what}: starting over");
        Told::default().line(&over, &over_solution, over_seconds, judge);

        let start = Instant::now();
        if what == "dimmed" {
            solve.update_materials(mesh)?;
        } else {
            let mut new = rows(mesh)?;
            let made = solve.solution()?.rows_made;
            solve.update_geometry(mesh, &mut maker, &mut new, go)?;
            let again = solve.solution()?.rows_made - made;
            println!("    {again} drawn again, {:.1e} in doubt", solve.stale_flux_bound());
            maker = new;
        }
        solve.run(&mut maker, go)?;
        let seconds = start.elapsed().as_secs_f64();
        told.line(&format!("{what}: going on"), &solve.solution()?, seconds, judge);
    }
    Ok(())
}

/// Counts of the line before.
#[derive(Default)]
struct Told {
    rows: u64,
    shots: u64,
}

impl Told {
    fn line(&mut self, what: &str, s: &Solution, seconds: f64, other: Option<(&Mesh, &Solution)>) {
        let (rows, shots) = (s.rows_made - self.rows, s.shots - self.shots);
        (self.rows, self.shots) = (s.rows_made, s.shots);
        let apart = other.map_or(String::new(), |(mesh, other)| {
            let (share, worst) = apart(mesh, s, other);
            format!("{share:9.2e} {worst:9.2e}")
        });
        let unshot = s.ledger.unshot_share();
        println!("{what:22} {rows:9} {shots:8} {seconds:7.1} {apart:19} {unshot:9.2e}");
    }
}

/// Sum of the differences of flux as a share of the emitted, and the largest difference of a
/// radiosity relative to the mean; the worst channel.
fn apart(mesh: &Mesh, a: &Solution, b: &Solution) -> (f64, f64) {
    let (mut sum, mut flux, mut area, mut worst) = (Rgb::ZERO, Rgb::ZERO, 0.0, Rgb::ZERO);
    for e in 0..mesh.element_count() {
        let difference = (a.radiosity[e] - b.radiosity[e]).abs();
        let own = mesh.area(mesh.element(e));
        area += own;
        sum += difference * own;
        flux += b.radiosity[e] * own;
        worst = worst.max(difference);
    }
    ((sum / b.ledger.emitted).max_element(), (worst / (flux / area)).max_element())
}
