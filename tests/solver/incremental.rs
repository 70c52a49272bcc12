//! Changes of a scene that is solved: the answer of starting over, for less work. No GPU needed.

use std::ops::ControlFlow;

use glam::{DAffine3, DVec3};
use radiosity::solver::{Method, Progress, SolveSession, StopReason};
use radiosity::{ErrorKind, FormFactors, Material, Rgb, Solution, Solver};

use crate::common::changes::{
    assert_balanced, by_elements, flux_difference, painted, same_rays, shifted,
};
use crate::common::{cornell_box, keep_going};

/// Nothing shot, in sums of f64.
const SETTLED: f64 = 1e-11;

/// Two solutions with no more than that unshot differ by as much of it as is reflected for ever,
/// some three times as much where reflectances are 0.75 at most, and by rounding.
const SAME: f64 = 1e-10;

#[test]
fn changed_materials_match_new_solve() {
    let mesh = cornell_box(200.0);
    // Brighter, redder and greyer; a wall that was black takes on a colour; a second lamp.
    let black = painted(&mesh, |m| {
        if m.name == "green" {
            m.reflectance = Rgb::ZERO;
        }
    });
    let changed = painted(&mesh, |m| match m.name.as_str() {
        "light" => m.exitance *= Rgb::new(0.5, 0.25, 3.0),
        "green" => m.reflectance = Rgb::new(0.1, 0.6, 0.2),
        "red" => (m.reflectance, m.exitance) = (Rgb::splat(0.3), Rgb::new(1.0, 0.0, 0.2)),
        _ => m.reflectance = Rgb::new(0.2, 0.7, 0.6),
    });
    for method in Method::ALL {
        let solver = Solver { unshot: SETTLED, ..by_elements(method) };
        let mut rows = same_rays(&mesh);
        let mut solve = solver.begin(&black).unwrap();
        assert_eq!(solve.run(&mut rows, keep_going).unwrap(), StopReason::Converged);
        let made = solve.solution().unwrap().rows_made;
        solve.update_materials(&changed).unwrap();
        assert_eq!(solve.run(&mut rows, keep_going).unwrap(), StopReason::Converged);
        let on = solve.into_solution().unwrap();
        let over = solver.solve(&changed, &mut rows, keep_going).unwrap();
        assert_balanced(&on);
        let off = flux_difference(&changed, &on, &over);
        println!("{method}: {made} rows, then {}; off {off:.1e}", on.rows_made - made);
        assert!(off < SAME, "{method}: {off:e}");
        // Only what was black has rows yet to be made.
        let green = (0..mesh.element_count()).filter(|&e| {
            let node = black.element(e);
            black.material(node).reflectance == Rgb::ZERO
        });
        assert!(on.rows_made - made <= green.count() as u64, "{method}");
        for (a, b) in
            [(on.ledger.absorbed, over.ledger.absorbed), (on.ledger.escaped, over.ledger.escaped)]
        {
            assert!(((a - b) / over.ledger.emitted).abs().max_element() < SAME, "{method}");
        }
    }
}

#[test]
fn dimming_all_lamps_takes_no_work() {
    let mesh = cornell_box(200.0);
    for method in Method::ALL {
        let mut rows = same_rays(&mesh);
        let mut solve = by_elements(method).begin(&mesh).unwrap();
        solve.run(&mut rows, keep_going).unwrap();
        let first = solve.solution().unwrap();
        let dimmed = painted(&mesh, |m| m.exitance *= Rgb::new(0.3, 1e-12, 1e12));
        let dark = painted(&mesh, |m| m.exitance = Rgb::ZERO);
        solve.update_materials(&dimmed).unwrap();
        solve.run(&mut rows, keep_going).unwrap();
        let then = solve.solution().unwrap();
        assert_eq!((first.shots, first.rows_made), (then.shots, then.rows_made), "{method}");
        for (a, b) in first.radiosity.iter().zip(&then.radiosity) {
            // A product for each factor, and one for the emitted flux.
            let off = *a * Rgb::new(0.3, 1e-12, 1e12) - *b;
            assert!(off.abs().cmple(4.0 * f64::EPSILON * b.abs()).all(), "{method}: {a} {b}");
        }
        solve.update_materials(&dark).unwrap();
        assert_eq!(solve.run(&mut rows, keep_going).unwrap(), StopReason::Converged);
        let nothing = solve.into_solution().unwrap();
        assert_balanced(&nothing);
        assert!(nothing.radiosity.iter().all(|b| *b == Rgb::ZERO), "{method}");
    }
}

#[test]
fn separate_lights_combine_linearly() {
    let mesh = cornell_box(200.0);
    let lit = |ceiling: [f64; 3], wall: [f64; 3]| {
        painted(&mesh, |m| match m.name.as_str() {
            "light" => m.exitance = ceiling.into(),
            "red" => m.exitance = wall.into(),
            _ => {}
        })
    };
    let [lamp, wall] = [[17.0, 12.0, 4.0], [0.0, 2.0, 1.0]];
    let (one, other) = (lit(lamp, [0.0; 3]), lit([0.0; 3], wall));
    let weight = |e: [f64; 3], w: f64| e.map(|c| c * w);
    let both = lit(weight(lamp, 0.25), weight(wall, 3.0));
    for method in Method::ALL {
        let solver = Solver { unshot: SETTLED, ..by_elements(method) };
        let mut rows = same_rays(&mesh);
        let mut solve = solver.begin(&one).unwrap();
        solve.run(&mut rows, keep_going).unwrap();
        let first = solve.solution().unwrap();
        solve.update_materials(&other).unwrap();
        solve.run(&mut rows, keep_going).unwrap();
        let second = solve.into_solution().unwrap();
        // No lamp of the first is left in the second: light starts anew, so 0 W are 0 W.
        assert!(second.radiosity.iter().all(|b| b.x == 0.0), "{method}");
        assert!(second.rows_made <= mesh.element_count() as u64);
        let mixed =
            Solution::linear_combination(&[(Rgb::splat(0.25), &first), (Rgb::splat(3.0), &second)])
                .unwrap();
        let at_once = solver.solve(&both, &mut rows, keep_going).unwrap();
        assert_balanced(&mixed);
        let off = flux_difference(&both, &mixed, &at_once);
        println!("{method}: off {off:.1e}");
        assert!(off < SAME, "{method}: {off:e}");
    }
    let mut few =
        Solver::new(Method::Jacobi).solve(&one, &mut same_rays(&mesh), keep_going).unwrap();
    few.radiosity.clear();
    let whole = Solver::new(Method::Jacobi).solve(&one, &mut same_rays(&mesh), keep_going).unwrap();
    let e = Solution::linear_combination(&[(Rgb::ONE, &whole), (Rgb::ONE, &few)]).unwrap_err();
    assert!(e.kind() == ErrorKind::Setting && e.to_string().contains("0 elements"), "{e}");
    assert!(Solution::linear_combination(&[]).is_err());
}

#[test]
fn moved_object_matches_new_solve() {
    let mesh = cornell_box(150.0);
    let moved = shifted(&mesh, "short_block", [40.0, 0.0, -25.0]);
    for method in Method::ALL {
        // Asking for nothing unshot asks for all that is wrong to be drawn again.
        let solver = Solver { unshot: SETTLED, ..by_elements(method) };
        let (mut before, mut after) = (same_rays(&mesh), same_rays(&moved));
        let mut solve = solver.begin(&mesh).unwrap();
        solve.run(&mut before, keep_going).unwrap();
        assert_eq!(
            solve.update_geometry(&moved, &mut before, &mut after, keep_going).unwrap(),
            StopReason::Converged
        );
        assert!(solve.stale_flux_bound() <= SETTLED);
        solve.run(&mut after, keep_going).unwrap();
        let on = solve.into_solution().unwrap();
        let over = solver.solve(&moved, &mut after, keep_going).unwrap();
        assert_balanced(&on);
        let off = flux_difference(&moved, &on, &over);
        println!("{method}: {} rows made, off {off:.1e}", on.rows_made);
        assert!(off < SAME, "{method}: {off:e}");
    }
}

/// Light that a method has in hand, in the middle of a sweep or a cycle, is not lost on a change.
#[test]
fn change_in_mid_solve_loses_no_light() {
    let mesh = cornell_box(200.0);
    let changed = painted(&mesh, |m| match m.name.as_str() {
        "light" => m.exitance *= Rgb::new(0.5, 0.25, 3.0),
        _ => m.reflectance = Rgb::new(0.2, 0.7, 0.6),
    });
    for method in Method::ALL {
        let solver = Solver { unshot: SETTLED, ..by_elements(method) };
        let mut rows = same_rays(&mesh);
        let over = solver.solve(&changed, &mut rows, keep_going).unwrap();
        for calls in [5, 400] {
            let mut solve = solver.begin(&mesh).unwrap();
            let mut left = calls;
            let stopped = solve.run(&mut rows, |_| {
                left -= 1;
                if left > 0 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
            });
            assert!(stopped.unwrap() == StopReason::Cancelled || method == Method::Direct);
            solve.update_materials(&changed).unwrap();
            solve.run(&mut rows, keep_going).unwrap();
            let on = solve.into_solution().unwrap();
            assert_balanced(&on);
            let off = flux_difference(&changed, &on, &over);
            assert!(off < SAME, "{method}, {calls} calls: {off:e}");
        }
    }
}

/// Old rows make way for new ones where memory for rows is full, and rows that memory does not hold
/// are made again.
#[test]
fn moved_object_with_full_row_memory() {
    let mesh = cornell_box(200.0);
    let moved = shifted(&mesh, "short_block", [40.0, 0.0, -25.0]);
    let solver = Solver { unshot: SETTLED, ..Solver::new(Method::GaussSeidel) };
    let over = solver.solve(&moved, &mut same_rays(&moved), keep_going).unwrap();
    for row_memory in [0, 50_000, 200_000] {
        let (mut before, mut after) = (same_rays(&mesh), same_rays(&moved));
        let mut solve = Solver { row_memory, ..solver }.begin(&mesh).unwrap();
        solve.run(&mut before, keep_going).unwrap();
        solve.update_geometry(&moved, &mut before, &mut after, keep_going).unwrap();
        solve.run(&mut after, keep_going).unwrap();
        let on = solve.into_solution().unwrap();
        assert_balanced(&on);
        let off = flux_difference(&moved, &on, &over);
        assert!(off < SAME, "{row_memory} bytes: {off:e}");
    }
}

/// Light that was left where it was when an object moved stays in doubt when it moves again.
#[test]
fn stale_flux_survives_the_next_change() {
    let mesh = cornell_box(200.0);
    let once = shifted(&mesh, "tall_block", [0.0, 0.0, 30.0]);
    let twice = shifted(&once, "tall_block", [30.0, 0.0, 0.0]);
    let solver = Solver { unshot: SETTLED, ..Solver::new(Method::GaussSeidel) };
    let [mut first, mut second, mut third] = [&mesh, &once, &twice].map(same_rays);
    let mut solve = solver.begin(&mesh).unwrap();
    solve.run(&mut first, keep_going).unwrap();
    let stop = |_: &Progress| ControlFlow::Break(());
    solve.update_geometry(&once, &mut first, &mut second, stop).unwrap();
    solve.run(&mut second, keep_going).unwrap();
    solve.update_geometry(&twice, &mut second, &mut third, keep_going).unwrap();
    solve.run(&mut third, keep_going).unwrap();
    let doubt = solve.stale_flux_bound();
    let on = solve.into_solution().unwrap();
    assert_balanced(&on);
    let off = flux_difference(&twice, &on, &solver.solve(&twice, &mut third, keep_going).unwrap());
    println!("off {off:.1e}, in doubt {doubt:.1e}");
    // What went wrong is missing in one place and too much in another, and is reflected for ever,
    // at 0.75 at most: no more than three times as much each.
    assert!(off <= 6.0 * doubt + SAME, "{off:e} of {doubt:e}");
}

#[test]
fn rejects_unfit_changes_and_keeps_state() {
    let mesh = cornell_box(200.0);
    let mut rows = same_rays(&mesh);
    let mut solve: SolveSession = Solver::new(Method::GaussSeidel).begin(&mesh).unwrap();
    solve.run(&mut rows, keep_going).unwrap();
    let before = solve.to_bytes();
    let moved = shifted(&mesh, "short_block", [0.0, 0.0, 10.0]);
    let finer = cornell_box(150.0);
    let bright = painted(&mesh, |m| m.exitance = Rgb::splat(1e305));
    for (mesh, says) in [(&moved, "update_geometry"), (&finer, "with_scene"), (&bright, "finite")] {
        let e = solve.update_materials(mesh).unwrap_err();
        assert!(e.kind() == ErrorKind::Scene && e.to_string().contains(says), "{e}");
        assert!(solve.to_bytes() == before);
    }
    let e = mesh.with_scene(crate::common::cube(&Material::grey("m", 0.5))).unwrap_err();
    assert!(e.to_string().contains("12 triangles"), "{e}");
    let e = mesh.scene().with_materials(vec![]).unwrap_err();
    assert!(e.kind() == ErrorKind::Scene, "{e}");
    let e = mesh.scene().with_transformed_group("sofa", DAffine3::IDENTITY).unwrap_err();
    assert!(e.to_string().contains("'sofa'") && e.to_string().contains("tall_block"), "{e}");
    let e = mesh
        .scene()
        .with_transformed_group("floor", DAffine3::from_scale(DVec3::ZERO))
        .unwrap_err();
    assert!(e.kind() == ErrorKind::Scene, "{e}");
}

#[test]
fn cancelled_change_reports_stale_flux_and_resumes() {
    let mesh = cornell_box(200.0);
    let moved = shifted(&mesh, "tall_block", [0.0, 0.0, 30.0]);
    let (mut before, mut after) = (same_rays(&mesh), same_rays(&moved));
    let mut solve = Solver::new(Method::GaussSeidel).begin(&mesh).unwrap();
    solve.run(&mut before, keep_going).unwrap();
    let stop = |_: &Progress| ControlFlow::Break(());
    let stopped = solve.update_geometry(&moved, &mut before, &mut after, stop).unwrap();
    assert_eq!(stopped, StopReason::Cancelled);
    let doubt = solve.stale_flux_bound();
    assert!(doubt > 1e-3, "{doubt}");
    // All of the block has moved, so that what its rows say now is wrong: those are drawn again
    // before more light goes along them, all but one batch that has been.
    let scene = mesh.scene();
    let group = |e: usize| scene.triangles()[mesh.triangle(mesh.element(e))].group as usize;
    let block = (0..mesh.element_count()).filter(|&e| scene.groups()[group(e)] == "tall_block");
    let redrawn = |s: &SolveSession| s.solution().unwrap().rows_made;
    let stopped = redrawn(&solve);
    let mut further = solve.clone();
    further.set_limits(1e-6, None).unwrap();
    further.run(&mut after, keep_going).unwrap();
    let (drawn, block) = (redrawn(&further) - stopped, block.count());
    assert!(
        drawn as usize + after.preferred_batch_len() >= block,
        "{drawn} rows for {block} elements"
    );
    assert_eq!(solve.run(&mut after, keep_going).unwrap(), StopReason::Converged);
    let s = solve.into_solution().unwrap();
    assert_balanced(&s);
    assert!(s.ledger.unshot_share() <= 0.5e-3);
}
