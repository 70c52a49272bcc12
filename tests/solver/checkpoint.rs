//! Solves that are interrupted: by errors, by being saved and read again, by SIGKILL. All end with the
//! bits of one that was not. No GPU needed.

use std::ops::ControlFlow;

use glam::{DAffine3, DVec3};
use radiosity::{
    Error, ErrorKind, FormFactors, Mesh, Method, NodeId, Progress, RayRows, Row, Scene, Solution,
    Solver, StopReason,
};

use crate::common::{cornell_box, keep_going};

/// Rays, fewer for dim patches: rows depend on when they are made.
fn rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap()
}

/// Every method with memory for a part of the rows; GMRES in short cycles.
fn solvers() -> [Solver; 6] {
    Method::ALL.map(|method| {
        let method = match method {
            Method::Gmres { .. } => Method::Gmres { restart: 3 },
            other => other,
        };
        Solver { unshot: 1e-4, row_memory: 100_000, ..Solver::new(method) }
    })
}

/// The same to the last bit, in all that is told of light.
fn same(a: &Solution, b: &Solution) {
    assert!(a.radiosity == b.radiosity && a.ledger == b.ledger, "{}", a.method);
    assert_eq!((a.steps, a.shots, a.stop), (b.steps, b.shots, b.stop), "{}", a.method);
}

#[test]
fn resuming_after_every_batch_changes_no_bit() {
    let mesh = cornell_box(150.0);
    for solver in solvers() {
        let whole = solver.solve(&mesh, &mut rays(&mesh), keep_going).unwrap();
        let mut solve = solver.begin(&mesh).unwrap();
        let mut batches = 0;
        loop {
            let mut rows = rays(&mesh);
            let stop = solve.advance(&mut rows, keep_going).unwrap();
            let bytes = solve.to_bytes();
            if stop.is_some() {
                break;
            }
            batches += 1;
            solve = solver.resume_bytes(&mesh, &rows, &bytes).unwrap();
            assert!(solve.to_bytes() == bytes, "{}, batch {batches}", solver.method);
        }
        println!("{}: {batches} batches", solver.method);
        assert!(batches > 20 || solver.method == Method::Direct);
        same(&solve.into_solution().unwrap(), &whole);
    }
}

/// Rays that fail after so many batches.
struct Failing(RayRows, u32);

impl FormFactors for Failing {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], share: f64) -> Result<Vec<Row>, Error> {
        let lost = Error::new(ErrorKind::Device, "device", "lost", "open it again");
        self.1 = self.1.checked_sub(1).ok_or(lost)?;
        self.0.rows(mesh, patches, share)
    }

    fn preferred_batch_len(&self) -> usize {
        self.0.preferred_batch_len()
    }
}

#[test]
fn row_errors_lose_no_progress() {
    let mesh = cornell_box(150.0);
    for solver in solvers() {
        let whole = solver.solve(&mesh, &mut rays(&mesh), keep_going).unwrap();
        let mut solve = solver.begin(&mesh).unwrap();
        let mut failed = 0;
        let stop = loop {
            match solve.run(&mut Failing(rays(&mesh), 7), keep_going) {
                Ok(stop) => break stop,
                Err(e) => assert_eq!(e.kind(), ErrorKind::Device),
            }
            failed += 1;
            let ledger = solve.solution().unwrap().ledger;
            assert!(ledger.imbalance() <= 1e-9);
            // A direct solve has all its rows at once or none.
            if solver.method == Method::Direct {
                break solve.run(&mut rays(&mesh), keep_going).unwrap();
            }
        };
        println!("{}: failed {failed} times", solver.method);
        assert!(failed > 0 && stop == StopReason::Converged);
        same(&solve.into_solution().unwrap(), &whole);
    }
}

#[test]
fn cancelled_solve_converges_to_same_light() {
    let mesh = cornell_box(300.0);
    for solver in solvers() {
        let whole = Solver { unshot: 1e-12, ..solver };
        let whole = whole.solve(&mesh, &mut rays(&mesh).with_full_share(0.0), keep_going).unwrap();
        let mut solve = Solver { unshot: 1e-12, ..solver }.begin(&mesh).unwrap();
        let (mut calls, mut rows) = (0, rays(&mesh).with_full_share(0.0));
        let stop = loop {
            let every = |_: &Progress| {
                calls += 1;
                if calls % 37 == 0 && solver.method != Method::Direct {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            };
            match solve.run(&mut rows, every).unwrap() {
                StopReason::Cancelled => {
                    assert!(solve.solution().unwrap().ledger.imbalance() <= 1e-9)
                }
                stop => break stop,
            }
        };
        assert_eq!(stop, StopReason::Converged);
        let s = solve.into_solution().unwrap();
        for (a, b) in s.radiosity.iter().zip(&whole.radiosity) {
            // What 1e-12 of the light can bring, to elements with a thousandth of its mean.
            assert!((*a - *b).abs().cmple(1e-8 * b.abs()).all(), "{}: {a} {b}", solver.method);
        }
    }
}

/// A solve whose scene has changed, with old rows that nobody can make again.
#[test]
fn changed_solve_saves_its_old_rows() {
    let mesh = cornell_box(150.0);
    let by = DAffine3::from_translation(DVec3::new(5.0, 0.0, 5.0));
    let moved =
        mesh.with_scene(mesh.scene().with_transformed_group("short_block", by).unwrap()).unwrap();
    for method in Method::ALL {
        let solver = Solver { unshot: 0.02, ..Solver::new(method) };
        let (mut before, mut after) = (rays(&mesh), rays(&moved));
        let mut solve = solver.begin(&mesh).unwrap();
        solve.run(&mut before, keep_going).unwrap();
        solve.update_geometry(&moved, &mut before, &mut after, keep_going).unwrap();
        assert!(solve.stale_flux_bound() > 0.0);
        solve.advance(&mut after, keep_going).unwrap();
        let bytes = solve.to_bytes();
        let mut again = solver.resume_bytes(&moved, &after, &bytes).unwrap();
        assert!(again.to_bytes() == bytes && again.stale_flux_bound() == solve.stale_flux_bound());
        for solve in [&mut solve, &mut again] {
            solve.set_limits(1e-3, None).unwrap();
            solve.run(&mut rays(&moved), keep_going).unwrap();
        }
        same(&again.into_solution().unwrap(), &solve.into_solution().unwrap());
    }
}

#[test]
fn rejects_states_of_other_solves_and_damaged_files() {
    let mesh = cornell_box(300.0);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("light.state");
    let solver = Solver::new(Method::GaussSeidel);
    let mut rows = rays(&mesh);
    let mut solve = solver.begin(&mesh).unwrap();
    solve.advance(&mut rows, keep_going).unwrap();
    solve.save(&path).unwrap();
    let says = |solver: Solver, mesh: &Mesh, rows: &RayRows, words: &str| {
        let Err(e) = solver.resume(mesh, rows, &path) else { panic!("taken: {words}") };
        let (kind, text) = (e.kind(), e.to_string());
        assert!(kind == ErrorKind::File && text.contains(words), "{words}: {text}");
        assert!(text.contains("light.state"), "{text}");
    };
    assert!(solver.resume(&mesh, &rows, &path).is_ok());
    // Stop rules and memory are no part of what it is.
    let other = Solver { unshot: 0.5, max_steps: Some(3), row_memory: 0, ..solver };
    assert!(other.resume(&mesh, &rows, &path).is_ok());
    let finer = cornell_box(200.0);
    says(solver, &finer, &rows, "fingerprint of the mesh");
    let mut materials = mesh.scene().materials().to_vec();
    materials[0].reflectance.x += 1e-16;
    let repainted = mesh.scene().with_materials(materials).unwrap();
    says(solver, &mesh.with_scene(repainted).unwrap(), &rows, "fingerprint of the mesh");
    let mut materials = mesh.scene().materials().to_vec();
    materials.iter_mut().for_each(|m| m.exitance *= 1.0 + f64::EPSILON);
    let brighter = mesh.scene().with_materials(materials).unwrap();
    says(solver, &mesh.with_scene(brighter).unwrap(), &rows, "fingerprint of the mesh");
    let by = DAffine3::from_translation(DVec3::new(0.0, 0.0, 1e-9));
    let shifted = mesh.scene().with_transformed_group("short_block", by).unwrap();
    says(solver, &mesh.with_scene(shifted).unwrap(), &rows, "fingerprint of the mesh");
    // Walls that are a group each are clusters each, though all is where it was.
    let mut apart = mesh.scene().triangles().to_vec();
    (0..).zip(&mut apart).for_each(|(k, t)| t.group = k);
    let groups = (0..apart.len()).map(|k| k.to_string()).collect();
    let (positions, materials) = (mesh.scene().positions(), mesh.scene().materials());
    let apart = Scene::new(positions.to_vec(), apart, groups, materials.to_vec()).unwrap();
    says(solver, &Mesh::new(apart, 300.0).unwrap(), &rows, "fingerprint of the mesh");
    says(Solver::new(Method::Jacobi), &mesh, &rows, "'GaussSeidel'; here it is 'Jacobi'");
    says(solver, &mesh, &RayRows::new(&mesh, 512).unwrap(), "here it is '512 rays");
    let whole = std::fs::read(&path).unwrap();
    for length in [0, 7, 8, 15, 100, whole.len() - 1] {
        std::fs::write(&path, &whole[..length]).unwrap();
        says(solver, &mesh, &rows, if length < 8 { "header" } else { "checksum" });
    }
    for at in [9, 40, whole.len() / 2, whole.len() - 1] {
        let mut damaged = whole.clone();
        damaged[at] ^= 1;
        std::fs::write(&path, damaged).unwrap();
        says(solver, &mesh, &rows, "checksum");
    }
    // Another file takes the place of the old one, which nobody writes into: it is still there where
    // it has a second name.
    std::fs::write(&path, "old").unwrap();
    let second = folder.path().join("second");
    std::fs::hard_link(&path, &second).unwrap();
    solve.save(&path).unwrap();
    assert!(std::fs::read(&path).unwrap() == whole && std::fs::read(&second).unwrap() == b"old");
    let Err(e) = solver.resume(&mesh, &rows, folder.path().join("none")) else { panic!() };
    assert!(e.kind() == ErrorKind::File && e.to_string().contains("none"), "{e}");
    let e = solve.save(folder.path().join("no/such/folder")).unwrap_err();
    assert!(e.kind() == ErrorKind::File && e.to_string().contains("no/such"), "{e}");
}
