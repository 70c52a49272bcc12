//! Sums, reciprocity, leaks and the enforcement of both.

use radiosity::view_factor::Factor;
use radiosity::{Material, Scene};

use crate::common::scenes::grey;
use crate::common::view_factors::{exact_view_factors, square};
use crate::common::{cube, quads};

#[test]
fn enforcement_keeps_open_scene_open() {
    let plates = [(square(0.5, 0.0, true), grey()), (square(1.0, 0.5, false), grey())];
    let mut m = exact_view_factors(&quads(&plates), 1e-3);
    let raw = m.clone();
    // As if measured apart, and a little off.
    m.factors[0] = vec![Factor { to: 1, value: m.factor(0, 1).value + 1e-3, error: 1e-3 }];
    let (out, correction) = m.enforced();
    assert_eq!(correction.closed_rows, 0);
    assert!(out.checks().reciprocity.max < 1e-15);
    assert!((out.factor(0, 1).value - raw.factor(0, 1).value).abs() < 1e-3);
    for i in 0..2 {
        let total: f64 = out.factors[i].iter().map(|f| f.value).sum::<f64>() + out.open[i].value;
        assert!((total - 1.0).abs() < 1e-12 && out.open[i].value > 0.1, "{total}");
    }
}

#[test]
fn leak_is_found() {
    let closed = exact_view_factors(&cube(&grey()), 1e-4);
    assert!(closed.open_rows().is_empty());
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
    let leaky = exact_view_factors(&scene, 1e-4);
    assert_eq!(leaky.open_rows().len(), 6);
    assert!(leaky.open[leaky.open_rows()[0]].value > 1e-4);
}

#[test]
fn coplanar_overlap_is_found() {
    let poster = [[0.3, 0.3, 0.], [0.7, 0.3, 0.], [0.7, 0.7, 0.], [0.3, 0.7, 0.]];
    let room = cube(&grey());
    let mut walls: Vec<([[f64; 3]; 4], Material)> = (0..6)
        .map(|k| ([0, 1, 2, 3].map(|c| room.positions()[4 * k + c].to_array()), grey()))
        .collect();
    walls.push((poster, grey()));
    let twice = exact_view_factors(&quads(&walls), 1e-4);
    // The ceiling sees the poster's part of the floor a second time.
    assert_eq!(twice.rows_over_unity().first(), Some(&5));
    let checks = twice.checks();
    assert!(checks.closure.max > 0.03);
    // All sums that are not 1 are above it.
    assert_eq!((checks.row_sums.max, checks.row_sums.at), (checks.closure.max, (5, 5)));
    let room = exact_view_factors(&room, 1e-4);
    assert!(room.rows_over_unity().is_empty() && room.checks().row_sums.max < 1e-12);
    // Lifted off the wall by a millionth, it hides what is behind it.
    walls[6].0.iter_mut().for_each(|p| p[2] = 1e-6);
    let lifted = exact_view_factors(&quads(&walls), 1e-4);
    assert!(lifted.rows_over_unity().is_empty() && lifted.checks().closure.max < 1e-5);
    assert!((lifted.back[4].value - 0.16).abs() < 1e-5, "{:?}", lifted.back[4]);
}
