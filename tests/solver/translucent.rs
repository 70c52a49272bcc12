//! Surfaces that let light through diffusely: closed forms, by all methods. No GPU needed.
//!
//! Each room is an integrating sphere: every element sends to all of its room by their areas, so
//! that all get the same irradiance H. With a translucent wall between two rooms
//!
//! ```text
//!   A₁ H₁ = Σ A (E + ρ H₁) + A_w τ H₂          and the same of the other room
//! ```

use radiosity::form_factor::{Entry, Row};
use radiosity::mesh::NodeId;
use radiosity::scene::Sides;
use radiosity::solver::{Method, StopReason};
use radiosity::{Error, FormFactors, Material, Mesh, Rgb, Scene, Solution, Solver, Triangle};

use crate::common::changes::{assert_balanced, by_elements, flux_difference, painted};
use crate::common::keep_going;
use crate::common::measures::assert_same_bits;
use crate::common::scenes::{Quad, paint, quads, walls};

/// What shares of 2⁻³² that are rounded, and 1e-12 of light that is unshot, can be off by in rooms
/// that keep 0.999 of theirs: a thousand times that, some hundred elements a row.
const ROUNDING: f64 = 1e-6;

/// All of a room gets the same light, wherever it is from. Rooms are told apart by x = 1.
struct Spheres;

impl FormFactors for Spheres {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        let row = |&patch: &NodeId| {
            let own: Vec<usize> = (0..mesh.element_count())
                .filter(|&e| room(mesh, mesh.element(e)) == room(mesh, patch))
                .collect();
            let area = |e: usize| mesh.area(mesh.element(e));
            let total: f64 = own.iter().map(|&e| area(e)).sum();
            let (mut sum, mut given, mut entries) = (0.0, 0, vec![]);
            for e in own {
                sum += area(e) / total;
                let end = (sum * f64::from(Row::TOTAL)).round().min(f64::from(Row::TOTAL)) as u32;
                entries.push(Entry { element: e as u32, share: end - given });
                given = end;
            }
            Row { entries, backface: Row::TOTAL - given, ..Row::default() }
        };
        Ok(patches.iter().map(row).collect())
    }
}

/// The room that a node lies in: that on the side that it looks to.
fn room(mesh: &Mesh, node: NodeId) -> usize {
    usize::from((mesh.centroid(node) + 1e-6 * mesh.normal(node)).x > 1.0)
}

/// The wall between the rooms, which faces the first.
const BETWEEN: Quad = [[1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 1.0], [1.0, 1.0, 0.0]];

/// Two rooms of 1 × 1 × 1 and 2 × 1 × 1 with walls of these materials, and a wall between them
/// that lets light through.
fn rooms(first: &Material, second: &Material, between: Material) -> Scene {
    let [x0, _, others @ ..] = walls([0.0; 3], [1.0; 3]);
    let mut all: Vec<(Quad, Material)> =
        [[x0].as_slice(), &others].concat().into_iter().map(|wall| (wall, first.clone())).collect();
    let [_, x1, others @ ..] = walls([1.0, 0.0, 0.0], [3.0, 1.0, 1.0]);
    all.extend([[x1].as_slice(), &others].concat().into_iter().map(|w| (w, second.clone())));
    all.push((BETWEEN, between));
    quads(&all).resolve_sides()
}

fn translucent(reflectance: Rgb, transmittance: Rgb) -> Material {
    Material { reflectance, transmittance, ..Material::grey("paper", 0.0) }
}

/// Radiosity per room of the wall between them, by the closed form; one channel.
fn closed_form([rho1, e1]: [f64; 2], [rho2, e2]: [f64; 2], rho: f64, tau: f64) -> [f64; 2] {
    let (a1, a2) = (6.0, 10.0);
    let (d1, d2) = (a1 - (a1 - 1.0) * rho1 - rho, a2 - (a2 - 1.0) * rho2 - rho);
    let (p1, p2) = ((a1 - 1.0) * e1, (a2 - 1.0) * e2);
    let determinant = d1 * d2 - tau * tau;
    let (h1, h2) = ((p1 * d2 + tau * p2) / determinant, (p2 * d1 + tau * p1) / determinant);
    [rho * h1 + tau * h2, rho * h2 + tau * h1]
}

fn solve(mesh: &Mesh, method: Method) -> Solution {
    let solver = Solver { unshot: 1e-12, ..by_elements(method) };
    let s = solver.solve(mesh, &mut Spheres, keep_going).unwrap();
    assert_eq!(s.stop, StopReason::Converged);
    assert_balanced(&s);
    s
}

/// Methods that end in rooms that keep 0.999 of their light.
fn is_bounded(method: Method) -> bool {
    matches!(method, Method::Gmres { .. } | Method::Direct)
}

/// The elements of the wall between the rooms, in the room `k`.
fn wall(mesh: &Mesh, k: usize) -> impl Iterator<Item = usize> {
    let is_wall = move |&e: &usize| {
        let node = mesh.element(e);
        (mesh.centroid(node).x - 1.0).abs() < 1e-9 && room(mesh, node) == k
    };
    (0..mesh.element_count()).filter(is_wall)
}

#[test]
fn two_rooms_with_a_translucent_wall_have_their_closed_form() {
    // What reflects more than it lets through, as much, less, and nothing at all.
    let papers = [
        (Rgb::new(0.6, 0.3, 0.45), Rgb::new(0.3, 0.6, 0.45)),
        (Rgb::splat(0.45), Rgb::splat(0.45)),
        (Rgb::ZERO, Rgb::new(0.9, 0.5, 0.1)),
        (Rgb::splat(0.4995), Rgb::splat(0.4995)),
    ];
    for (rho, tau) in papers {
        let (lit, dark) = (paint(0.5, 2.0), paint(0.8, 0.0));
        let mesh = Mesh::new(rooms(&lit, &dark, translucent(rho, tau)), 0.8).unwrap();
        for method in Method::ALL {
            let s = solve(&mesh, method);
            for c in 0..3 {
                let exact = closed_form([0.5, 2.0], [0.8, 0.0], rho[c], tau[c]);
                for (k, exact) in exact.into_iter().enumerate() {
                    assert!(wall(&mesh, k).count() > 2);
                    for e in wall(&mesh, k) {
                        let off = (s.radiosity[e][c] / exact - 1.0).abs();
                        assert!(off < ROUNDING, "{method}, {rho} {tau}, {k}: {off:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn translucent_furnaces_have_their_closed_form() {
    // Everything emits E and keeps ρ + τ of the light, both sides of the wall between the rooms
    // among them, which is given once for each: B = E / (1 − ρ − τ) everywhere.
    for albedo in [0.9, 0.999] {
        for through in [0.2, 0.5, 1.0] {
            let tau = through * albedo;
            let paper = Material { transmittance: Rgb::splat(tau), ..paint(albedo - tau, 1.0) };
            let [a, b, c, d] = BETWEEN;
            let room = paint(albedo, 1.0);
            let [x0, _, others @ ..] = walls([0.0; 3], [1.0; 3]);
            let [_, x1, more @ ..] = walls([1.0, 0.0, 0.0], [3.0, 1.0, 1.0]);
            let mut all = vec![(x0, room.clone()), (x1, room.clone())];
            all.extend(others.into_iter().chain(more).map(|w| (w, room.clone())));
            // The second time cut along the other diagonal.
            all.extend([(BETWEEN, paper.clone()), ([d, c, b, a], paper)]);
            let mesh = Mesh::new(quads(&all).resolve_sides(), 0.8).unwrap();
            assert_eq!(mesh.scene().triangles().len(), 2 * 12, "both are there already");
            for method in Method::ALL {
                if albedo > 0.99 && !is_bounded(method) {
                    continue;
                }
                for b in solve(&mesh, method).radiosity {
                    let off = (b * (1.0 - albedo) - 1.0).abs().max_element();
                    assert!(off < ROUNDING, "{albedo} {through}, {method}: {off:e}");
                }
            }
        }
    }
}

#[test]
fn changed_translucency_matches_new_solve() {
    let paper = translucent(Rgb::splat(0.3), Rgb::new(0.5, 0.2, 0.1));
    let mesh = Mesh::new(rooms(&paint(0.5, 2.0), &paint(0.8, 0.0), paper), 0.8).unwrap();
    let changed = painted(&mesh, |m| {
        if m.name == "paper" {
            (m.reflectance, m.transmittance) = (Rgb::splat(0.1), Rgb::new(0.1, 0.6, 0.8));
        }
    });
    for method in Method::ALL {
        let solver = Solver { unshot: 1e-12, ..by_elements(method) };
        let mut solve = solver.begin(&mesh).unwrap();
        solve.run(&mut Spheres, keep_going).unwrap();
        solve.update_materials(&changed).unwrap();
        solve.run(&mut Spheres, keep_going).unwrap();
        let on = solve.into_solution().unwrap();
        let over = solver.solve(&changed, &mut Spheres, keep_going).unwrap();
        assert_balanced(&on);
        // What is unshot, at most ten times reflected, in either.
        let off = flux_difference(&changed, &on, &over);
        assert!(off < 1e-10, "{method}: {off:e}");
    }
}

#[test]
fn saved_translucent_solves_go_on_with_the_same_bits() {
    let paper = translucent(Rgb::splat(0.3), Rgb::splat(0.5));
    let mesh = Mesh::new(rooms(&paint(0.5, 2.0), &paint(0.8, 0.0), paper), 0.8).unwrap();
    let other = painted(&mesh, |m| m.transmittance *= 0.9);
    for method in Method::ALL {
        let solver = Solver { unshot: 1e-3, ..Solver::new(method) };
        let mut solve = solver.begin(&mesh).unwrap();
        for _ in 0..3 {
            solve.advance(&mut Spheres, keep_going).unwrap();
        }
        let bytes = solve.to_bytes();
        let mut again = solver.resume_bytes(&mesh, &Spheres, &bytes).unwrap();
        for solve in [&mut solve, &mut again] {
            solve.run(&mut Spheres, keep_going).unwrap();
        }
        assert_same_bits(&again.into_solution().unwrap(), &solve.into_solution().unwrap());
        assert!(solver.resume_bytes(&other, &Spheres, &bytes).is_err(), "another paper");
    }
}

#[test]
fn what_is_translucent_has_two_sides() {
    let paper = translucent(Rgb::splat(0.3), Rgb::splat(0.5));
    for sides in [Sides::Front, Sides::Both, Sides::Auto] {
        let paper = Material { sides, ..paper.clone() };
        let scene = rooms(&paint(0.5, 2.0), &paint(0.8, 0.0), paper);
        assert_eq!(scene.triangles().len(), 2 * 12);
        // Once is enough.
        assert_eq!(scene.resolve_sides().triangles(), scene.triangles());
    }
    // Given again, the same way round: else it would pass on twice what it receives.
    let twice = quads(&[(BETWEEN, paper.clone()), (BETWEEN, paper)]);
    let again = |t: &Triangle| Triangle { material: 0, group: 0, ..*t };
    let triangles = twice.triangles().iter().map(again).collect();
    let (groups, materials) = (twice.groups().to_vec(), twice.materials().to_vec());
    let twice = Scene::new(twice.positions().to_vec(), triangles, groups, materials).unwrap();
    assert_eq!(twice.resolve_sides().triangles().len(), 4);
}
