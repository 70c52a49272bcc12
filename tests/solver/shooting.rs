//! The solver: exact answers, energy, kept rows, stopping. No GPU needed but where said.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use crate::common::closed_forms::{exact, from_centroid};
use crate::common::{cube, gpu, quads};
use glam::DVec3;
use radiosity::form_factor::closed_form::polygon_to_polygon;
use radiosity::{
    Entry, Error, ErrorKind, FormFactors, HemicubeRows, Material, Mesh, NodeId, Progress, RayRows,
    Rgb, Row, Solution, Solver, StopReason,
};

fn go(_: &Progress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn material(reflectance: f64, exitance: f64) -> Material {
    Material { exitance: Rgb::splat(exitance), ..Material::grey("m", reflectance) }
}

/// Area-weighted mean radiosity, and the largest relative deviation of an element from `exact`.
fn mean_and_worst(mesh: &Mesh, s: &Solution, exact: Rgb) -> (Rgb, f64) {
    let area = |e: usize| mesh.area(mesh.element(e));
    let flux: Rgb = s.radiosity.iter().zip(0..).map(|(&b, e)| b * area(e)).sum();
    let total: f64 = (0..mesh.element_count()).map(area).sum();
    let off = |b: &Rgb| ((*b - exact) / exact).abs().max_element();
    (flux / total, s.radiosity.iter().map(off).fold(0.0, f64::max))
}

#[test]
fn unequal_areas_exchange_by_reciprocity() {
    // A lamp of 0.1 × 0.1 at distance 1 over the middle of a floor of 2 × 2 whose elements have
    // another size: the floor's radiosity is ρ E F from each element to the lamp.
    let lamp = [[-0.05, -0.05, 1.], [-0.05, 0.05, 1.], [0.05, 0.05, 1.], [0.05, -0.05, 1.]];
    let floor = [[-1., -1., 0.], [1., -1., 0.], [1., 1., 0.], [-1., 1., 0.]];
    let scene = quads(&[(lamp, material(0.0, 7.0)), (floor, material(0.4, 0.0))]);
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let lamp = lamp.map(DVec3::from_array);
    let expected = |e: usize| {
        let n = mesh.element(e);
        let factor = polygon_to_polygon(&mesh.corners(n), &lamp);
        mesh.material(n).exitance.x + mesh.material(n).reflectance.x * 7.0 * factor
    };
    let check = |maker: &mut dyn FormFactors, tolerance: f64| {
        let all = Solver { unshot: 0.0, ..Default::default() };
        let s = all.solve(&mesh, maker, go).unwrap();
        let off = |(e, b): (usize, &Rgb)| (b.x / expected(e) - 1.0).abs();
        let worst = s.radiosity.iter().enumerate().map(off).fold(0.0, f64::max);
        println!("worst element {worst:.1e}");
        assert!(worst <= tolerance, "{worst} {tolerance}");
    };
    // Closed forms: a share is rounded by at most one unit of 2⁻³², and the smallest factor from
    // a half of the lamp to an element is 1e-3.
    check(&mut exact(), 1e-6);
    // Rays: 2²⁰ a row, so at least 10³ hits an element: a standard error of 3 %; four of them.
    // Each half of the lamp is seen from its centroid, 0.02 from the middle of the lamp: 1 %.
    check(&mut RayRows::new(&mesh, 1 << 20).unwrap(), 0.13);
    if let Some(gpu) = gpu() {
        // Hemicubes: at N = 512 an element of factor 1e-3 covers 200 pixels at least, and its
        // outline crosses up to 14·√200, each off by up to half at random: 4·√(200/12)/200 = 8 %.
        check(&mut HemicubeRows::new(&gpu, &mesh, 512).unwrap(), 0.13);
    }
}

#[test]
fn white_furnace_with_exact_rows_is_exact_at_every_element() {
    for (rho, answer) in [(0.5, 2.0), (0.99, 100.0)] {
        let mesh = Mesh::new(cube(&material(rho, 1.0)), 0.36).unwrap();
        let settings = Solver { unshot: 1e-7, patch_tolerance: 0.0, ..Default::default() };
        let s = settings.solve(&mesh, &mut exact(), go).unwrap();
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
fn white_furnace_with_hemicubes_keeps_the_energy() {
    let Some(gpu) = gpu() else { return };
    for (rho, answer) in [(0.5, 2.0), (0.99, 100.0)] {
        let mesh = Mesh::new(cube(&material(rho, 1.0)), 0.2).unwrap();
        let settings = Solver { unshot: 1e-7, ..Default::default() };
        let mut hemicubes = HemicubeRows::new(&gpu, &mesh, 256).unwrap();
        let s = settings.solve(&mesh, &mut hemicubes, go).unwrap();
        let (mean, worst) = mean_and_worst(&mesh, &s, Rgb::splat(answer));
        // Flux is conserved, so the mean is short by no more than the unshot share, which would
        // still bring 1/(1−ρ) times itself, relative to 1/(1−ρ).
        assert!((mean.x / answer - 1.0).abs() < 1e-6, "ρ {rho}: mean {mean}");
        // An element is off because patches shoot from their centroids (the proximity assumption
        // of Baum, Rushmeier, Winget 1989), which closed forms from the same centroids show too.
        // What is left is pixels: an element gets its light from 192 patches of 4 times its area,
        // with factors of 1/768: 67 pixels of 2e-5, up to 14·√67 of them crossed by the outline
        // and off by half at random: 4·√192·2e-5·√(115/12) = 0.34 % of its light; six of them.
        let twin = settings.solve(&mesh, &mut from_centroid(), go).unwrap();
        let ratio = s.radiosity.iter().zip(&twin.radiosity).map(|(a, b)| (a.x / b.x - 1.0).abs());
        let pixels = ratio.fold(0.0, f64::max);
        println!("ρ {rho}: mean {}, worst element {worst:.1e}, by pixels {pixels:.1e}", mean.x);
        assert!(pixels < 0.02, "ρ {rho}: {pixels}");
    }
}

#[test]
fn the_ledger_closes_in_open_scenes_with_backs_at_every_shot() {
    // A lamp between a wall that faces it and one that shows its back; light leaves at the sides.
    let lamp = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];
    let wall = [[-1., -1., 2.], [-1., 2., 2.], [2., 2., 2.], [2., -1., 2.]];
    let back = [[0., 0., 1.], [0.5, 0., 1.], [0.5, 1., 1.], [0., 1., 1.]];
    let mut lit = material(0.3, 0.0);
    lit.exitance = Rgb::new(3.0, 0.0, 1e-12);
    let scene = quads(&[(lamp, lit), (wall, material(0.9, 0.0)), (back, material(0.5, 0.0))]);
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
fn a_kept_row_is_made_once_and_budget_changes_nothing_but_the_work() {
    let mesh = Mesh::new(cube(&material(0.8, 1.0)), 0.36).unwrap();
    let solve = |row_memory: usize| {
        let mut maker = exact();
        let settings =
            Solver { unshot: 1e-3, row_memory, patch_tolerance: 0.0, ..Default::default() };
        let s = settings.solve(&mesh, &mut maker, go).unwrap();
        assert_eq!(maker.made, s.rows_made);
        s
    };
    let (kept, half, none) = (solve(1 << 30), solve(200_000), solve(0));
    assert_eq!(kept.rows_made as usize, mesh.element_count(), "each row once");
    assert_eq!(none.rows_made, none.shots, "nothing kept, all made again");
    assert!(kept.rows_made < half.rows_made && half.rows_made < none.rows_made);
    // The order of shots may differ with what is at hand; the light may not.
    for s in [half, none] {
        for (a, b) in kept.radiosity.iter().zip(&s.radiosity) {
            // Both within the unshot share of the same solution.
            assert!(((*a - *b) / *a).abs().max_element() < 1e-2);
        }
    }
}

#[test]
fn patches_and_elements_shoot_the_same_light() {
    let mesh = Mesh::new(cube(&material(0.5, 0.0)), 0.2).unwrap();
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
            .solve(&lit, &mut rays, go)
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
fn a_solve_can_be_cut_short_and_keeps_what_it_has() {
    let mesh = Mesh::new(cube(&material(0.8, 1.0)), 0.36).unwrap();
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
    let s = shots.solve(&mesh, &mut exact(), go).unwrap();
    assert_eq!((s.shots, s.stop), (5, StopReason::Shots));
    let none = Solver { max_steps: Some(0), ..Default::default() };
    let s = none.solve(&mesh, &mut exact(), go).unwrap();
    assert!(s.shots == 0 && s.radiosity.iter().all(|&b| b == Rgb::ONE));
}

#[test]
fn a_dark_scene_is_solved_at_once() {
    let mesh = Mesh::new(cube(&material(0.8, 0.0)), 0.36).unwrap();
    let s = Solver::default().solve(&mesh, &mut exact(), go).unwrap();
    assert_eq!((s.shots, s.stop, s.ledger.unshot_share()), (0, StopReason::Converged, 0.0));
    assert!(s.radiosity.iter().all(|&b| b == Rgb::ZERO));
}

/// Returns whatever it is given.
struct Given(Vec<Row>);
impl FormFactors for Given {
    fn rows(&mut self, _: &Mesh, _: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        Ok(self.0.clone())
    }
}

#[test]
fn rows_that_break_their_contract_are_refused() {
    let mesh = Mesh::new(cube(&material(0.8, 1.0)), 2.0).unwrap();
    let half = Row::TOTAL / 2;
    let entry = |element, share| Entry { element, share };
    let good =
        Row { entries: vec![entry(1, half), entry(3, Row::TOTAL - half)], ..Default::default() };
    let bad = [
        vec![],
        vec![good.clone(), good.clone()],
        vec![Row { escaped: half, ..Default::default() }],
        vec![Row { escaped: 1, ..good.clone() }],
        vec![Row {
            entries: vec![entry(3, half), entry(1, Row::TOTAL - half)],
            ..Default::default()
        }],
        vec![Row { entries: vec![entry(12, Row::TOTAL)], ..Default::default() }],
    ];
    for rows in bad {
        let e = Solver::default().solve(&mesh, &mut Given(rows), go).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::FormFactor, "{e}");
    }
    let one = Solver { max_steps: Some(1), ..Default::default() };
    assert!(one.solve(&mesh, &mut Given(vec![good]), go).is_ok());
    for unshot in [-0.1, 1.1, f64::NAN] {
        let settings = Solver { unshot, ..Default::default() };
        let e = settings.solve(&mesh, &mut exact(), go).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
    }
}

#[test]
fn ray_rows_match_a_closed_form() {
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
