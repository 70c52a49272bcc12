//! Scenes of many triangles: loaded, cut into elements, and a few shots of light.

use std::fmt::Write;

use radiosity::backend::cpu::RayRows;
use radiosity::io::read_scene;
use radiosity::{Mesh, Solution, Solver, VertexMesh};

use crate::common::keep_going;

const MATERIALS: &[u8] = b"newmtl lamp\nKe 1\nnewmtl rock\nKd 0.5\n";

/// Loads `obj`, shoots `shots` times, and gives what came out.
fn bake(obj: &str, shots: u64) -> (Mesh, Solution) {
    let scene = read_scene("it.obj", obj.as_bytes(), &[("it.mtl", MATERIALS)]).unwrap();
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let mut rays = RayRows::new(&mesh, 4096).unwrap();
    let solver = Solver { max_steps: Some(shots), ..Default::default() };
    let solution = solver.solve(&mesh, &mut rays, keep_going).unwrap();
    let surface = VertexMesh::new(&mesh, &solution.radiosity);
    let fine = |b: &radiosity::Rgb| b.is_finite() && b.min_element() >= 0.0;
    assert!(solution.radiosity.iter().all(fine) && surface.radiosity.iter().all(fine));
    assert!(solution.ledger.imbalance() <= 1e-9, "{}", solution.ledger.imbalance());
    (mesh, solution)
}

/// A lamp over hills: 2 n² triangles, and two.
fn hills(n: usize) -> String {
    let mut obj =
        String::from("mtllib it.mtl\nv 0 0 2\nv 0 1 2\nv 1 1 2\nv 1 0 2\nusemtl lamp\nf 1 2 3 4\n");
    for i in 0..=n {
        for j in 0..=n {
            let (x, y) = (i as f64 / n as f64, j as f64 / n as f64);
            let z = 0.1 * (20.0 * x).sin() * (20.0 * y).cos();
            writeln!(obj, "v {x} {y} {z}").unwrap();
        }
    }
    obj += "usemtl rock\n";
    for i in 0..n {
        for j in 0..n {
            let corner = |i: usize, j: usize| 5 + i * (n + 1) + j;
            let (a, b, c, d) =
                (corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
            writeln!(obj, "f {a} {b} {c}\nf {a} {c} {d}").unwrap();
        }
    }
    obj
}

/// The lamp is of two elements and faces the hills. By the form factor between unit squares at
/// distance 2 (0.0686; the hills are some 5 % nearer here and farther there), that share is
/// absorbed or goes on.
fn hills_are_lit(n: usize) {
    let (mesh, solution) = bake(&hills(n), 2);
    assert_eq!(mesh.element_count(), 2 * n * n + 2);
    let caught = 1.0 - solution.ledger.escaped.x / solution.ledger.emitted.x;
    println!("caught {caught}");
    // Rays: √(0.0686 / 8192) = 0.003; four of them, and 10 % for the hills.
    assert!((caught - 0.0686).abs() < 0.012 + 0.007, "{caught}");
}

#[test]
#[ignore = "slow"]
fn hills_of_20_000_triangles() {
    hills_are_lit(100);
}

#[test]
#[ignore = "slow"]
fn hills_of_a_million_triangles() {
    hills_are_lit(708);
}

#[test]
#[ignore = "slow"]
fn ten_thousand_coincident_triangles() {
    let n = 10_000;
    let lamp = "mtllib it.mtl\nv 0 0 2\nv 0 1 2\nv 1 1 2\nv 1 0 2\nusemtl lamp\nf 1 2 3 4\n";
    let floor = "v 0 0 0\nv 2 0 0\nv 0 2 0\nusemtl rock\n";
    let (mesh, solution) = bake(&format!("{lamp}{floor}{}", "f 5 6 7\n".repeat(n)), 2);
    assert_eq!(mesh.element_count(), n + 2);
    // Of triangles at one place light meets the first, and all of what is caught.
    let caught = solution.radiosity[2].x * mesh.area(mesh.element(2));
    let reflected = 0.5 * (solution.ledger.emitted.x - solution.ledger.escaped.x);
    assert!(caught > 0.01 && (caught / reflected - 1.0).abs() < 1e-9, "{caught} {reflected}");
    assert!(solution.radiosity[3..].iter().all(|&b| b == radiosity::Rgb::ZERO));
}
