//! View factors of many polygons, each pair by the cheapest method: against exact ones.

use std::f64::consts::{PI, TAU};
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::view_factor::{Estimate, Factor, Missing};
use radiosity::{ErrorKind, Scene, Triangle, ViewFactors, load_scene};

use crate::common::scenes::{facing_down, facing_up, grey, quads, standing_block};
use crate::common::view_factors::{data, exact_view_factors};
use crate::common::{cube, keep_counting};

fn sparse(scene: &Scene, error: f64, two_sided: &[usize]) -> ViewFactors {
    ViewFactors::sparse(scene, error, two_sided, keep_counting).unwrap().unwrap()
}

/// Houses of unlike heights, `count` a side, on one ground and under one sky.
pub fn town(count: u32) -> Scene {
    let size = 3.0 * f64::from(count);
    let mut surfaces =
        vec![facing_up([0.0, size], [0.0, size], 0.0), facing_down([0.0, size], [0.0, size], 12.0)];
    for house in 0..count * count {
        let (x, y) = (3.0 * f64::from(house % count), 3.0 * f64::from(house / count));
        let height = 1.0 + f64::from(house * 7 % 5);
        surfaces.extend(standing_block([x + 0.5, x + 2.5], [y + 0.5, y + 2.5], 0.0, height));
    }
    let surfaces: Vec<_> = surfaces.into_iter().map(|quad| (quad, grey())).collect();
    quads(&surfaces)
}

/// How a row compares with an exact one.
#[derive(Debug, Default)]
struct Comparison {
    factors: usize,
    within_two_errors: usize,
    largest_error: f64,
    left_out: f64,
}

impl Comparison {
    fn add(&mut self, row: &[Factor], exact: &[Factor], error: f64) {
        let find = |row: &[Factor], to: u32| row.iter().find(|f| f.to == to).copied();
        for f in row {
            let off = (f.value - find(exact, f.to).map_or(0.0, |e| e.value)).abs();
            self.factors += 1;
            self.within_two_errors += usize::from(off <= 2.0 * f.error + 1e-9);
            self.largest_error = self.largest_error.max(off);
        }
        for e in exact.iter().filter(|e| find(row, e.to).is_none()) {
            self.factors += 1;
            self.within_two_errors += usize::from(e.value <= error);
            self.left_out = self.left_out.max(e.value);
        }
    }
}

#[test]
fn sizes_of_matrices_are_predicted() {
    let scene = town(14);
    let matrix = ViewFactors::new(&scene, 1e-3, &[], keep_counting).unwrap().unwrap();
    assert_eq!(matrix.absent, Missing::Unmet, "exact where sparse is to be predicted");
    let factors = matrix.factors.iter().map(Vec::len).sum::<usize>() as f64;
    let predicted = ViewFactors::predicted_size(&scene, 1e-3, &[]).unwrap();
    println!("{factors} factors, predicted {predicted:?}");
    // 256 of 982 rows are drawn, whose lengths differ by half: 0.5 / √256 are 3 %, and pairs that
    // are large on one side only are counted by the other.
    assert!((predicted.factors as f64 / factors - 1.0).abs() < 0.15, "{factors} {predicted:?}");
    // An exact one has all pairs at most.
    let scene = load_scene(data("box_4.obj")).unwrap();
    let groups = scene.groups().len();
    assert_eq!(ViewFactors::predicted_size(&scene, 1e-3, &[]).unwrap().factors, groups * groups);
    assert!(ViewFactors::predicted_size(&scene, 0.0, &[]).is_err());
}

#[test]
fn enclosure_is_as_good_as_it_says() {
    let scene = load_scene(data("box_4.obj")).unwrap();
    let exact = exact_view_factors(&scene, 1e-4);
    for error in [1e-2, 1e-3] {
        let m = sparse(&scene, error, &[]);
        assert_eq!((m.absent, exact.absent), (Missing::Unmet, Missing::Zero));
        let mut found = Comparison::default();
        for (row, exact) in m.factors.iter().zip(&exact.factors) {
            found.add(row, exact, error);
        }
        println!("{error}: {found:?}");
        assert!(found.within_two_errors * 20 >= found.factors * 19, "{found:?}");
        // Standard errors are half of what is asked for: five of them, among some 5000 factors.
        assert!(found.largest_error < 2.5 * error && found.left_out < 2.5 * error, "{found:?}");
        let checks = m.checks();
        assert_eq!(checks.bounds.max, 0.0);
        assert!(checks.reciprocity.max < 1e-15, "each pair is met once");
        // Some 70 factors a row; if all had the largest standard error, √70 of them, three times.
        assert!(checks.closure.max < 0.5 * error * 70f64.sqrt() * 3.0, "{checks:?}");
        assert!(m.open_rows().is_empty() && m.rows_over_unity().is_empty());
    }
}

#[test]
fn ground_and_sky_are_seen_past_a_whole_town() {
    // 200 blockers: more than a shaft between a wall and the ground is asked for.
    let scene = town(6);
    let error = 2e-3;
    let m = sparse(&scene, error, &[]);
    let rows: Vec<usize> = (0..12).map(|k| 2 + 15 * k).collect();
    let exact = ViewFactors::exact_rows(&scene, 1e-2, &[], &rows, keep_counting).unwrap().unwrap();
    let mut found = Comparison::default();
    for (&i, exact) in rows.iter().zip(&exact) {
        found.add(&m.factors[i], exact, error);
        for large in exact.iter().filter(|f| f.to < 2) {
            let got = m.factor(i, large.to as usize);
            // Three standard errors, or what is asked for where no ray met it, and a hundredth of
            // what the exact row may be off.
            let off = (got.value - large.value).abs();
            let error = if got.error > 0.0 { 3.0 * got.error } else { error };
            assert!(off <= error + 1e-4, "{i} {}: {got:?} {large:?}", large.to);
        }
    }
    println!("{found:?}");
    assert!(found.within_two_errors * 20 >= found.factors * 19, "{found:?}");
    assert!(found.largest_error < 2.5 * error && found.left_out < 2.5 * error, "{found:?}");
    assert_eq!(m.checks().bounds.max, 0.0);
}

#[test]
fn groups_of_many_polygons_and_both_sides_add_up() {
    // Two cylinders, one within the other, of 32 faces each; and a plate with two sides between
    // plates, whose back is met where it has one.
    let cylinders = load_scene(data("view_factors/ovf-coaxial-cylinders-003.obj")).unwrap();
    let surfaces = [
        facing_up([0.0, 1.0], [0.0, 1.0], 0.0),
        facing_down([0.0, 1.0], [0.0, 1.0], 1.0),
        facing_up([0.3, 0.6], [0.3, 0.6], 0.5),
    ];
    let plates = quads(&surfaces.map(|quad| (quad, grey())));
    for (scene, two_sided) in [(&cylinders, &[][..]), (&plates, &[]), (&plates, &[2])] {
        let error = 1e-3;
        let m = sparse(scene, error, two_sided);
        let exact = ViewFactors::exact(scene, 1e-4, two_sided, keep_counting).unwrap().unwrap();
        assert_eq!((&m.areas, &m.names), (&exact.areas, &exact.names));
        for i in 0..m.names.len() {
            for j in 0..m.names.len() {
                let (got, want) = (m.factor(i, j), exact.factor(i, j));
                let off = (got.value - want.value).abs();
                // Of some twenty factors none is off by three standard errors but by a chance of
                // one in twenty; the exact ones are off by less than a tenth of 1e-4.
                assert!(off <= 3.0 * got.error + 1e-5, "{i} {j}: {got:?} {want:?}");
                assert!(got.error <= 0.5 * error * 1.5, "{i} {j}: {got:?}");
            }
            for (got, want) in [(m.open[i], exact.open[i]), (m.back[i], exact.back[i])] {
                let off = (got.value - want.value).abs();
                assert!(off <= 3.0 * got.error + 1e-5, "{i}: {got:?} {want:?}");
            }
        }
        assert_eq!(m.back[0].value > 0.0, exact.back[0].value > 1e-6);
    }
}

/// A sphere of 8 · 4ᵏ triangles, by the corners of their octahedron: faces outwards, or inwards.
fn sphere(radius: f64, k: u32, is_inside: bool) -> Vec<[DVec3; 3]> {
    let axes = [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y];
    let octants = (0..4).flat_map(|k| {
        let [a, b] = [axes[k], axes[(k + 1) % 4]];
        [[a, b, DVec3::Z], [b, a, DVec3::NEG_Z]]
    });
    let mut faces: Vec<[DVec3; 3]> = octants.collect();
    for _ in 0..k {
        let parts = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(parts).collect();
    }
    let placed = |[a, b, c]: [DVec3; 3]| {
        let corners = if is_inside { [a, c, b] } else { [a, b, c] };
        corners.map(|corner| radius * corner)
    };
    faces.into_iter().map(placed).collect()
}

/// A scene of groups of triangles, corner by corner.
pub fn of_triangles(groups: &[(&str, Vec<[DVec3; 3]>)]) -> Scene {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (group, (_, faces)) in (0..).zip(groups) {
        for corners in faces {
            let first = positions.len() as u32;
            positions.extend(corners);
            let corners = [first, first + 1, first + 2];
            triangles.push(Triangle { corners, group, material: 0, smoothing: None });
        }
    }
    let names = groups.iter().map(|(name, _)| (*name).into()).collect();
    Scene::new(positions, triangles, names, vec![grey()]).unwrap()
}

#[test]
fn rows_of_curved_groups_have_no_bias() {
    // Two spheres: pairs of their facets are hit by a few rays or none, and add up. The inner one
    // is convex: all of its flux arrives at the outer one, and A_i / A_o = 0.25 of that comes back.
    let spheres = [("inner", sphere(0.5, 3, false)), ("outer", sphere(1.0, 3, true))];
    let scene = of_triangles(&spheres);
    for error in [1e-1, 1e-2] {
        let m = sparse(&scene, error, &[]);
        for (i, j, want) in [(0, 1, 1.0), (1, 0, 0.25)] {
            let Estimate { value, error } = m.factor(i, j);
            // Three standard errors; a bias of 0.8 % at 1e-2 is five of them.
            assert!((value - want).abs() < 3.0 * error, "{i} {j}: {value} ± {error}");
        }
        assert!(m.rows_over_unity().is_empty() && m.worst_out_of_bounds().is_none());
    }
}

/// The faces of a body of revolution about z, inwards: `profile` has radius and height from bottom
/// to top, and each of its pieces `sectors` trapezoids, two triangles each.
pub fn revolved(profile: &[[f64; 2]], sectors: u32) -> Vec<[DVec3; 3]> {
    let at = |[radius, z]: [f64; 2], k: u32| {
        let (sin, cos) = (TAU * f64::from(k % sectors) / f64::from(sectors)).sin_cos();
        DVec3::new(radius * cos, radius * sin, z)
    };
    let faces = |(piece, k): (&[[f64; 2]], u32)| {
        let [a, b] = [at(piece[0], k), at(piece[0], k + 1)];
        let [c, d] = [at(piece[1], k + 1), at(piece[1], k)];
        [[a, c, b], [a, d, c]]
    };
    let pieces = profile.windows(2).flat_map(|piece| (0..sectors).map(move |k| (piece, k)));
    let has_area = |[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).length() > 1e-9;
    pieces.flat_map(faces).filter(has_area).collect()
}

#[test]
fn chambers_see_each_other_through_their_neck() {
    // A closed hourglass of two unlike chambers: what leaves the lower one for the upper passes the
    // polygon of the neck, a convex one that sees nothing but chambers: A₁F₁₂ is its area. The rest
    // stays, since the faces of each are on one side of the neck.
    let sectors = 24;
    let lower = |t: f64| [0.3 + 0.9 * (0.5 * PI * t).sin(), -t];
    let upper = |t: f64| [0.3 + 0.5 * t * t, 1.5 * t];
    let low: Vec<[f64; 2]> = (0..=12).rev().map(|k| lower(f64::from(k) / 12.0)).collect();
    let up: Vec<[f64; 2]> = (0..=12).map(|k| upper(f64::from(k) / 12.0)).collect();
    let (floor, top) = ([[0.0, -1.0], low[0]], [up[12], [0.0, 1.5]]);
    let chamber = |parts: [&[[f64; 2]]; 2]| parts.map(|part| revolved(part, sectors)).concat();
    let chambers = [("low", chamber([&floor, &low])), ("up", chamber([&up, &top]))];
    let neck = 0.5 * f64::from(sectors) * 0.09 * (TAU / f64::from(sectors)).sin();
    let scene = of_triangles(&chambers);
    for error in [1e-1, 1e-2, 3e-3] {
        let m = sparse(&scene, error, &[]);
        for i in 0..2 {
            let through = neck / m.areas[i];
            for (j, want) in [(1 - i, through), (i, 1.0 - through)] {
                let Estimate { value, error } = m.factor(i, j);
                println!("{i} {j}: {:.2} of its errors", (value - want) / error);
                assert!((value - want).abs() < 3.0 * error, "{i} {j}: {value} ± {error}, {want}");
            }
            let Estimate { value, error } = m.open[i];
            assert!(value.abs() < 3.0 * error, "{i}: {value} ± {error}");
        }
        assert!(m.open_rows().is_empty() && m.rows_over_unity().is_empty());
    }
}

#[test]
fn rows_of_exact_matrix_are_its_rows() {
    let scene = load_scene(data("box_4.obj")).unwrap();
    let exact = exact_view_factors(&scene, 1e-3);
    let rows = ViewFactors::exact_rows(&scene, 1e-3, &[], &[3, 97], keep_counting);
    for (row, i) in rows.unwrap().unwrap().iter().zip([3, 97]) {
        // Those of no value are told with their error where they were looked for.
        let seen = |row: &[Factor]| row.iter().filter(|f| f.value > 1e-6).count();
        assert_eq!(seen(row), seen(&exact.factors[i]));
        for f in row {
            let off = (f.value - exact.factor(i, f.to as usize).value).abs();
            // Cuts differ: both are off by less than a tenth of what is asked for.
            assert!(off < 2e-4, "{i} {f:?}");
        }
    }
}

#[test]
fn many_polygons_are_sparse_and_few_are_exact() {
    let kind = |scene: &Scene, error| {
        let m = ViewFactors::new(scene, error, &[], keep_counting).unwrap().unwrap();
        (m.absent, m)
    };
    assert_eq!(kind(&cube(&grey()), 0.5).0, Missing::Zero);
    // 1127 polygons, some two blockers between two of them.
    let (absent, m) = kind(&town(15), 0.2);
    assert_eq!(absent, Missing::Unmet);
    assert_eq!(m.checks().bounds.max, 0.0);
}

#[test]
fn same_bits_come_from_any_number_of_threads() {
    let scene = town(3);
    let with_threads = |count| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
        pool.install(|| sparse(&scene, 1e-2, &[]))
    };
    assert_eq!(with_threads(1), with_threads(3));
}

#[test]
fn progress_is_told_to_the_end_and_may_cancel() {
    let scene = town(3);
    let mut told = vec![];
    let progress = |done, of| {
        told.push((done, of));
        ControlFlow::Continue(())
    };
    ViewFactors::sparse(&scene, 1e-1, &[], progress).unwrap().unwrap();
    assert!(told.is_sorted() && told.len() >= 3, "{told:?}");
    assert_eq!(told.last(), Some(&(47, 47)));
    for stop_at in 0..told.len() {
        let mut calls = 0;
        let progress = |_, _| {
            calls += 1;
            if calls > stop_at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        assert_eq!(ViewFactors::sparse(&scene, 1e-1, &[], progress).unwrap(), None);
    }
}

#[test]
fn settings_out_of_range_are_refused() {
    let scene = cube(&grey());
    for (error, two_sided) in [(0.0, &[][..]), (1.0, &[]), (f64::NAN, &[]), (0.1, &[6])] {
        let refused = ViewFactors::sparse(&scene, error, two_sided, keep_counting).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::Setting);
    }
    let refused = ViewFactors::exact_rows(&scene, 0.1, &[], &[6], keep_counting).unwrap_err();
    assert_eq!(refused.kind(), ErrorKind::Setting);
}

#[test]
fn enforcement_keeps_the_pattern() {
    let m = sparse(&town(4), 1e-2, &[]);
    let (enforced, report) = m.enforced();
    let pattern = |m: &ViewFactors| -> Vec<Vec<u32>> {
        m.factors.iter().map(|row| row.iter().map(|f| f.to).collect()).collect()
    };
    assert_eq!(pattern(&enforced), pattern(&m));
    let checks = enforced.checks();
    assert!(checks.reciprocity.max < 1e-14 && checks.bounds.max == 0.0, "{checks:?}");
    // Sums of some hundred terms, rounded.
    assert!(report.closure_left < 1e-12, "{report:?}");
    // What is open by less than three errors of a row is taken for closed, and spread over it.
    let largest_error = m.open.iter().map(|open| open.error).fold(0.0, f64::max);
    assert!(report.max_change > 0.0 && report.max_change < 3.0 * largest_error, "{report:?}");
    assert!(enforced.factors.iter().flatten().all(|f| f.value >= 0.0));
}
