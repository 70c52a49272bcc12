//! `radiosity-mpi view-factors`.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use lexopt::prelude::*;
use radiosity::SceneSettings;
use radiosity::io::view_factors::{read_rows, write_rows};
use radiosity::io::{SpecularSurfaces, write_npz};
use radiosity::ranks::Ranks;
use radiosity::view_factor::{MatrixRows, PartialMatrix};

use crate::Failure;
use crate::world::World;

/// Between two writings of what is done: at least, and in times of what the last one took.
const MIN_INTERVAL: Duration = Duration::from_secs(1);
const WRITINGS: u32 = 20;

/// Runs the command.
pub fn run(parser: &mut lexopt::Parser, world: &mut World) -> Result<(), Failure> {
    let (mut scene, mut out, mut checkpoint) = (None, None, None);
    let (mut error, mut two_sided) = (1e-4, vec![]);
    let mut reading = SceneSettings::default();
    reading.specular = SpecularSurfaces::Ignore;
    while let Some(arg) = parser.next()? {
        match arg {
            Long("facets") => reading.facets = true,
            Long("error") => error = parser.value()?.parse()?,
            Long("two-sided") => two_sided.push(parser.value()?.string()?),
            Long("checkpoint") => checkpoint = Some(PathBuf::from(parser.value()?)),
            Long("out") => out = Some(PathBuf::from(parser.value()?)),
            Value(path) if scene.is_none() => scene = Some(PathBuf::from(path)),
            _ => return Err(arg.unexpected().into()),
        }
    }
    let (Some(scene), Some(out)) = (scene, out) else {
        return Err("view-factors takes a scene, and --out FILE.npz".into());
    };
    let scene = reading.load(scene)?;
    let mut groups = vec![];
    for name in &two_sided {
        let before = groups.len();
        let facet = format!("{name}/");
        let matching = |group: &str| group == name || reading.facets && group.starts_with(&facet);
        let names = scene.groups().iter().enumerate();
        groups.extend(names.filter(|(_, group)| matching(group)).map(|(index, _)| index));
        if groups.len() == before {
            return Err(format!("--two-sided: no group '{name}' in the scene").into());
        }
    }
    let done = match checkpoint.as_ref().filter(|path| path.exists()) {
        Some(path) => Some(read_rows(path)?),
        None => None,
    };
    let is_first = world.rank() == 0;
    let (start, mut told) = (Instant::now(), Instant::now());
    let (mut written, mut interval, mut failure) = (Instant::now(), MIN_INTERVAL, None);
    let progress = |part: &PartialMatrix, done, of| {
        if is_first && told.elapsed() > Duration::from_secs(5) {
            eprintln!("{done} of {of} polygons");
            told = Instant::now();
        }
        if let Some(path) = checkpoint.as_ref().filter(|_| is_first && written.elapsed() > interval)
        {
            let start = Instant::now();
            failure = write_rows(path, part).err();
            interval = MIN_INTERVAL.max(WRITINGS * start.elapsed());
            written = Instant::now();
        }
        if failure.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let all = 0..MatrixRows::new(scene.groups(), &groups).names.len();
    let rows = PartialMatrix::make(&scene, error, &groups, all, done, world, progress)?;
    if let Some(failure) = failure {
        return Err(failure.into());
    }
    if is_first {
        if let Some(path) = &checkpoint {
            write_rows(path, &rows)?;
        }
        let matrix = rows.into_matrix()?;
        let nonzeros: usize = matrix.factors.iter().map(Vec::len).sum();
        let (seconds, processes) = (start.elapsed().as_secs_f64(), world.size());
        println!(
            "{} groups, {nonzeros} nonzeros, {seconds:.3} s, {processes} processes",
            matrix.names.len()
        );
        write_npz(out, &matrix)?;
    }
    Ok(())
}
