//! View factors between groups: against independent truth, closed forms and themselves.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::common::scenes::grey;
use crate::common::{cube, keep_counting, quads};
use glam::DVec3;
use radiosity::form_factor::closed_form::{point_to_polygon, polygon_to_polygon};
use radiosity::{
    ErrorKind, Factor, Material, Mesh, Missing, RayRows, Scene, ViewFactors, load_obj,
    write_matrix_market, write_view_factor_list,
};
use serde_json::Value;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

fn exact(scene: &Scene, error: f64) -> ViewFactors {
    ViewFactors::new(scene, error, &[], keep_counting).unwrap().unwrap()
}

fn index(m: &ViewFactors, name: &str) -> usize {
    m.names.iter().position(|n| n == name).unwrap()
}

/// A square of side `2 r` at height `z` around the axis, its front up or down.
fn square(r: f64, z: f64, up: bool) -> [[f64; 3]; 4] {
    let corners = [[-r, -r, z], [r, -r, z], [r, r, z], [-r, r, z]];
    if up { corners } else { [corners[0], corners[3], corners[2], corners[1]] }
}

/// Every factor of an independent list: closed forms, contour integrals and exact shadows over
/// plates, discs, cylinders, spheres, slits, ducts, screens and boxes (sources are in the list).
#[test]
fn all_cases_of_an_independent_list() {
    let text = std::fs::read_to_string(data("view_factors/expected.json")).unwrap();
    let cases: Vec<Value> = serde_json::from_str(&text).unwrap();
    let between_groups = cases.iter().filter(|c| c.get("differential").is_none());
    let (mut errors, mut ratios, mut honest) = (vec![], vec![], 0);
    let mut known: Option<(String, ViewFactors)> = None;
    for case in between_groups {
        let text = |key: &str| case[key].as_str().unwrap().to_string();
        let obj = text("obj");
        // Over a hundred thousand pairs with a sphere in between: looser, for the time it takes.
        let error = if obj == "ovf-concentric-spheres-004.obj" { 1e-2 } else { 1e-4 };
        if known.as_ref().is_none_or(|(name, _)| *name != obj) {
            let scene = load_obj(data("view_factors").join(&obj)).unwrap();
            known = Some((obj.clone(), exact(&scene, error)));
        }
        let Some((_, m)) = &known else { unreachable!() };
        let (from, to) = (index(m, &text("from")), text("to"));
        let got = if to == "open" { m.open[from] } else { m.factor(from, index(m, &to)) };
        let want = case["value"].as_f64().unwrap();
        let off = (got.value - want).abs();
        // Errors come out far below what is asked; a tenth of it would already be a defect.
        assert!(off <= 0.1 * error, "{}: {} for {want}", case["id"], got.value);
        assert!(want < 1e-3 || off <= 1e-3 * want, "{}: {} for {want}", case["id"], got.value);
        // What is known of the truth, and digits printed for it, are no fault of ours.
        let known_to = case["uncertainty"].as_f64().unwrap().max(1e-9);
        honest += usize::from(off <= 2.0 * got.error + known_to);
        errors.push(off);
        if off > known_to {
            ratios.push(got.error / off);
        }
    }
    let count = errors.len();
    errors.sort_by(f64::total_cmp);
    ratios.sort_by(f64::total_cmp);
    println!("{count} cases: median {:.1e}, worst {:.1e}", errors[count / 2], errors[count - 1]);
    println!("{honest} honest; estimate over error {ratios:.1?}");
    assert!(count >= 70 && errors[count / 2] <= 1e-9);
    assert!(honest * 10 >= count * 9, "{honest} of {count} within two estimates");
}

/// The cases of the list that leave a point instead of a surface.
#[test]
fn factors_from_a_point_of_an_independent_list() {
    let text = std::fs::read_to_string(data("view_factors/expected.json")).unwrap();
    let cases: Vec<Value> = serde_json::from_str(&text).unwrap();
    let mut count = 0;
    for case in &cases {
        let Some(place) = case.get("differential").map(|d| &d["dA"]) else { continue };
        let vector =
            |key: &str| DVec3::from_array([0, 1, 2].map(|k| place[key][k].as_f64().unwrap()));
        let (point, normal) = (vector("point"), vector("normal"));
        let scene = load_obj(data("view_factors").join(case["obj"].as_str().unwrap())).unwrap();
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

/// A cube with a box inside, walls 4 × 4: 120 groups, every entry.
#[test]
fn a_whole_matrix_of_an_enclosure() {
    let m = exact(&load_obj(data("box_4.obj")).unwrap(), 1e-4);
    let truth = std::fs::read_to_string(data("box_4.csv")).unwrap();
    let mut rows = 0;
    for line in truth.lines().filter(|l| !l.starts_with('#')) {
        let values: Vec<f64> = line.split(',').map(|v| v.trim().parse().unwrap()).collect();
        let i = index(&m, &format!("q{}", values[0]));
        for (j, want) in values[1..].iter().enumerate() {
            let got = m.factor(i, index(&m, &format!("q{j}"))).value;
            assert!((got - want).abs() < 1e-5, "{i} {j}: {got} for {want}");
        }
        rows += 1;
    }
    assert_eq!(rows, 120);
    assert!(m.leaks().is_empty());
    let checks = m.checks();
    println!("{checks:?}");
    assert!(checks.closure.worst < 1e-5, "a tenth of the error that was asked for");
    // Each pair is met once; what differs is the rounding of two divisions.
    assert!(checks.reciprocity.worst < 1e-15);
    assert_eq!(checks.bounds.worst, 0.0);
}

#[test]
fn what_stands_between_only_takes_away() {
    let scene = load_obj(data("view_factors/occ-box-offset-w_x0-b_x0.obj")).unwrap();
    let m = exact(&scene, 1e-4);
    let mut less = 0;
    for (i, j) in (0..12).flat_map(|i| (0..i).map(move |j| (i, j))) {
        let pair = |t: &&radiosity::Triangle| [i, j].contains(&(t.group as usize));
        let triangles = scene.triangles().iter().filter(pair).copied().collect();
        let (positions, groups) = (scene.positions().to_vec(), scene.groups().to_vec());
        let alone = Scene::new(positions, triangles, groups, scene.materials().to_vec());
        let (Ok(alone), got) = (alone, m.factor(i, j)) else { continue };
        let alone = exact(&alone, 1e-4);
        assert!(alone.leaks().iter().all(|&k| k == i || k == j), "groups without area do not leak");
        let free = alone.factor(i, j);
        assert!(got.value <= free.value + 3.0 * got.error + 1e-12, "{i} {j}");
        less += usize::from(got.value < free.value - 1e-3);
    }
    assert!(less > 10, "the box hides much: {less}");
}

#[test]
fn neither_size_nor_place_matters() {
    let scene = load_obj(data("view_factors/chap-plate-in-box-y0-y1.obj")).unwrap();
    let here = exact(&scene, 1e-4);
    // The middle one is out by the rounding of coordinates, 1e3 · 2e-16.
    for (scale, shift, rounding) in [(1e-9, 0.0, 1e-13), (1.0, 1e3, 1e-11), (1e9, 0.0, 1e-13)] {
        let moved = |p: &DVec3| *p * scale + DVec3::splat(shift);
        let positions = scene.positions().iter().map(moved).collect();
        let triangles = scene.triangles().to_vec();
        let groups = scene.groups().to_vec();
        let there = Scene::new(positions, triangles, groups, scene.materials().to_vec()).unwrap();
        let there = exact(&there, 1e-4);
        for (a, b) in here.factors.iter().flatten().zip(there.factors.iter().flatten()) {
            // Cells are cut alike unless rounding tips a balance; then within both errors.
            let allowed = rounding + 3.0 * a.error.hypot(b.error);
            assert!(a.to == b.to && (a.value - b.value).abs() <= allowed, "{scale}: {a:?} {b:?}");
        }
    }
}

#[test]
fn corners_that_are_almost_in_a_plane() {
    // A closed room with a box in it, its corners moved by as little as rounding and as much as a
    // file of six digits does: walls are no longer plane, and stand before themselves by as much.
    let scene = load_obj(data("view_factors/occ-box-offset-w_x0-b_x0.obj")).unwrap();
    let plain = exact(&scene, 1e-4);
    for (seed, move_by) in (0..).zip((0..=24).map(|k| 10f64.powf(-16.0 + 0.5 * f64::from(k)))) {
        let mut state = 88_172_645_463_325_252_u64 + seed;
        let mut random = || {
            // G. Marsaglia's xorshift64, in (-1, 1).
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        let mut moved = |p: &DVec3| *p + move_by * DVec3::new(random(), random(), random());
        let positions = scene.positions().iter().map(&mut moved).collect();
        let (triangles, groups) = (scene.triangles().to_vec(), scene.groups().to_vec());
        let there = Scene::new(positions, triangles, groups, scene.materials().to_vec()).unwrap();
        let there = exact(&there, 1e-4);
        // Faces have sides of 0.4: a corner moved by d changes a factor by some 4 d / 0.4. Above
        // that, a tenth of the error asked for, twice (two estimates).
        let allowed = 2e-5 + 10.0 * move_by;
        for i in 0..plain.names.len() {
            for j in 0..plain.names.len() {
                let (a, b) = (plain.factor(i, j).value, there.factor(i, j).value);
                assert!((a - b).abs() < allowed, "moved {move_by:.0e}: {i} {j} {a} {b}");
            }
            let lost = there.open[i].value.abs() + there.back[i].value.abs();
            assert!(lost < 3e-5, "moved {move_by:.0e}: {lost} of {i} lost in a closed room");
        }
    }
}

#[test]
fn the_same_bits_on_every_run() {
    let scene = load_obj(data("box_4.obj")).unwrap();
    assert!(exact(&scene, 1e-3) == exact(&scene, 1e-3));
}

#[test]
fn what_is_hidden_is_zero_and_what_meets_a_back_is_told() {
    // Squares of side 1 a unit apart; a screen of side 4 between them, its back to the lower.
    let plates = [
        (square(0.5, 0.0, true), grey()),
        (square(0.5, 1.0, false), grey()),
        (square(2.0, 0.5, true), grey()),
    ];
    let scene = quads(&plates);
    let m = exact(&scene, 1e-4);
    assert_eq!(m.absent, Missing::Zero);
    assert_eq!(m.factors[0], []);
    assert_eq!(m.factors[1].iter().map(|f| f.to).collect::<Vec<_>>(), [2]);
    // The screen's back receives from below what its front receives from above, both closed forms.
    assert!((m.back[0].value - m.factor(1, 2).value).abs() < 1e-13);
    assert!((m.back[0].value + m.open[0].value - 1.0).abs() < 1e-15);
    assert_eq!(m.leaks().len(), 3, "all see out beside one another");

    // Two-sided, the same screen gives and takes below too, and no back is left.
    let both = ViewFactors::new(&scene, 1e-4, &[2], keep_counting).unwrap().unwrap();
    assert_eq!((both.areas[2], m.areas[2]), (32.0, 16.0));
    assert!((both.factor(0, 2).value - m.back[0].value).abs() < 1e-13);
    assert!((both.factor(2, 0).value - both.factor(0, 2).value / 32.0).abs() < 1e-15);
    assert_eq!((both.back[0].value, both.factor(0, 1).value), (0.0, 0.0));
}

#[test]
fn louvres_of_zero_thickness_side_by_side() {
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
    let one = exact(&scene, 1e-4);
    let fins: Vec<usize> = (2..12).collect();
    let two = ViewFactors::new(&scene, 1e-4, &fins, keep_counting).unwrap().unwrap();
    let to_fins = |m: &ViewFactors| fins.iter().map(|&j| m.factor(0, j).value).sum::<f64>();
    let (taken, errors) = (to_fins(&one) + one.back[0].value, 12.0 * 1e-5);
    assert!((taken - to_fins(&two)).abs() < errors, "{taken} {}", to_fins(&two));
    assert!((one.factor(0, 1).value - two.factor(0, 1).value).abs() < 2e-5);
    assert!(two.back.iter().all(|b| b.value == 0.0));
    // Walls of the channels are 0.1 apart and 0.6 deep: little gets through.
    assert!(two.factor(0, 1).value < 0.1 && two.factor(0, 1).value > 0.01);
}

#[test]
fn a_plate_cut_at_random_is_the_same_plate() {
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
    let (a, b) = (exact(&whole, 1e-3), exact(&fanned, 1e-3));
    assert!((a.factor(0, 1).value - b.factor(0, 1).value).abs() < 1e-14);
    assert!((b.factor(1, 0).value - a.factor(1, 0).value).abs() < 1e-14);
}

#[test]
fn sampled_factors_know_their_errors() {
    // Against the exact matrix of a cube with a box inside; 4096 rays a row, elements of an eighth.
    let scene = load_obj(data("view_factors/occ-box-centred-w_x0-w_y0.obj")).unwrap();
    let truth = exact(&scene, 1e-4);
    let mesh = Mesh::new(scene, 0.18).unwrap();
    let mut rays = RayRows::new(&mesh, 4096).unwrap();
    let m = ViewFactors::sampled(&mesh, &mut rays, keep_counting).unwrap().unwrap();
    assert_eq!(m.absent, Missing::NotSeen);
    let (mut within, mut count, mut worst) = (0, 0, 0.0_f64);
    for i in 0..m.names.len() {
        for f in &truth.factors[i] {
            let got = m.factor(i, f.to as usize);
            let off = (got.value - f.value).abs();
            count += 1;
            within += usize::from(off <= 2.0 * got.error.hypot(f.error));
            worst = worst.max(off);
        }
    }
    println!("{within} of {count} within two estimates, worst {worst:.1e}");
    assert!(within * 10 >= count * 7, "{within} of {count}");
    // Neighbouring walls are seen from a sixteenth away at the nearest: up to 0.02.
    assert!(worst < 0.02, "{worst}");
    let checks = m.checks();
    assert!(checks.closure.worst < 1e-8, "shares are whole numbers of 2^-32");
    assert!(checks.reciprocity.worst > 1e-5, "rays are not reciprocal: {checks:?}");

    let (enforced, correction) = m.enforced();
    let after = enforced.checks();
    println!("{correction:?}");
    assert!(after.reciprocity.worst < 1e-14, "{after:?}");
    assert!(after.closure.worst < 1e-12 && correction.left < 1e-12, "{after:?}");
    assert_eq!(after.bounds.worst, 0.0);
    assert!(
        correction.worst > 0.0 && correction.worst < 0.02 && correction.rms <= correction.worst
    );
    for (i, row) in enforced.factors.iter().enumerate() {
        let total = row.iter().map(|f| f.value).sum::<f64>() + enforced.back[i].value;
        assert!(total + enforced.open[i].value <= 1.0 && row.iter().all(|f| f.value >= 0.0));
    }
}

#[test]
fn an_open_scene_stays_open_when_enforced() {
    let plates = [(square(0.5, 0.0, true), grey()), (square(1.0, 0.5, false), grey())];
    let mut m = exact(&quads(&plates), 1e-3);
    let raw = m.clone();
    // As if measured apart, and a little off.
    m.factors[0] = vec![Factor { to: 1, value: m.factor(0, 1).value + 1e-3, error: 1e-3 }];
    let (out, correction) = m.enforced();
    assert_eq!(correction.closed, 0);
    assert!(out.checks().reciprocity.worst < 1e-15);
    assert!((out.factor(0, 1).value - raw.factor(0, 1).value).abs() < 1e-3);
    for i in 0..2 {
        let total: f64 = out.factors[i].iter().map(|f| f.value).sum::<f64>() + out.open[i].value;
        assert!((total - 1.0).abs() < 1e-12 && out.open[i].value > 0.1, "{total}");
    }
}

#[test]
fn a_leak_is_found_and_named() {
    let closed = exact(&cube(&grey()), 1e-4);
    assert!(closed.leaks().is_empty());
    // The lid lifted by a thousandth: light gets out over the rim.
    let mut scene = cube(&grey());
    let lid = scene.positions().iter().enumerate().filter(|(k, _)| k / 4 == 5);
    let lid: Vec<usize> = lid.map(|(k, _)| k).collect();
    let mut positions = scene.positions().to_vec();
    lid.iter().for_each(|&k| positions[k].z += 1e-3);
    scene = Scene::new(
        positions,
        scene.triangles().to_vec(),
        scene.groups().to_vec(),
        scene.materials().to_vec(),
    )
    .unwrap();
    let leaky = exact(&scene, 1e-4);
    assert_eq!(leaky.leaks().len(), 6);
    assert!(leaky.open[leaky.leaks()[0]].value > 1e-4);
}

#[test]
fn a_poster_in_the_plane_of_its_wall_is_found() {
    let poster = [[0.3, 0.3, 0.], [0.7, 0.3, 0.], [0.7, 0.7, 0.], [0.3, 0.7, 0.]];
    let room = cube(&grey());
    let mut walls: Vec<([[f64; 3]; 4], Material)> = (0..6)
        .map(|k| ([0, 1, 2, 3].map(|c| room.positions()[4 * k + c].to_array()), grey()))
        .collect();
    walls.push((poster, grey()));
    let twice = exact(&quads(&walls), 1e-4);
    // The ceiling sees the poster's part of the floor a second time.
    assert_eq!(twice.overfull().first(), Some(&5));
    assert!(twice.checks().closure.worst > 0.03);
    assert!(exact(&room, 1e-4).overfull().is_empty());
    // Lifted off the wall by a millionth, it hides what is behind it.
    walls[6].0.iter_mut().for_each(|p| p[2] = 1e-6);
    let lifted = exact(&quads(&walls), 1e-4);
    assert!(lifted.overfull().is_empty() && lifted.checks().closure.worst < 1e-5);
    assert!((lifted.back[4].value - 0.16).abs() < 1e-5, "{:?}", lifted.back[4]);
}

#[test]
fn a_long_floor_and_a_narrow_face_that_sees_a_spot_of_it() {
    // All that a small face gets of a floor five hundred times as long comes from next to it; a wall
    // stands between by rounding alone, so that the closed form is right all the same.
    let scene = load_obj(data("long_room.obj")).unwrap();
    let m = exact(&scene, 1e-4);
    let quad = |name: &str| {
        let first = |t: &&radiosity::Triangle| t.group as usize == index(&m, name);
        let all: Vec<_> = scene.triangles().iter().filter(first).collect();
        let [a, b, c] = all[0].corners;
        [a, b, c, all[1].corners[2]].map(|k| scene.positions()[k as usize])
    };
    let want = polygon_to_polygon(&quad("bx1"), &quad("wz0"));
    let got = m.factor(index(&m, "bx1"), index(&m, "wz0"));
    assert!((got.value - want).abs() < 2e-6, "{got:?} for {want}");
}

#[test]
fn bad_settings_are_refused_and_work_can_be_cancelled() {
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
fn lists_and_matrix_market_files() {
    let plates = [(square(0.5, 0.0, true), grey()), (square(0.5, 1.0, false), grey())];
    let mut m = exact(&quads(&plates), 1e-4);
    m.names[0] = "low, \"1\"\n".into();
    m.factors[1][0] = Factor { to: 0, value: 1.234_56e-7, error: 2e-9 };
    let folder = tempfile::tempdir().unwrap();
    let (list, market) = (folder.path().join("m.list.csv"), folder.path().join("m.mtx"));
    write_view_factor_list(&list, &m).unwrap();
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
