//! Where the points of measuring grids are.

use glam::DVec3;
use radiosity::grid::{GridPlane, GridSettings, MeasuringGrid};
use radiosity::{ErrorKind, Scene};

use crate::common::quads;
use crate::common::scenes::{Quad, facing_up, grey, standing_block, walls};

const METRES: GridSettings = GridSettings { metre: 1.0, strip: 0.5, spacing: None };

fn scene(parts: &[Quad]) -> Scene {
    quads(&parts.iter().map(|&part| (part, grey())).collect::<Vec<_>>())
}

fn floors(scene: &Scene, settings: &GridSettings) -> Vec<MeasuringGrid> {
    MeasuringGrid::above_floors(scene, DVec3::Z, 0.8, settings).unwrap()
}

/// The table of EN 12464-1 has 5, 10 and 20 points for 1, 10 and 100 m; even numbers become odd.
#[test]
fn spacing_is_that_of_the_norm() {
    for (edges, counts) in [
        ([1.0, 1.0], [5, 5]),
        ([10.0, 10.0], [11, 11]),
        ([100.0, 100.0], [21, 21]),
        // p = 0.2 · 5^0.699 = 0.616: 8.1 and 6.5 cells.
        ([5.0, 4.0], [9, 7]),
        // Four times as long as wide, so of the shorter side: 32.5 and 8.1 cells.
        ([20.0, 5.0], [33, 9]),
        // p would be 25 m.
        ([1000.0, 1000.0], [101, 101]),
    ] {
        assert_eq!(METRES.counts(edges).unwrap(), counts, "{edges:?}");
        let millimetres = GridSettings { metre: 1000.0, ..METRES };
        assert_eq!(millimetres.counts(edges.map(|e| 1000.0 * e)).unwrap(), counts);
    }
    let settings = GridSettings { spacing: Some(1.0), ..METRES };
    assert_eq!(settings.counts([3.0, 2.0]).unwrap(), [3, 3]);
    let wrong = [
        GridSettings { metre: 0.0, ..METRES },
        GridSettings { strip: -0.1, ..METRES },
        GridSettings { spacing: Some(f64::NAN), ..METRES },
        GridSettings { spacing: Some(1e-4), ..METRES },
    ];
    for settings in wrong {
        let error = settings.counts([3.0, 2.0]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting, "{settings:?}");
    }
}

#[test]
fn points_are_in_the_middles_of_the_cells_of_a_plane() {
    let plane = GridPlane { origin: DVec3::Z, edges: [DVec3::X * 4.0, DVec3::Y * 3.0] };
    let settings = GridSettings { spacing: Some(1.0), ..METRES };
    let grid = MeasuringGrid::on_plane("desk", plane, &settings).unwrap();
    // 3 m by 2 m are left: three cells by three, the second row of which is in the middle.
    assert_eq!((grid.counts, grid.plane.origin), ([3, 3], DVec3::new(0.5, 0.5, 1.0)));
    assert_eq!(grid.points[0], Some(DVec3::new(1.0, 0.5 + 1.0 / 3.0, 1.0)));
    assert_eq!(grid.points[5], Some(DVec3::new(3.0, 1.5, 1.0)));
    let [a, b] = grid.cell();
    assert!((a - 1.0).abs() < 1e-15 && (b - 2.0 / 3.0).abs() < 1e-15);
    // Across a parallelogram the strip is as wide.
    let slanted = GridPlane { edges: [DVec3::X * 4.0, DVec3::new(3.0, 3.0, 0.0)], ..plane };
    let grid = MeasuringGrid::on_plane("slanted", slanted, &settings).unwrap();
    assert!((grid.plane.origin.y - 0.5).abs() < 1e-15);
    let broken = GridPlane { edges: [DVec3::X, DVec3::X * 2.0], ..plane };
    let narrow = GridPlane { edges: [DVec3::X, DVec3::Y], ..plane };
    for plane in [broken, narrow] {
        let error = MeasuringGrid::on_plane("none", plane, &METRES).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting);
    }
}

/// A turned house of two storeys with a table: tables are too small to be floors.
#[test]
fn floors_are_found_however_the_house_is_turned() {
    let (sin, cos) = (0.5f64).sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [x * cos - y * sin + 7.0, x * sin + y * cos, z];
    let mut parts = walls([0.0; 3], [6.0, 4.0, 2.5]).to_vec();
    parts.extend(standing_block([2.0, 3.5], [1.0, 2.0], 0.0, 0.7));
    parts.extend(walls([0.0, 0.0, 2.6], [6.0, 4.0, 5.1]));
    // The roof is no floor, and neither is a strip as narrow as those that are left out.
    parts.push(facing_up([-1.0, 7.0], [-1.0, 5.0], 5.3));
    parts.push(facing_up([0.0, 0.9], [5.0, 12.0], 0.0));
    let parts: Vec<Quad> = parts.into_iter().map(|part| part.map(turn)).collect();
    let grids = floors(&scene(&parts), &METRES);
    assert_eq!(grids.len(), 2, "{grids:?}");
    for (grid, height) in grids.iter().zip([0.8, 3.4]) {
        // 5 m by 3 m are left, with p = 0.616.
        assert_eq!((grid.counts, grid.points.len()), ([9, 5], 45));
        let points: Vec<DVec3> = grid.points.iter().map(|p| p.unwrap()).collect();
        let mean = points.iter().sum::<DVec3>() / 45.0;
        // Roundings of coordinates below 16.
        assert!(mean.distance(turn([3.0, 2.0, height]).into()) < 1e-13, "{mean}");
        let first = DVec3::from_array(turn([0.5 + 5.0 / 18.0, 0.5 + 0.3, height]));
        assert!(points[0].distance(first) < 1e-13, "{}", points[0]);
        assert!((points[1] - points[0]).normalize().x > 0.8);
    }
    assert_eq!(grids[1].name, "q15");
}

/// A slab under two rooms and a cupboard, with a door between the rooms: a grid for each room, as
/// if it had a floor of its own. So with a beam below the ceiling, which parts nothing.
#[test]
fn a_slab_under_two_rooms_is_two_grids() {
    // A wall at x = 4 of 0.1 m, with a door of 2.1 m from y = 1 to 2.
    let mut parts = walls([0.0; 3], [10.0, 4.0, 2.8]).to_vec();
    for (y, z) in [([0.0, 1.0], [0.0, 2.8]), ([2.0, 4.0], [0.0, 2.8]), ([1.0, 2.0], [2.1, 2.8])] {
        let at = |x: f64| [[x, y[0], z[0]], [x, y[1], z[0]], [x, y[1], z[1]], [x, y[0], z[1]]];
        parts.extend([at(4.1), {
            let [a, b, c, d] = at(4.0);
            [d, c, b, a]
        }]);
    }
    parts.extend(standing_block([8.0, 9.0], [3.4, 4.0], 0.0, 2.4));
    let beam = [[7.0, 0.0, 2.5], [7.0, 4.0, 2.5], [7.0, 4.0, 2.8], [7.0, 0.0, 2.8]];
    for parts in [parts.clone(), [parts, vec![beam]].concat()] {
        let scene = scene(&parts);
        let grids = floors(&scene, &GridSettings { spacing: Some(0.5), ..METRES });
        let [a, b] = &grids[..] else { panic!("two rooms: {grids:?}") };
        assert!(a.name.ends_with(" 1") && b.name.ends_with(" 2") && a.name != b.name);
        for (grid, x, counts) in [(a, [0.5, 3.5], [7, 7]), (b, [4.6, 9.5], [11, 7])] {
            assert_eq!(grid.counts, counts, "{grid:?}");
            let [low, high] =
                [grid.plane.origin, grid.plane.origin + grid.plane.edges[0]].map(|p| p.x);
            // Distances to walls are those of rays, to a billionth of the scene's size.
            assert!((low - x[0]).abs() < 1e-7 && (high - x[1]).abs() < 1e-7, "{grid:?}");
        }
        assert!(a.points.iter().all(Option::is_some));
        // The strip goes around the cupboard: half a metre from x = 8 to 9 and y = 3.4 on.
        let near = |p: &DVec3| p.x > 7.6 && p.x < 9.4 && p.y > 3.0;
        assert!(!b.points.iter().flatten().any(near), "{b:?}");
        assert!(b.points.iter().filter(|p| p.is_none()).count() < 20, "{b:?}");
    }
}

/// An L: points keep off its inner corner too.
#[test]
fn points_keep_off_the_edges_of_a_floor() {
    let parts = [
        facing_up([0.0, 8.0], [0.0, 3.0], 0.0),
        [[0.0, 3.0, 0.0], [3.0, 3.0, 0.0], [3.0, 8.0, 0.0], [0.0, 8.0, 0.0]],
    ];
    let grids = floors(&scene(&parts), &GridSettings { spacing: Some(0.5), ..METRES });
    // Both parts share a corner.
    let [grid] = &grids[..] else { panic!("one floor: {grids:?}") };
    assert_eq!(grid.counts, [15, 15]);
    for (k, point) in grid.points.iter().enumerate() {
        let [column, row] = [k % 15, k / 15].map(|n| 0.5 + 7.0 * (n as f64 + 0.5) / 15.0);
        let within = |x: f64, low: f64, high: f64| x > low && x < high;
        let sure = within(column, 0.0, 2.5) || within(row, 0.0, 2.5);
        // Beside one of its arms; before the inner corner there is room.
        let never = column > 3.0 && row > 2.5 || row > 3.0 && column > 2.5;
        assert!(point.is_some() || !sure, "{column} {row}");
        assert!(point.is_none() || !never, "{column} {row}");
    }
}

#[test]
fn grids_are_laid_above_groups() {
    let mut parts = walls([0.0; 3], [6.0, 4.0, 2.5]).to_vec();
    parts.push(facing_up([2.0, 3.6], [1.0, 1.8], 0.7));
    let scene = scene(&parts);
    let settings = GridSettings { strip: 0.0, ..METRES };
    let above = |group: &str, height, settings: &GridSettings| {
        MeasuringGrid::above_group(&scene, group, DVec3::Z, height, settings)
    };
    let desk = above("q6", 0.1, &settings).unwrap();
    // p = 0.2 · 5^log10(0.8) = 0.171: twice as long as wide. 9.4 and 4.7 cells.
    assert_eq!((desk.counts, desk.name.as_str()), ([11, 5], "q6"));
    let middle = desk.points[27].unwrap();
    assert!(middle.distance(DVec3::new(2.8, 1.4, 0.8)) < 1e-14, "{middle}");
    // A wall faces sideways: half a metre before it.
    let wall = above("q0", 0.5, &settings).unwrap();
    assert!(wall.points.iter().flatten().all(|p| (p.x - 0.5).abs() < 1e-14));
    assert!((wall.plane.normal().unwrap() - DVec3::X).length() < 1e-14);
    for (group, strip) in [("table", 0.0), ("q6", 0.5)] {
        let error = above(group, 0.0, &GridSettings { strip, ..METRES }).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Setting, "{error}");
    }
}
