//! Surfaces with holes in rooms whose light is known, by all methods. No GPU needed.

use radiosity::form_factor::{Entry, Row};
use radiosity::mesh::NodeId;
use radiosity::scene::Sides;
use radiosity::solver::{Method, StopReason};
use radiosity::{Error, FormFactors, Mesh, Rgb, Scene, SceneSettings, Solution, Solver};

use crate::common::changes::{assert_balanced, by_elements, same_rays};
use crate::common::cut_outs::{Lattice, Part, read};
use crate::common::keep_going;
use crate::common::measures::assert_same_bits;
use crate::common::scenes::{facing_up, walls};

/// What shares of 2⁻³² that are rounded, and 1e-12 of light that is unshot, can be off by: a
/// thousand times that, some hundred elements a row.
const ROUNDING: f64 = 1e-6;

/// All surfaces get the same light, wherever it is from: by the area that is there.
struct Sphere;

impl FormFactors for Sphere {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        let area = |e: usize| mesh.solid_area(mesh.element(e));
        let total: f64 = (0..mesh.element_count()).map(area).sum();
        let (mut sum, mut given, mut entries) = (0.0, 0, vec![]);
        for e in (0..mesh.element_count()).filter(|&e| area(e) > 0.0) {
            sum += area(e) / total;
            let end = (sum * f64::from(Row::TOTAL)).round().min(f64::from(Row::TOTAL)) as u32;
            entries.push(Entry { element: e as u32, share: end - given });
            given = end;
        }
        Ok(vec![Row { entries, backface: Row::TOTAL - given, ..Row::default() }; patches.len()])
    }
}

/// Holes of two sizes, in one of which whole elements lie.
const MASK: Lattice =
    Lattice { side: 8, is_solid: |x, y| !(x < 4 && y < 4) && (x + 2 * y) % 3 != 0 };

/// A room of exitance 1 and `reflectance` with a sheet that has holes, of the same for each side,
/// which may let `through` some of the light.
fn furnace(reflectance: f64, through: f64) -> Scene {
    let sheet = facing_up([0.1, 0.8], [0.2, 0.9], 0.6);
    let [a, b, c, d] = sheet;
    let mut parts: Vec<Part> = walls([0.0; 3], [1.0; 3]).map(|wall| (wall, "wall")).into();
    parts.extend([(sheet, "sheet"), ([d, c, b, a], "back")]);
    let ke = 1.0 / std::f64::consts::PI;
    let all = reflectance + through;
    let library = format!(
        "newmtl wall\nKd {all}\nKe {ke}\nnewmtl sheet\nKd {all}\nKe {ke}\nmap_d mask.tga\n\
         newmtl back\nKd {all}\nKe {ke}\nmap_d mask.tga\n"
    );
    let mut settings = SceneSettings::default();
    settings.sides = Sides::Front;
    if through > 0.0 {
        settings.transmit = ["sheet", "back"].map(|m| (m.into(), Rgb::splat(through))).into();
    }
    read(&parts, &library, &[("mask.tga", &MASK.image())], &settings)
}

/// Elements of about `size`, those of one side of the sheet finer in places.
fn cut(scene: Scene, size: f64) -> Mesh {
    let mesh = Mesh::new(scene, size).unwrap();
    let side = mesh.scene().groups().len() - 1;
    let is_of_side = |e: &usize| {
        mesh.scene().triangles()[mesh.triangle(mesh.element(*e))].group as usize == side
    };
    let finer: Vec<usize> = (0..mesh.element_count()).filter(is_of_side).step_by(3).collect();
    mesh.split(&finer).unwrap()
}

fn solve(mesh: &Mesh, method: Method) -> Solution {
    let solver = Solver { unshot: 1e-12, ..by_elements(method) };
    let s = solver.solve(mesh, &mut Sphere, keep_going).unwrap();
    assert_eq!(s.stop, StopReason::Converged);
    assert_balanced(&s);
    s
}

#[test]
fn areas_are_those_of_the_cells() {
    let mesh = cut(furnace(0.5, 0.0), 0.3);
    let sheet = 0.7 * 0.7 * MASK.share();
    for group in [6, 7] {
        let triangles = (0..mesh.scene().triangles().len())
            .filter(|&t| mesh.scene().triangles()[t].group == group);
        let of_triangles: f64 = triangles.clone().map(|t| mesh.scene().solid_area(t)).sum();
        let of_roots: f64 = triangles.clone().map(|t| mesh.solid_area(mesh.root(t))).sum();
        let elements = triangles.flat_map(|t| mesh.elements_of(mesh.root(t)));
        let areas: Vec<f64> = elements.map(|e| mesh.solid_area(mesh.element(e))).collect();
        let holes = areas.iter().filter(|&&area| area == 0.0).count();
        assert!(holes > 3 && holes < areas.len() / 2, "{holes} of {}", areas.len());
        for found in [of_triangles, of_roots, areas.into_iter().sum()] {
            // Polygons' areas in 64 bits.
            assert!((found / sheet - 1.0).abs() < 1e-12, "{found} {sheet}");
        }
    }
}

#[test]
fn furnaces_have_their_closed_form_whatever_the_holes() {
    for (rho, tau) in [(0.5, 0.0), (0.9, 0.0), (0.5, 0.4)] {
        let mesh = cut(furnace(rho, tau), 0.45);
        for method in Method::ALL {
            let s = solve(&mesh, method);
            let mut solid = 0;
            for (e, b) in s.radiosity.iter().enumerate() {
                let node = mesh.element(e);
                if mesh.solid_area(node) == 0.0 {
                    assert_eq!(*b, Rgb::ZERO);
                    continue;
                }
                // Walls that let nothing through reflect all of it.
                let off = b.x * (1.0 - rho - tau) - 1.0;
                assert!(off.abs() < ROUNDING, "{method} {rho} {tau}, {e}: {off:e}");
                solid += 1;
            }
            assert!(solid > 50, "{solid}");
        }
    }
}

#[test]
fn all_light_of_a_furnace_by_rays_is_accounted_for() {
    // All fronts: the flux of all is that emitted over 1 − ρ, by energy alone.
    let mesh = cut(furnace(0.5, 0.0), 0.2);
    let solver = Solver { unshot: 1e-9, ..Solver::default() };
    let s = solver.solve(&mesh, &mut same_rays(&mesh), keep_going).unwrap();
    assert_balanced(&s);
    let area = |e: usize| mesh.solid_area(mesh.element(e));
    let all: f64 = (0..mesh.element_count()).map(area).sum();
    assert!((s.ledger.emitted.x / all - 1.0).abs() < 1e-9, "{} {all}", s.ledger.emitted.x);
    let flux: f64 = (0..mesh.element_count()).map(|e| s.radiosity[e].x * area(e)).sum();
    assert!((flux / (2.0 * all) - 1.0).abs() < 1e-6, "{flux} {all}");
}

#[test]
fn states_know_the_holes() {
    let mesh = cut(furnace(0.5, 0.0), 0.3);
    let moved = Lattice { side: 8, is_solid: |x, y| (MASK.is_solid)(7 - x, y) };
    assert_eq!(moved.share(), MASK.share());
    let solver = Solver { unshot: 1e-6, ..Solver::new(Method::GaussSeidel) };
    let mut solve = solver.begin(&mesh).unwrap();
    let rows = || same_rays(&mesh);
    solve.advance(&mut rows(), keep_going).unwrap();
    let bytes = solve.to_bytes();
    let mut again = solver.resume_bytes(&mesh, &rows(), &bytes).unwrap();
    for session in [&mut solve, &mut again] {
        session.run(&mut rows(), keep_going).unwrap();
    }
    assert_same_bits(&again.into_solution().unwrap(), &solve.into_solution().unwrap());
    // Of other holes it is another state.
    let text = "newmtl wall\nKd 0.5\nKe 0.3\nnewmtl sheet\nKd 0.5\nmap_d mask.tga\n";
    let one = |mask: &Lattice| {
        let parts = [(facing_up([0.0, 1.0], [0.0, 1.0], 0.5), "sheet")];
        let images = [("mask.tga", &mask.image()[..])];
        Mesh::new(read(&parts, text, &images, &SceneSettings::default()), 2.0).unwrap()
    };
    let [mesh, other] = [&MASK, &moved].map(one);
    let mut begun = solver.begin(&mesh).unwrap();
    begun.advance(&mut Sphere, keep_going).unwrap();
    let bytes = begun.to_bytes();
    assert!(solver.resume_bytes(&mesh, &Sphere, &bytes).is_ok());
    assert!(solver.resume_bytes(&other, &Sphere, &bytes).is_err());
}
