//! What elements of a textured wall reflect and emit, and what solvers make of it.

use std::f64::consts::PI;

use radiosity::solver::Method;
use radiosity::{Material, Mesh, Rgb, Solution, Solver};

use crate::common::textured::{
    GREEN, RED, box_with_floor, box_with_halves, box_with_wall, checkerboard, elements_of, mean_of,
    noise, tga,
};
use crate::common::{closed_forms, keep_going};

/// Down to where light no longer matters, element by element.
fn solver(method: Method) -> Solver {
    Solver { unshot: 1e-9, min_patch_level: Mesh::MAX_DEPTH, ..Solver::new(method) }
}

fn solve(mesh: &Mesh, method: Method) -> Solution {
    let mut rows = closed_forms::exact();
    solver(method).solve(mesh, &mut rows, keep_going).unwrap()
}

#[test]
fn elements_have_the_means_of_their_own_pieces() {
    let image = tga(2, &[RED, GREEN]);
    let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", &image);
    assert!(
        scene
            .materials()
            .iter()
            .find(|m| m.name == "wall")
            .unwrap()
            .reflectance
            .abs_diff_eq(Rgb::new(0.25, 0.25, 0.0), 1e-12)
    );
    let mesh = Mesh::new(scene, 0.4).unwrap();
    let wall = elements_of(&mesh, "wall");
    assert_eq!(wall.len(), 32);
    for &e in &wall {
        let left = mesh.centroid(mesh.element(e)).y < 0.5;
        let reflectance = if left { Rgb::new(0.5, 0.0, 0.0) } else { Rgb::new(0.0, 0.5, 0.0) };
        // A black piece has 1e-9 of the mean.
        assert!(mesh.reflectance(e).abs_diff_eq(reflectance, 3e-10), "{e}: {reflectance}");
    }
    let other = elements_of(&mesh, "sides")[0];
    assert_eq!(mesh.reflectance(other), Rgb::splat(0.5));
}

#[test]
fn halves_of_a_texture_are_walls_of_those_colours() {
    let image = tga(2, &[RED, GREEN]);
    let textured = box_with_halves(["wall", "wall"], "newmtl wall\nKd 0.5\nmap_Kd a.tga", &image);
    let plain = "newmtl red\nKd 0.5 0 0\nnewmtl green\nKd 0 0.5 0";
    let plain = box_with_halves(["red", "green"], plain, &image);
    let [textured, plain] = [textured, plain].map(|scene| Mesh::new(scene, 0.4).unwrap());
    for method in [Method::Shooting { overshoot: false }, Method::GaussSeidel] {
        let [a, b] = [&textured, &plain].map(|mesh| solve(mesh, method));
        for (e, (a, b)) in a.radiosity.iter().zip(&b.radiosity).enumerate() {
            // 1e-9 are unshot; what is black in the texture reflects 1e-9 of the light.
            assert!(a.distance(*b) < 1e-6 * b.length(), "{method:?}, element {e}: {a} {b}");
        }
        assert!(a.ledger.imbalance() < 1e-9);
        // It matters: light is redder on the side of the red half.
        let floor = elements_of(&textured, "floor");
        let near_red = |e: &&usize| textured.centroid(textured.element(**e)).y < 0.5;
        let red: Vec<usize> = floor.iter().filter(near_red).copied().collect();
        let mean = mean_of(&textured, &red, &a.radiosity);
        assert!(mean.x > 1.02 * mean.y, "{mean}");
    }
}

#[test]
fn fine_noise_is_its_mean_far_away() {
    let scene = box_with_floor("newmtl floor\nKd 0.8\nmap_Kd a.tga", &noise(4096));
    let mean = scene.materials().iter().find(|m| m.name == "floor").unwrap().reflectance;
    // 0.31: the integral of the curve of sRGB, of which 16 million values err by 1e-4, and 8 bits
    // by a thousandth.
    assert!(mean.abs_diff_eq(Rgb::splat(0.8 * 0.3103), 2e-3), "{mean}");
    let even = box_with_floor(&format!("newmtl floor\nKd {} {} {}", mean.x, mean.y, mean.z), &[]);
    let [noise, even] = [scene, even].map(|scene| Mesh::new(scene, 0.3).unwrap());
    let [a, b] = [&noise, &even].map(|mesh| solve(mesh, Method::GaussSeidel));
    for e in elements_of(&even, "sides").into_iter().chain(elements_of(&even, "ceiling")) {
        let (a, b) = (a.radiosity[e], b.radiosity[e]);
        assert!(a.distance(b) < 0.01 * b.length(), "element {e}: {a} {b}");
    }
}

#[test]
fn changed_material_scales_its_texture() {
    let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", &tga(2, &[RED, GREEN]));
    let wall = scene.materials().iter().position(|m| m.name == "wall").unwrap();
    let mut materials = scene.materials().to_vec();
    materials[wall].reflectance *= 0.5;
    let darker = scene.with_materials(materials.clone()).unwrap();
    let mesh = Mesh::new(scene.clone(), 0.4).unwrap();
    let changed = mesh.with_scene(darker).unwrap();
    for e in elements_of(&mesh, "wall") {
        assert!(changed.reflectance(e).abs_diff_eq(0.5 * mesh.reflectance(e), 1e-15));
    }
    // No point reflects more than it may: 0.98.
    materials[wall].reflectance = Rgb::splat(0.9);
    let brighter = scene.with_materials(materials).unwrap();
    let t = (0..).find(|&t| scene.textures(t).is_some()).unwrap();
    let most = brighter.reflectance_at(t, [0.15, 0.1]);
    assert!(most.abs_diff_eq(Rgb::new(0.98, 0.0, 0.9), 1e-12), "{most}");
    // A solve goes over to it, and finds what one from the start finds.
    let mut session = solver(Method::GaussSeidel).begin(&mesh).unwrap();
    let mut rows = closed_forms::exact();
    session.run(&mut rows, keep_going).unwrap();
    session.update_materials(&changed).unwrap();
    session.run(&mut rows, keep_going).unwrap();
    let [gone_on, anew] = [session.into_solution().unwrap(), solve(&changed, Method::GaussSeidel)];
    for (a, b) in gone_on.radiosity.iter().zip(&anew.radiosity) {
        assert!(a.distance(*b) < 1e-6 * b.length(), "{a} {b}");
    }
}

#[test]
fn triangles_emit_the_means_of_their_textures() {
    let image = tga(2, &[RED, GREEN]);
    let scene = box_with_halves(["wall", "wall"], "newmtl wall\nKd 0.5\nmap_Ke a.tga", &image);
    let lit: Vec<usize> =
        (0..scene.triangles().len()).filter(|&t| scene.textures(t).is_some()).collect();
    let exitances: Vec<Rgb> = lit.iter().map(|&t| scene.exitance(t)).collect();
    let (red, green) = (PI * Rgb::X, PI * Rgb::Y);
    for (found, wanted) in exitances.iter().zip([red, red, green, green]) {
        assert!(found.abs_diff_eq(wanted, 1e-12), "{found} {wanted}");
    }
    let Material { exitance, .. } = scene.material(lit[0]);
    assert!(exitance.abs_diff_eq(0.5 * (red + green), 1e-12), "{exitance}");
    assert!(scene.exitance_at(lit[0], [0.3, 0.2]).abs_diff_eq(red, 1e-12));
    let mesh = Mesh::new(scene, 0.4).unwrap();
    let solution = solve(&mesh, Method::GaussSeidel);
    assert!((solution.ledger.emitted.x - (PI + PI / 2.0)).abs() < 1e-9);
}

#[test]
fn saved_states_know_their_textures() {
    let state = |image: &[u8]| {
        let scene = box_with_wall("newmtl wall\nKd 0.5\nmap_Kd a.tga", image);
        Mesh::new(scene, 0.4).unwrap()
    };
    let [board, halves] = [checkerboard(2), tga(2, &[[255; 3], [0; 3]])].map(|image| state(&image));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("state");
    let mut rows = closed_forms::exact();
    let mut session = Solver::default().begin(&board).unwrap();
    session.advance(&mut rows, keep_going).unwrap();
    session.save(&path).unwrap();
    Solver::default().resume(&board, &rows, &path).unwrap();
    assert!(Solver::default().resume(&halves, &rows, &path).is_err());
}
