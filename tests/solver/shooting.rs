//! The solver: exact answers, energy, kept rows, stopping. No GPU needed but where said.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::backend::cpu::RayRows;
use radiosity::form_factor::Row;
use radiosity::form_factor::closed_form::polygon_to_polygon;
use radiosity::solver::StopReason;
use radiosity::{ErrorKind, FormFactors, Material, Mesh, Rgb, Solution, Solver};

use crate::common::closed_forms::exact;
use crate::common::framed::{self, Frame};
use crate::common::measures::mean_and_worst;
use crate::common::scenes::paint;
use crate::common::{cube, keep_going, quads};

/// Solves with the rows that `rows` makes; no element is off by more than `tolerance` of its value.
pub fn unequal_areas<R: FormFactors>(rows: impl Fn(&Mesh) -> R, tolerance: f64) {
    // A lamp of 0.1 × 0.1 at distance 1 over the middle of a floor of 2 × 2 whose elements have
    // another size: the floor's radiosity is ρ E F from each element to the lamp.
    let lamp = [[-0.05, -0.05, 1.], [-0.05, 0.05, 1.], [0.05, 0.05, 1.], [0.05, -0.05, 1.]];
    let floor = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]];
    let scene = quads(&[(lamp, paint(0.0, 7.0)), (floor, paint(0.4, 0.0))]);
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let lamp = lamp.map(DVec3::from_array);
    let expected = |e: usize| {
        let n = mesh.element(e);
        let factor = polygon_to_polygon(&mesh.corners(n), &lamp);
        mesh.material(n).exitance.x + mesh.material(n).reflectance.x * 7.0 * factor
    };
    // When the lamp has shot, a fifth of its light is left: the lamp would reflect none of it.
    let lamp_only = Solver { unshot: 0.4, ..Default::default() };
    let s = lamp_only.solve(&mesh, &mut rows(&mesh), keep_going).unwrap();
    let off = |(e, b): (usize, &Rgb)| (b.x / expected(e) - 1.0).abs();
    let worst = s.radiosity.iter().enumerate().map(off).fold(0.0, f64::max);
    println!("worst element {worst:.1e}");
    assert!(worst <= tolerance, "{worst} {tolerance}");
}

#[test]
fn unequal_areas_exchange_by_reciprocity() {
    // Closed forms: a share is rounded by at most one unit of 2⁻³², and the smallest factor from
    // a half of the lamp to an element is 1e-3.
    unequal_areas(|_| exact(), 1e-6);
    // Rays: 2²⁰ a row, so at least 10³ hits an element: a standard error of 3 %; four of them.
    // Each half of the lamp is seen from its centroid, 0.02 from the middle of the lamp: 1 %.
    unequal_areas(|mesh| RayRows::new(mesh, 1 << 20).unwrap(), 0.13);
}

#[test]
fn white_furnace_is_exact_with_exact_rows() {
    for (rho, answer) in [(0.5, 2.0), (0.99, 100.0)] {
        let mesh = Mesh::new(cube(&paint(rho, 1.0)), 0.36).unwrap();
        let settings = Solver { unshot: 1e-7, patch_tolerance: 0.0, ..Default::default() };
        let s = settings.solve(&mesh, &mut exact(), keep_going).unwrap();
        let (mean, worst) = mean_and_worst(&mesh, &s, Rgb::splat(answer));
        println!("ρ {rho}: mean {}, worst {worst:.1e}, {} shots", mean.x, s.shots);
        // Rows and columns both sum to 1, so B = E/(1−ρ) at each element, but for shares rounded
        // to 2⁻³² where factors are 1/192 in the mean, for the closed form's own 1e-8, and for
        // what is unshot, 1e-7: each amplified by 1/(1−ρ) at most, 1e-4 in all.
        assert!(worst < 1e-4, "ρ {rho}: {worst:e}");
        assert!(s.ledger.imbalance() < 1e-12);
    }
}

#[test]
fn open_scene_energy_balances() {
    // A lamp between a wall that faces it and one that shows its back; light leaves at the sides.
    let lamp = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let wall = [[-1., -1., 2.], [-1., 2., 2.], [2., 2., 2.], [2., -1., 2.]];
    let back = [[0., 0., 1.], [0.5, 0., 1.], [0.5, 1., 1.], [0., 1., 1.]];
    let mut lit = paint(0.3, 0.0);
    lit.exitance = Rgb::new(3.0, 0.0, 1e-12);
    let scene = quads(&[(lamp, lit), (wall, paint(0.9, 0.0)), (back, paint(0.5, 0.0))]);
    let mesh = Mesh::new(scene, 0.5).unwrap();
    let mut shares = vec![];
    let s = Solver { unshot: 1e-6, ..Default::default() }
        .solve(&mesh, &mut RayRows::new(&mesh, 4096).unwrap(), |p| {
            shares.push(p.unshot_share);
            ControlFlow::Continue(())
        })
        .unwrap();
    let l = s.ledger;
    println!("{l:?}");
    assert!(l.imbalance() <= 1e-12, "{}", l.imbalance());
    // A unit square, summed over its elements.
    assert!((l.emitted - Rgb::new(3.0, 0.0, 1e-12)).abs().cmple(Rgb::new(1e-14, 0., 1e-26)).all());
    for part in [l.absorbed, l.escaped, l.backface_loss] {
        assert!(part.x > 0.01 * l.emitted.x && part.y == 0.0);
        // Channels differ by a factor in emission alone.
        assert!((part.z / part.x * 3e12 - 1.0).abs() < 1e-9);
    }
    assert_eq!(shares.len() as u64, s.shots);
    assert!(l.unshot_share() <= 1e-6 && s.stop == StopReason::Converged);
    // Radiosity times area is what fronts emitted and reflected; all that is not unshot went on
    // to be absorbed, reflected once more, or lost.
    let flux = |b: Rgb, e: usize| b * mesh.area(mesh.element(e));
    let leaving: Rgb = s.radiosity.iter().zip(0..).map(|(&b, e)| flux(b, e)).sum();
    let reflected = leaving - l.emitted;
    let arrived = l.absorbed + reflected + l.escaped + l.backface_loss;
    assert!((leaving - l.unshot - arrived).abs().max_element() < 1e-12);
}

#[test]
fn large_patches_conserve_flux() {
    let mesh = Mesh::new(cube(&paint(0.5, 0.0)), 0.2).unwrap();
    let lit = {
        let s = mesh.scene();
        let mut materials = s.materials().to_vec();
        materials[3].exitance = Rgb::ONE;
        let scene = radiosity::Scene::new(
            s.positions().to_vec(),
            s.triangles().to_vec(),
            s.groups().to_vec(),
            materials,
        );
        Mesh::new(scene.unwrap(), 0.2).unwrap()
    };
    let solve = |level| {
        let mut rays = RayRows::new(&lit, 4096).unwrap();
        Solver { unshot: 1e-4, patch_tolerance: 0.0, min_patch_level: level, ..Default::default() }
            .solve(&lit, &mut rays, keep_going)
            .unwrap()
    };
    let (fine, coarse) = (solve(0), solve(2));
    assert!(coarse.rows_made * 4 < fine.rows_made, "{} {}", coarse.rows_made, fine.rows_made);
    let flux = |s: &Solution| s.ledger.absorbed.x;
    // Absorbed is what is emitted in a closed cube, whoever shoots.
    assert!((flux(&fine) / flux(&coarse) - 1.0).abs() < 2e-4);
    assert_eq!(coarse.ledger.escaped, Rgb::ZERO);
}

#[test]
fn stop_rules_keep_what_was_solved() {
    let mesh = Mesh::new(cube(&paint(0.8, 1.0)), 0.36).unwrap();
    let mut calls = 0;
    let s = Solver::default()
        .solve(&mesh, &mut exact(), |p| {
            calls += 1;
            assert_eq!(p.shots, calls);
            if calls == 7 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
    assert_eq!((s.shots, s.stop), (7, StopReason::Cancelled));
    assert!(s.ledger.imbalance() < 1e-12);
    let shots = Solver { max_steps: Some(5), ..Default::default() };
    let s = shots.solve(&mesh, &mut exact(), keep_going).unwrap();
    assert_eq!((s.shots, s.stop), (5, StopReason::Shots));
    let none = Solver { max_steps: Some(0), ..Default::default() };
    let s = none.solve(&mesh, &mut exact(), keep_going).unwrap();
    assert!(s.shots == 0 && s.radiosity.iter().all(|&b| b == Rgb::ONE));
}

#[test]
fn dark_scene_needs_no_shot() {
    let mesh = Mesh::new(cube(&paint(0.8, 0.0)), 0.36).unwrap();
    let s = Solver::default().solve(&mesh, &mut exact(), keep_going).unwrap();
    assert_eq!((s.shots, s.stop, s.ledger.unshot_share()), (0, StopReason::Converged, 0.0));
    assert!(s.radiosity.iter().all(|&b| b == Rgb::ZERO));
}

#[test]
fn ray_rows_match_closed_form() {
    // A square of side 0.5 at distance 1 on the axis: 2¹⁶ rays, four standard errors of a count.
    let speck = [[-1e-3, -1e-3, 0.], [1e-3, -1e-3, 0.], [0., 2e-3, 0.], [-1e-3, 0., 0.]];
    let square = [[-0.25, -0.25, 1.], [-0.25, 0.25, 1.], [0.25, 0.25, 1.], [0.25, -0.25, 1.]];
    let grey = Material::grey("g", 0.5);
    let mesh = Mesh::new(quads(&[(speck, grey.clone()), (square, grey)]), f64::INFINITY).unwrap();
    let r = (1.0f64 + 0.0625).sqrt();
    let exact = 4.0 / PI * (0.25 / r) * (0.25 / r).atan();
    let row =
        &RayRows::new(&mesh, 1 << 16).unwrap().rows(&mesh, &[mesh.element(0)], 1.0).unwrap()[0];
    let got: f64 = row.entries.iter().map(|e| Row::form_factor(e.share)).sum();
    let bound = 4.0 * (exact * (1.0 - exact) / 65536.0).sqrt();
    assert!((got - exact).abs() < bound, "{got} {exact} {bound}");
    assert_eq!(row.closure(), 1.0);
    for rays in [0, (1 << 28) + 1] {
        assert_eq!(RayRows::new(&mesh, rays).unwrap_err().kind(), ErrorKind::Setting);
    }
}

#[test]
fn ties_are_broken_alike_at_any_scale() {
    // All walls alike: whose turn it is to shoot is a matter of order alone, unless rounding
    // decides.
    let light = |scale: f64| {
        let scene = framed::furnace(Frame::scaled(scale), 0.5, 1.0);
        let mesh = Mesh::new(scene, 0.2 * scale).unwrap();
        let mut rays = RayRows::new(&mesh, 256).unwrap().with_full_share(0.0);
        let s = Solver { unshot: 0.1, ..Solver::default() };
        s.solve(&mesh, &mut rays, keep_going).unwrap().radiosity
    };
    let known = light(1.0);
    for scale in [0.1, 3.0, 10.0, 1e-7] {
        let found = light(scale);
        let off = found.iter().zip(&known).map(|(a, b)| (*a / *b - 1.0).length());
        // Sums of a thousand terms; another shot before the end would be a hundredth of it.
        assert!(off.fold(0.0, f64::max) < 1e-12, "scale {scale}");
    }
}
