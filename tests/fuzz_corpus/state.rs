//! What the fuzz target does with a saved state, and the replay of its corpus.
//!
//! An input is a byte that picks the method and what a file has between the names of mesh and
//! settings and the checksum: these are put around it, so that what they guard is reached.

use std::ops::ControlFlow;
use std::sync::OnceLock;

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::solver::{Method, Progress, SolveSession};
use radiosity::{ErrorKind, FormFactors, Material, Mesh, Rgb, Scene, Solver, Triangle};
use xxhash_rust::xxh3::xxh3_64;

/// Steps, and batches, that a state which is taken goes on by.
const FURTHER: u64 = 3;

/// A box with a lamp for its ceiling, and the same with other colours.
fn meshes() -> &'static [Mesh; 2] {
    static MESHES: OnceLock<[Mesh; 2]> = OnceLock::new();
    MESHES.get_or_init(|| {
        let corner = |k: u32| DVec3::new((k & 1).into(), (k >> 1 & 1).into(), (k >> 2).into());
        let sides =
            [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
        let triangles = sides.into_iter().flat_map(halves).enumerate().map(|(k, corners)| {
            let material = u32::from(k >= 10);
            Triangle { corners, material, ..Default::default() }
        });
        let lamp = Material { exitance: Rgb::new(3.0, 2.0, 0.0), ..Material::grey("lamp", 0.0) };
        let materials = vec![Material::grey("wall", 0.6), lamp];
        let positions = (0..8).map(corner).collect();
        let scene = Scene::new(positions, triangles.collect(), vec!["box".into()], materials);
        let mesh = Mesh::new(scene.unwrap(), 0.8).unwrap();
        let mut materials = mesh.scene().materials().to_vec();
        materials[0].reflectance = Rgb::new(0.0, 0.9, 0.3);
        materials[1].exitance = Rgb::new(0.0, 1.0, 5.0);
        let other = mesh.scene().with_materials(materials).unwrap();
        let other = mesh.with_scene(other).unwrap();
        [mesh, other]
    })
}

fn rows() -> RayRows {
    RayRows::new(&meshes()[0], 64).unwrap()
}

/// Every method; GMRES with few products, so that states stay small.
fn solver(pick: u8) -> Solver {
    let method = match Method::ALL[usize::from(pick) % Method::ALL.len()] {
        Method::Gmres { .. } => Method::Gmres { restart: 4 },
        other => other,
    };
    Solver { unshot: 1e-6, row_memory: 1 << 14, ..Solver::new(method) }
}

fn go(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The bytes before what an input stands for.
fn names(solver: &Solver, rows: &mut RayRows) -> Vec<u8> {
    let mut solve = solver.begin(&meshes()[0]).unwrap();
    solve.advance(rows, |_| ControlFlow::Break(())).unwrap();
    let mut bytes = solve.to_bytes();
    let last = rows.fingerprint();
    let at = bytes.windows(last.len()).position(|w| w == last.as_bytes()).unwrap();
    bytes.truncate(at + last.len());
    bytes
}

/// Reads the state that `input` stands for and goes on from there. Answers whether it was taken;
/// panics where a solve or an error breaks its promises.
pub fn try_state(input: &[u8]) -> bool {
    let Some((&pick, body)) = input.split_first() else { return false };
    let (solver, mut rows) = (solver(pick), rows());
    let mut bytes = names(&solver, &mut rows);
    bytes.extend(body);
    bytes.extend(xxh3_64(&bytes).to_le_bytes());
    let [mesh, other] = meshes();
    let mut solve = match solver.resume_bytes(mesh, &rows, &bytes) {
        Ok(solve) => solve,
        Err(e) => {
            assert!(e.kind() == ErrorKind::File && e.place().starts_with("saved state"), "{e}");
            return false;
        }
    };
    let written = solve.to_bytes();
    let again = solver.resume_bytes(mesh, &rows, &written).unwrap();
    assert!(again.to_bytes() == written, "read and written again");
    check(&solve);
    let steps = solve.solution().unwrap().steps + FURTHER;
    solve.set_limits(1e-6, Some(steps)).unwrap();
    for _ in 0..FURTHER {
        // Flux of 1e300 W may add up to what f64 does not hold, which is an error.
        match solve.advance(&mut rows, go) {
            Ok(None) => check(&solve),
            Ok(Some(_)) => break,
            Err(e) => {
                assert_eq!(e.kind(), ErrorKind::FormFactor, "{e}");
                return true;
            }
        }
    }
    if solve.update_materials(other).is_ok() {
        check(&solve);
    }
    true
}

/// Light is finite, and all of it is accounted for.
fn check(solve: &SolveSession) {
    let Ok(solution) = solve.solution() else { return };
    assert!(solution.ledger.imbalance() <= 1e-9);
    assert_eq!(solution.radiosity.len(), solve.mesh().element_count());
}

/// Inputs that stand for real states: of every method, at its beginning and further on.
#[allow(dead_code, reason = "the fuzz target and the tests use a part each")]
pub fn seeds() -> Vec<(String, Vec<u8>)> {
    let mut seeds = vec![];
    for (pick, method) in (0..).zip(Method::ALL) {
        let (solver, mut rows) = (solver(pick), rows());
        let start = names(&solver, &mut rows).len();
        let mut solve = solver.begin(&meshes()[0]).unwrap();
        for step in 0..8 {
            if solve.advance(&mut rows, go).unwrap().is_some() {
                break;
            }
            let bytes = solve.to_bytes();
            let input = [&[pick], &bytes[start..bytes.len() - 8]].concat();
            if step % 3 == 0 {
                seeds.push((format!("{method}_{step}"), input));
            }
        }
        let bytes = solve.to_bytes();
        seeds.push((format!("{method}_end"), [&[pick], &bytes[start..bytes.len() - 8]].concat()));
    }
    seeds
}
