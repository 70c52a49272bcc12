//! Solves that are interrupted: by errors, by being saved and read again, by SIGKILL. All end with
//! the bits of one that was not. No GPU needed.

use glam::{DAffine3, DVec3};
use radiosity::backend::cpu::RayRows;
use radiosity::scene::{IntensityDistribution, Luminaire, SkyDistribution};
use radiosity::solver::Method;
use radiosity::{ErrorKind, Mesh, Rgb, Scene, Sky, Solver, Sun};

use crate::common::measures::assert_same_bits;
use crate::common::{cornell_box, keep_going};

/// Rays, fewer for dim patches: rows depend on when they are made.
fn rays(mesh: &Mesh) -> RayRows {
    RayRows::new(mesh, 1024).unwrap()
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
        assert_same_bits(&again.into_solution().unwrap(), &solve.into_solution().unwrap());
    }
}

#[test]
fn a_state_is_of_one_sky_and_its_luminaires() {
    let mesh = cornell_box(300.0);
    let under = |sky: Sky| mesh.with_scene(mesh.scene().clone().with_sky(sky).unwrap()).unwrap();
    let overcast =
        |zenith| Sky::new(SkyDistribution::OVERCAST, zenith, DVec3::Y, DVec3::Y).unwrap();
    let sun = |direction| Sun { direction, irradiance: Rgb::ONE };
    let skies = [
        Sky::default(),
        Sky::uniform(Rgb::ONE),
        overcast(Rgb::ONE),
        overcast(Rgb::new(1.0, 1.0, 1.1)),
        overcast(Rgb::ONE).with_sun(sun(DVec3::Y)).unwrap(),
        overcast(Rgb::ONE).with_sun(sun(DVec3::X)).unwrap(),
    ];
    let lamp = Luminaire::new(
        IntensityDistribution::isotropic(1.0).unwrap(),
        DVec3::splat(300.0),
        DVec3::NEG_Y,
    );
    let with = |luminaire: Luminaire| {
        let scene = mesh.scene().clone().with_luminaires(vec![luminaire]).unwrap();
        mesh.with_scene(scene).unwrap()
    };
    let dimmed = Luminaire { scale: Rgb::splat(0.5), ..lamp.clone() };
    let meshes: Vec<Mesh> = skies.into_iter().map(under).chain([lamp, dimmed].map(with)).collect();
    let solver = Solver::new(Method::Jacobi);
    for (k, mesh) in meshes.iter().enumerate() {
        let mut solve = solver.begin(mesh).unwrap();
        solve.advance(&mut rays(mesh), keep_going).unwrap();
        let state = solve.to_bytes();
        for (l, other) in meshes.iter().enumerate() {
            let taken = solver.resume_bytes(other, &rays(other), &state);
            assert_eq!(taken.is_ok(), k == l, "saved under {k}, resumed under {l}");
        }
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
    // Another file takes the place of the old one, which nobody writes into: it is still there
    // where it has a second name.
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
