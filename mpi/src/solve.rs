//! `radiosity-mpi solve`: rows of the solve and points of the gather are shared out.
//!
//! ```text
//! process 0     solve ── radiosity ─→ all      gather ─→ file
//! the others    rows                           points
//! ```

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lexopt::prelude::*;
use radiosity::backend::BackendRows;
use radiosity::form_factor::{ProximityCorrection, SharedRows};
use radiosity::gather::{RefinementSettings, SharedGather, gather_at_vertices};
use radiosity::ranks::Ranks;
use radiosity::scene::Rgb;
use radiosity::{Backend, BakeSettings, GatheredMesh, Mesh, Scene, Solver, load_obj, write_ply};

use crate::Failure;
use crate::world::World;

/// Between two writings of the state.
const STATE_INTERVAL: Duration = Duration::from_secs(10);

/// The graphics device; rays on the CPU where the program was built without.
fn device() -> Result<Backend, radiosity::Error> {
    #[cfg(feature = "gpu")]
    return Backend::gpu(None);
    #[cfg(not(feature = "gpu"))]
    Ok(Backend::Cpu)
}

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser, world: &mut World) -> Result<(), Failure> {
    let (mut scene, mut out, mut state) = (None, None, None);
    let (mut size, mut hemicube, mut on_cpu, mut unshot) = (None, 128, false, 1e-3);
    let mut gather = None;
    while let Some(arg) = parser.next()? {
        match arg {
            Long("element-size") => size = Some(parser.value()?.parse()?),
            Long("hemicube") => hemicube = parser.value()?.parse()?,
            Long("unshot") => unshot = parser.value()?.parse()?,
            Long("gather") => gather = Some(parser.value()?.parse()?),
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
    let gather = gather.map(|error| FinalGather::new(error, &scene)).transpose()?;
    let size = size.unwrap_or_else(|| BakeSettings::elements_only(&scene).solve.element_size);
    let mesh = Mesh::new(scene, size)?.split_at_contacts(2);
    let backend = if on_cpu { Backend::Cpu } else { device()? };
    let source = backend.rows(&mesh, hemicube)?;
    let mut source = ProximityCorrection::new(source, &mesh, 1.0);
    if world.rank() != 0 {
        SharedRows::<ProximityCorrection<BackendRows>>::serve(&mut source, &mesh, world);
        return match gather {
            Some(gather) => gather.serve(&mesh, &backend, world),
            None => Ok(()),
        };
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
    let solved = GatheredMesh::from_elements(&mesh, &solution.radiosity)?;
    let light = match gather {
        Some(gather) => gather.drive(&solved, &solution.radiosity, &backend, world)?,
        None => solved,
    };
    write_ply(out, &light.surface)?;
    Ok(())
}

/// Vertices that gather the light of a solve, in one pass.
struct FinalGather {
    mesh: Mesh,
    rays: u32,
    refinement: RefinementSettings,
}

impl FinalGather {
    /// As fine as a bake of `scene` to this error begins with.
    fn new(error: f64, scene: &Scene) -> Result<FinalGather, Failure> {
        if !(error > 0.0 && error < 1.0) {
            return Err(format!("--gather {error}: an error is above 0 and below 1").into());
        }
        let settings = BakeSettings::for_error(error, scene).gather;
        let settings = settings.ok_or("a bake to an error gathers")?;
        let mesh = Mesh::new(scene.clone(), settings.element_size)?;
        let mesh = mesh.split_at_contacts(settings.contact_levels);
        let mut refinement = settings.refinement;
        refinement.gather_passes = 1;
        Ok(FinalGather { mesh, rays: settings.rays, refinement })
    }

    /// Shares the gather of the `solved` light out.
    fn drive(
        &self,
        solved: &GatheredMesh,
        radiosity: &[Rgb],
        backend: &Backend,
        world: &mut World,
    ) -> Result<GatheredMesh, Failure> {
        let start = Instant::now();
        let bytes = radiosity.iter().flat_map(Rgb::to_array).flat_map(f64::to_le_bytes);
        world.all_gather(&bytes.collect::<Vec<u8>>());
        let gatherer = backend.gather(&solved.mesh, self.rays)?;
        let mut gatherer = SharedGather::new(gatherer, solved, world);
        let mut told = Instant::now();
        let light =
            gather_at_vertices(solved, &self.mesh, &self.refinement, &mut gatherer, |progress| {
                if told.elapsed() > Duration::from_secs(5) {
                    eprintln!("{} of {} vertices", progress.gathered, progress.total);
                    told = Instant::now();
                }
                ControlFlow::Continue(())
            })?;
        let seconds = start.elapsed().as_secs_f64();
        println!("{} gathers after {seconds:.3} s", light.gather_count);
        Ok(light)
    }

    /// Gathers for process 0 the light of its solve, over the elements of `mesh`.
    fn serve(&self, mesh: &Mesh, backend: &Backend, world: &mut World) -> Result<(), Failure> {
        let of_all = world.all_gather(&[]);
        let (numbers, _) = of_all[0].as_chunks();
        let numbers: Vec<f64> = numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
        let (radiosity, _) = numbers.as_chunks();
        let radiosity: Vec<Rgb> = radiosity.iter().map(|rgb| Rgb::from_array(*rgb)).collect();
        let solved = GatheredMesh::from_elements(mesh, &radiosity)?;
        let mut gatherer = backend.gather(&solved.mesh, self.rays)?;
        SharedGather::serve(&mut gatherer, &solved, world);
        Ok(())
    }
}
