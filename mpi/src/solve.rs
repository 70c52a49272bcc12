//! `radiosity-mpi solve`.

use std::num::NonZeroU32;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lexopt::prelude::*;
use radiosity::backend::BackendRows;
use radiosity::form_factor::{ProximityCorrection, SharedRows};
use radiosity::ranks::Ranks;
use radiosity::{Backend, BakeSettings, GatheredMesh, Mesh, Solver, load_obj, write_ply};

use crate::Failure;
use crate::world::World;

/// Between two writings of the state.
const STATE_INTERVAL: Duration = Duration::from_secs(10);

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser, world: &mut World) -> Result<(), Failure> {
    let (mut scene, mut out, mut state) = (None, None, None);
    let (mut size, mut hemicube, mut on_cpu, mut unshot) = (None, 128, false, 1e-3);
    while let Some(arg) = parser.next()? {
        match arg {
            Long("element-size") => size = Some(parser.value()?.parse()?),
            Long("hemicube") => hemicube = parser.value()?.parse()?,
            Long("unshot") => unshot = parser.value()?.parse()?,
            Long("cpu") => on_cpu = true,
            Long("state") => state = Some(PathBuf::from(parser.value()?)),
            Long("out") => out = Some(PathBuf::from(parser.value()?)),
            Value(path) if scene.is_none() => scene = Some(PathBuf::from(path)),
            _ => return Err(arg.unexpected().into()),
        }
    }
    let (Some(scene), Some(out)) = (scene, out) else {
        return Err("solve takes a scene, and --out FILE.ply".into());
    };
    let scene = load_obj(scene)?;
    let size = size.unwrap_or_else(|| BakeSettings::elements_only(&scene).solve.element_size);
    let mesh = Mesh::new(scene, size)?.split_at_contacts(2);
    let backend = if on_cpu { Backend::Cpu } else { Backend::gpu(None)? };
    let source = backend.rows(&mesh, hemicube, NonZeroU32::MIN)?;
    let mut source = ProximityCorrection::new(source, &mesh, 1.0);
    if world.rank() != 0 {
        SharedRows::<ProximityCorrection<BackendRows>>::serve(&mut source, &mesh, world);
        return Ok(());
    }
    let (start, processes) = (Instant::now(), world.size());
    let mut rows = SharedRows::new(source, world);
    let solver = Solver { unshot, ..Solver::default() };
    let mut session = match state.as_ref().filter(|path| path.exists()) {
        Some(path) => solver.resume(&mesh, &rows, path)?,
        None => solver.begin(&mesh)?,
    };
    let (mut written, mut told) = (Instant::now(), Instant::now());
    let stop = loop {
        let stop = session.advance(&mut rows, |progress| {
            if told.elapsed() > Duration::from_secs(5) {
                eprintln!("{:.3} % unshot", 100.0 * progress.unshot_share);
                told = Instant::now();
            }
            ControlFlow::Continue(())
        })?;
        if let Some(path) = &state
            && (stop.is_some() || written.elapsed() > STATE_INTERVAL)
        {
            session.save(path)?;
            written = Instant::now();
        }
        if let Some(stop) = stop {
            break stop;
        }
    };
    println!("{stop:?} after {:.3} s", start.elapsed().as_secs_f64());
    let solution = session.into_solution()?;
    drop(rows);
    println!(
        "{} elements, {} shots, {} rows, {processes} processes",
        mesh.element_count(),
        solution.shots,
        solution.rows_made
    );
    write_ply(out, &GatheredMesh::from_elements(&mesh, &solution.radiosity)?.surface)?;
    Ok(())
}
