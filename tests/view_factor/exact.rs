//! View factors between groups: against independent truth, closed forms and themselves.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::form_factor::closed_form::{point_to_polygon, polygon_to_polygon};
use radiosity::io::view_factors::{write_csv_list, write_matrix_market};
use radiosity::view_factor::{Estimate, Factor, MatrixRows, Missing, backs_met};
use radiosity::{ErrorKind, Scene, ViewFactors, load_scene};
use serde_json::Value;

use super::sparse::{of_triangles, revolved};
use crate::common::scenes::grey;
use crate::common::view_factors::{data, exact_view_factors, group_index, square};
use crate::common::{cube, keep_counting, quads};

/// The cases of the list that leave a point instead of a surface.
#[test]
fn independent_point_cases_match() {
    let text = std::fs::read_to_string(data("view_factors/expected.json")).unwrap();
    let cases: Vec<Value> = serde_json::from_str(&text).unwrap();
    let mut count = 0;
    for case in &cases {
        let Some(place) = case.get("differential").map(|d| &d["dA"]) else { continue };
        let vector =
            |key: &str| DVec3::from_array([0, 1, 2].map(|k| place[key][k].as_f64().unwrap()));
        let (point, normal) = (vector("point"), vector("normal"));
        let scene = load_scene(data("view_factors").join(case["obj"].as_str().unwrap())).unwrap();
        let to = scene.groups().iter().position(|g| case["to"] == **g).unwrap();
        let of_group = |&t: &usize| scene.triangles()[t].group as usize == to;
        let triangles = (0..scene.triangles().len()).filter(of_group);
        let got: f64 = triangles.map(|t| point_to_polygon(point, normal, &scene.corners(t))).sum();
        let want = case["value"].as_f64().unwrap();
        // What the list knows of the truth, and 1e-14 for each of two triangles.
        let bound = case["uncertainty"].as_f64().unwrap() + 2e-14;
        assert!((got - want).abs() <= bound, "{}: {got} for {want}", case["id"]);
        count += 1;
    }
    assert_eq!(count, 4);
}

#[test]
fn errors_that_share_a_sign_add_up() {
    // A convex bowl: the flat disc of its rim sees nothing else, so that its area is what leaves.
    // Many pairs of its facets are just far enough for cubature, which is off by up to 6e-8 of each
    // in the same direction.
    let (sectors, pieces) = (40, 6.0);
    let at = |k: u32| {
        let x = f64::from(k) / pieces - 1.0;
        [1.0 - x * x, 0.5 * x]
    };
    let profile = [0, 1, 2, 3].map(at);
    let m = exact_view_factors(&of_triangles(&[("bowl", revolved(&profile, sectors))]), 1e-3);
    let rim = 0.5 * f64::from(sectors) * 0.75_f64.powi(2) * (TAU / f64::from(sectors)).sin();
    let (Estimate { value, error }, want) = (m.factor(0, 0), 1.0 - rim / m.areas[0]);
    assert!((value - want).abs() < 2.0 * error, "{value} ± {error}, {want}");
    // Pairs are made in the row of the earlier facet, so that rows shrink evenly to nothing: the
    // root of the mean of their squares is √(4/3) of the mean.
    assert!(error < 6e-8 * value * (4.0_f64 / 3.0).sqrt(), "{error}");
}

/// A cube with a box inside, walls 4 × 4: 120 groups, every entry.
#[test]
fn enclosure_matrix_matches() {
    let m = exact_view_factors(&load_scene(data("box_4.obj")).unwrap(), 1e-4);
    let truth = std::fs::read_to_string(data("box_4.csv")).unwrap();
    let mut rows = 0;
    for line in truth.lines().filter(|l| !l.starts_with('#')) {
        let values: Vec<f64> = line.split(',').map(|v| v.trim().parse().unwrap()).collect();
        let i = group_index(&m, &format!("q{}", values[0]));
        for (j, want) in values[1..].iter().enumerate() {
            let got = m.factor(i, group_index(&m, &format!("q{j}"))).value;
            assert!((got - want).abs() < 1e-5, "{i} {j}: {got} for {want}");
        }
        rows += 1;
    }
    assert_eq!(rows, 120);
    assert!(m.open_rows().is_empty());
    let checks = m.checks();
    println!("{checks:?}");
    assert!(checks.closure.max < 1e-5, "a tenth of the error that was asked for");
    // Each pair is met once; what differs is the rounding of two divisions.
    assert!(checks.reciprocity.max < 1e-15);
    assert_eq!(checks.bounds.max, 0.0);
}

#[test]
fn occluders_only_reduce_factors() {
    let scene = load_scene(data("view_factors/occ-box-offset-w_x0-b_x0.obj")).unwrap();
    let m = exact_view_factors(&scene, 1e-4);
    let mut less = 0;
    for (i, j) in (0..12).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let pair = |t: &&radiosity::Triangle| [i, j].contains(&(t.group as usize));
        let triangles = scene.triangles().iter().filter(pair).copied().collect();
        let (positions, groups) = (scene.positions().to_vec(), scene.groups().to_vec());
        let alone = Scene::new(positions, triangles, groups, scene.materials().to_vec());
        let (Ok(alone), got) = (alone, m.factor(i, j)) else { continue };
        let alone = exact_view_factors(&alone, 1e-4);
        assert!(
            alone.open_rows().iter().all(|&k| k == i || k == j),
            "groups without area do not leak"
        );
        let free = alone.factor(i, j);
        assert!(got.value <= free.value + 3.0 * got.error + 1e-12, "{i} {j}");
        less += usize::from(got.value < free.value - 1e-3);
    }
    assert!(less > 10, "the box hides much: {less}");
}

#[test]
fn factors_are_invariant_under_scale_and_shift() {
    let scene = load_scene(data("view_factors/chap-plate-in-box-y0-y1.obj")).unwrap();
    let here = exact_view_factors(&scene, 1e-4);
    // The middle one is out by the rounding of coordinates, 1e3 · 2e-16.
    for (scale, shift, rounding) in [(1e-9, 0.0, 1e-13), (1.0, 1e3, 1e-11), (1e9, 0.0, 1e-13)] {
        let moved = |p: &DVec3| *p * scale + DVec3::splat(shift);
        let positions = scene.positions().iter().map(moved).collect();
        let triangles = scene.triangles().to_vec();
        let groups = scene.groups().to_vec();
        let there = Scene::new(positions, triangles, groups, scene.materials().to_vec()).unwrap();
        let there = exact_view_factors(&there, 1e-4);
        for (a, b) in here.factors.iter().flatten().zip(there.factors.iter().flatten()) {
            // Cells are cut alike unless rounding tips a balance; then within both errors.
            let allowed = rounding + 3.0 * a.error.hypot(b.error);
            assert!(a.to == b.to && (a.value - b.value).abs() <= allowed, "{scale}: {a:?} {b:?}");
        }
    }
}

#[test]
fn the_same_bits_on_every_run() {
    let scene = load_scene(data("box_4.obj")).unwrap();
    assert!(exact_view_factors(&scene, 1e-3) == exact_view_factors(&scene, 1e-3));
}

#[test]
fn hidden_is_zero_and_backs_are_counted() {
    // Squares of side 1 a unit apart; a screen of side 4 between them, its back to the lower.
    let plates = [
        (square(0.5, 0.0, true), grey()),
        (square(0.5, 1.0, false), grey()),
        (square(2.0, 0.5, true), grey()),
    ];
    let scene = quads(&plates);
    let m = exact_view_factors(&scene, 1e-4);
    assert_eq!(m.absent, Missing::Zero);
    assert_eq!(m.factors[0], []);
    assert_eq!(m.factors[1].iter().map(|f| f.to).collect::<Vec<_>>(), [2]);
    // The screen's back receives from below what its front receives from above, both closed forms.
    assert!((m.back[0].value - m.factor(1, 2).value).abs() < 1e-13);
    assert!((m.back[0].value + m.open[0].value - 1.0).abs() < 1e-15);
    assert_eq!(m.open_rows().len(), 3, "all see out beside one another");

    assert_eq!(m.rows_that_meet_backs(), [0]);
    let met = backs_met(&scene, &[], 0).unwrap();
    // 65 536 rays, of which a share of 0.7 arrives: three standard deviations.
    assert!(met.len() == 1 && met[0].group == 2, "{met:?}");
    assert!((met[0].share - m.back[0].value).abs() < 3.0 * (0.25f64 / 65_536.0).sqrt(), "{met:?}");

    // Two-sided, the same screen has a row for its back, and no back is left.
    let both = ViewFactors::new(&scene, 1e-4, &[2], keep_counting).unwrap().unwrap();
    assert_eq!(both.names, ["q0", "q1", "q2", "q2 (back)"]);
    assert_eq!(both.back_of, [None, None, None, Some(2)]);
    assert_eq!(both.areas[2..], [16.0, 16.0]);
    assert!((both.factor(0, 3).value - m.back[0].value).abs() < 1e-13);
    assert!((both.factor(3, 0).value - both.factor(0, 3).value / 16.0).abs() < 1e-15);
    assert_eq!((both.factor(0, 2).value, both.factor(2, 3).value), (0.0, 0.0));
    assert_eq!(both.factor(1, 2).value, m.factor(1, 2).value);
    assert_eq!((both.back[0].value, both.factor(0, 1).value), (0.0, 0.0));
    assert!(both.rows_that_meet_backs().is_empty());
    assert!(backs_met(&scene, &[2], 0).unwrap().is_empty());
    assert!(backs_met(&scene, &[], 3).is_err() && backs_met(&scene, &[3], 0).is_err());
}

#[test]
fn backs_have_names_of_their_own() {
    let names = |names: &[&str]| names.iter().map(ToString::to_string).collect::<Vec<_>>();
    let groups = names(&["fin", "fin (back)", "(fin (back))", "a"]);
    // In the order of the groups, each once.
    let rows = MatrixRows::new(&groups, &[3, 0, 0]);
    assert_eq!(rows.names[4..], ["((fin (back)))", "a (back)"]);
    assert_eq!(rows.back_of, [None, None, None, None, Some(0), Some(3)]);
}

#[test]
fn louvres_of_zero_thickness() {
    // Ten fins stand on end between two plates, one way round or the other: half of what they take
    // meets backs; two-sided, none. Sums do not care which way they face.
    let mut plates = vec![(square(0.5, 0.0, true), grey()), (square(0.5, 1.0, false), grey())];
    for k in 0..10 {
        let x = -0.45 + 0.1 * f64::from(k);
        let mut fin = [[x, -0.5, 0.2], [x, 0.5, 0.2], [x, 0.5, 0.8], [x, -0.5, 0.8]];
        if k % 2 == 0 {
            fin.reverse();
        }
        plates.push((fin, grey()));
    }
    let scene = quads(&plates);
    let one = exact_view_factors(&scene, 1e-4);
    let fins: Vec<usize> = (2..12).collect();
    let two = ViewFactors::new(&scene, 1e-4, &fins, keep_counting).unwrap().unwrap();
    let to_fins = |m: &ViewFactors| (2..m.names.len()).map(|j| m.factor(0, j).value).sum::<f64>();
    let (taken, errors) = (to_fins(&one) + one.back[0].value, 22.0 * 1e-5);
    assert!((taken - to_fins(&two)).abs() < errors, "{taken} {}", to_fins(&two));
    assert!((one.factor(0, 1).value - two.factor(0, 1).value).abs() < 2e-5);
    assert!(two.back.iter().all(|b| b.value == 0.0));
    // Walls of the channels are 0.1 apart and 0.6 deep: little gets through.
    assert!(two.factor(0, 1).value < 0.1 && two.factor(0, 1).value > 0.01);
}

#[test]
fn triangulation_of_plate_does_not_matter() {
    // Triangles of one group in one plane make one piece, and in any case the same factor.
    let whole = quads(&[(square(0.5, 0.0, true), grey()), (square(0.5, 0.7, false), grey())]);
    let mut positions = whole.positions().to_vec();
    let centre = positions.len() as u32;
    positions.push(DVec3::new(0.13, -0.21, 0.0));
    let mut triangles = whole.triangles().to_vec();
    let first = triangles[0];
    let rim: Vec<u32> = vec![0, 1, 2, 3];
    triangles.drain(0..2);
    for k in 0..4 {
        let corners = [rim[k], rim[(k + 1) % 4], centre];
        triangles.push(radiosity::Triangle { corners, ..first });
    }
    let fanned =
        Scene::new(positions, triangles, whole.groups().to_vec(), vec![grey(), grey()]).unwrap();
    let (a, b) = (exact_view_factors(&whole, 1e-3), exact_view_factors(&fanned, 1e-3));
    assert!((a.factor(0, 1).value - b.factor(0, 1).value).abs() < 1e-14);
    assert!((b.factor(1, 0).value - a.factor(1, 0).value).abs() < 1e-14);
}

#[test]
fn long_floor_matches_closed_form() {
    // All that a small face gets of a floor five hundred times as long comes from next to it; a
    // wall stands between by rounding alone, so that the closed form is right all the same.
    let scene = load_scene(data("long_room.obj")).unwrap();
    let m = exact_view_factors(&scene, 1e-4);
    let quad = |name: &str| {
        let first = |t: &&radiosity::Triangle| t.group as usize == group_index(&m, name);
        let all: Vec<_> = scene.triangles().iter().filter(first).collect();
        let [a, b, c] = all[0].corners;
        [a, b, c, all[1].corners[2]].map(|k| scene.positions()[k as usize])
    };
    let want = polygon_to_polygon(&quad("bx1"), &quad("wz0"));
    let got = m.factor(group_index(&m, "bx1"), group_index(&m, "wz0"));
    assert!((got.value - want).abs() < 2e-6, "{got:?} for {want}");
}

#[test]
fn rejects_bad_settings_and_can_be_cancelled() {
    let scene = cube(&grey());
    for error in [0.0, -1.0, 1.0, f64::NAN, f64::INFINITY] {
        let e = ViewFactors::new(&scene, error, &[], keep_counting).unwrap_err();
        assert_eq!(e.kind(), ErrorKind::Setting);
        assert!(e.to_string().contains("(0, 1)"), "{e}");
    }
    let e = ViewFactors::new(&scene, 1e-4, &[6], keep_counting).unwrap_err();
    assert!(e.to_string().contains("6 groups"), "{e}");
    let stopped = ViewFactors::new(&scene, 1e-4, &[], |_, _| ControlFlow::Break(()));
    assert!(stopped.unwrap().is_none());
    let mut told = vec![];
    let all = ViewFactors::new(&scene, 1e-4, &[], |done, of| {
        told.push((done, of));
        ControlFlow::Continue(())
    });
    assert!(all.unwrap().is_some());
    assert_eq!(told.last(), Some(&(6, 6)), "six walls, six pieces");
}

#[test]
fn lists_and_matrix_market_read_back() {
    let plates = [(square(0.5, 0.0, true), grey()), (square(0.5, 1.0, false), grey())];
    let mut m = exact_view_factors(&quads(&plates), 1e-4);
    m.names[0] = "low, \"1\"\n".into();
    m.factors[1][0] = Factor { to: 0, value: 1.234_56e-7, error: 2e-9 };
    let folder = tempfile::tempdir().unwrap();
    let (list, market) = (folder.path().join("m.list.csv"), folder.path().join("m.mtx"));
    write_csv_list(&list, &m).unwrap();
    write_matrix_market(&market, &m).unwrap();
    let text = std::fs::read_to_string(list).unwrap();
    assert!(text.starts_with("from,to,factor,standard_error,from_area,to_area\n"));
    // 0.1998 as printed is off by up to half of 1e-9: in a standard error 2.9e-10.
    assert!(text.contains(",q1,0.199824896,2.89e-10,1,1\n"), "{text}");
    assert!(text.contains("q1,\"low, \"\"1\"\"\n\",1.2346e-7,2.00e-9,1,1\n"), "{text}");
    assert!(text.contains("q1,open,0.800175104,"), "{text}");
    let text = std::fs::read_to_string(market).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| !l.starts_with('%')).collect();
    assert!(text.starts_with("%%MatrixMarket matrix coordinate real general\n"));
    assert!(text.contains("(row)") && text.contains("(column)") && text.contains("\"1\""));
    assert_eq!(lines[0], "2 2 2");
    assert_eq!(lines[2], "2 1 1.23456e-7");
    let value: f64 = lines[1].strip_prefix("1 2 ").unwrap().parse().unwrap();
    assert_eq!(value, m.factors[0][0].value);
}
