//! Path-traced radiosity against closed forms. Every comparison is within four standard errors of
//! the paths, or exact.

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::verify::{PathTracer, Reflected};
use radiosity::{Material, Rgb, Scene};

use crate::common::keep_counting;
use crate::common::scenes::{Quad, facing_down, facing_up, lamp, paint, quads, walls};

/// What `scene` reflects at a point, from `paths` paths.
fn reflected(scene: &Scene, position: [f64; 3], normal: DVec3, paths: usize) -> Reflected {
    let tracer = PathTracer::new(scene);
    let point = tracer.locate(position.into(), normal).expect("a point of the scene");
    tracer.reflected(&[point], paths, 7, keep_counting)[0]
}

/// `found` is `truth`, within four standard errors that are below `share` of it.
fn check(found: Reflected, truth: Rgb, share: f64) {
    let Reflected { radiosity, standard_error } = found;
    for c in 0..3 {
        assert!(standard_error[c] < share * truth[c], "{found:?}, not {truth}");
        let off = (radiosity[c] - truth[c]).abs();
        // The smallest lamp sends 7e-9 of its light along rays that no path here happens to find.
        assert!(off < 4.0 * standard_error[c] + 1e-8 * truth[c], "{found:?}, not {truth}");
    }
}

/// View factor from a point to a rectangle of `a` by `b` at distance `c`, parallel to its surface,
/// with a corner right above it (Howell's catalogue, B-4).
fn from_point_below_corner(a: f64, b: f64, c: f64) -> f64 {
    let half = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    (half(a / c, b / c) + half(b / c, a / c)) / std::f64::consts::TAU
}

#[test]
fn furnaces_have_their_closed_form() {
    // B = E / (1 − ρ), of which E is emitted. The last needs a hundred bounces, and more.
    for rho in [Rgb::new(0.2, 0.5, 0.8), Rgb::new(0.9, 0.95, 0.99)] {
        let wall = Material { reflectance: rho, ..paint(0.0, 1.0) };
        let scene = quads(&walls([0.0; 3], [1.0; 3]).map(|w| (w, wall.clone())));
        for place in [[0.3, 0.6, 0.0], [0.001, 0.999, 0.0]] {
            let found = reflected(&scene, place, DVec3::Z, 40_000);
            check(found, rho / (Rgb::ONE - rho), 0.01);
        }
    }
}

#[test]
fn paths_are_the_same_in_another_unit() {
    // Square lamps, whose sides and halves are equal but for rounding.
    let found = |unit: f64| {
        let tile = |k: u32| {
            let at = 0.3 * f64::from(k) + 0.1;
            (facing_down([at, at + 0.2], [0.4, 0.6], 0.7), lamp([3.0, 2.0, 1.0]))
        };
        let mut all = (0..4).map(tile).collect::<Vec<_>>();
        all.push((facing_up([0.0, 2.0], [0.0, 2.0], 0.0), paint(0.6, 0.0)));
        let scale = |(corners, material): &(Quad, Material)| {
            (corners.map(|p| p.map(|x| x * unit)), material.clone())
        };
        let scene = quads(&all.iter().map(scale).collect::<Vec<_>>());
        reflected(&scene, [0.9 * unit, 0.4 * unit, 0.0], DVec3::Z, 300).radiosity
    };
    let one = found(1.0);
    for unit in [1e-9, 1e-4, 1e5, 1e9] {
        // Rounding of coordinates, over some sums.
        assert!(found(unit).abs_diff_eq(one, 1e-9 * one.x), "{unit}: {} {one}", found(unit));
    }
}

#[test]
fn lamps_of_any_size_have_their_view_factor() {
    for size in [1e-4, 0.1, 3.0, 1e4] {
        let light = facing_down([0.0, size], [0.0, size], 0.7);
        let floor = facing_up([-0.1, 0.1], [-0.1, 0.1], 0.0);
        let scene = quads(&[(floor, paint(0.6, 0.0)), (light, lamp([3.0, 2.0, 1.0]))]);
        let truth = 0.6 * from_point_below_corner(size, size, 0.7) * Rgb::new(3.0, 2.0, 1.0);
        check(reflected(&scene, [0.0; 3], DVec3::Z, 20_000), truth, 0.02);
    }
}

#[test]
fn what_stands_between_casts_a_shadow() {
    // The plate hides just the half of the lamp that is at x > 0. What is behind the light, or
    // black, changes nothing.
    let scene = quads(&[
        (facing_up([-0.1, 0.1], [-0.1, 0.1], 0.0), paint(0.5, 0.0)),
        (facing_down([-1.0, 1.0], [-1.0, 1.0], 2.0), lamp([1.0; 3])),
        (facing_down([0.0, 5.0], [-5.0, 5.0], 1.0), paint(0.0, 0.0)),
        (facing_up([-5.0, 5.0], [-5.0, 5.0], 3.0), paint(0.9, 0.0)),
    ]);
    let truth = 0.5 * 2.0 * from_point_below_corner(1.0, 1.0, 2.0);
    check(reflected(&scene, [0.0; 3], DVec3::Z, 40_000), Rgb::splat(truth), 0.02);
}

#[test]
fn plates_exchange_light_by_their_series() {
    // Plates a thousand times wider than apart: what leaves at the edges is far below the noise.
    let scene = quads(&[
        (facing_up([-1.0, 1.0], [-1.0, 1.0], 0.0), paint(0.5, 1.0)),
        (facing_down([-1.0, 1.0], [-1.0, 1.0], 0.002), paint(0.8, 0.0)),
    ]);
    let lower = reflected(&scene, [0.0; 3], DVec3::Z, 40_000);
    check(lower, Rgb::splat(0.5 * 0.8 / (1.0 - 0.4)), 0.01);
    let upper = reflected(&scene, [0.0, 0.0, 0.002], -DVec3::Z, 40_000);
    check(upper, Rgb::splat(0.8 / (1.0 - 0.4)), 0.01);
}

#[test]
fn thin_plates_are_tight() {
    // A plate of two faces, 1e-5 of the scene apart, between a lamp and all that is below.
    let wide = [-500.0, 500.0];
    let scene = quads(&[
        (facing_down([-1.0, 1.0], [-1.0, 1.0], 5.0), lamp([1.0; 3])),
        (facing_up(wide, wide, 1.01), paint(0.9, 0.0)),
        (facing_down(wide, wide, 1.0), paint(0.9, 0.0)),
        (facing_up([-2.0, 2.0], [-2.0, 2.0], 0.0), paint(0.9, 0.0)),
    ]);
    let dark = [([0.3, 0.2, 0.0], DVec3::Z), ([0.3, 0.2, 1.0], -DVec3::Z)];
    for (place, normal) in dark {
        assert_eq!(reflected(&scene, place, normal, 20_000), Reflected::default());
    }
    assert!(reflected(&scene, [0.3, 0.2, 1.01], DVec3::Z, 100).radiosity.x > 0.0);
}

#[test]
fn faces_back_to_back_in_one_place_are_both_fronts() {
    let light: (Quad, _) = (facing_up([0.0, 1.0], [0.0, 1.0], 0.0), paint(0.5, 1.0));
    let lower = (facing_down([0.0, 2.0], [0.0, 1.0], 1.0), paint(0.7, 0.0));
    let upper = (facing_up([0.0, 2.0], [0.0, 1.0], 1.0), paint(0.3, 0.0));
    let floor = (facing_up([1.0, 2.0], [0.0, 1.0], 0.0), paint(0.5, 0.0));
    let at = |scene: &Scene| reflected(scene, [1.5, 0.5, 0.0], DVec3::Z, 2000).radiosity;
    let one = at(&quads(&[light.clone(), lower.clone(), floor.clone()]));
    // The upper face comes first, and would win a tie by its number.
    let two = at(&quads(&[upper, light, lower, floor]));
    assert!(one.x > 0.01 && (two - one).length() < 1e-9, "{one} {two}");
}

#[test]
fn seeds_not_threads_make_the_numbers() {
    let scene = quads(&walls([0.0; 3], [1.0; 3]).map(|w| (w, paint(0.5, 1.0))));
    let tracer = PathTracer::new(&scene);
    let point = |k: u32| {
        let place = DVec3::new(0.1 + 0.02 * f64::from(k), 0.4, 0.0);
        tracer.locate(place, DVec3::Z).unwrap()
    };
    let points: Vec<_> = (0..40).map(point).collect();
    let trace = |threads: usize, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| tracer.reflected(&points, 50, seed, keep_counting))
    };
    assert_eq!(trace(1, 3), trace(3, 3));
    assert_ne!(trace(1, 3), trace(1, 4));
    // A break leaves the rest out.
    let stopped = tracer.reflected(&points, 50, 3, |_, _| ControlFlow::Break(()));
    assert!(stopped.len() < 40 && stopped[..] == trace(1, 3)[..stopped.len()]);
}

#[test]
fn points_are_found_on_the_side_that_their_normal_says() {
    let scene = quads(&[
        (facing_up([0.0, 5.0], [0.0, 5.0], 0.0001), paint(0.5, 1.0)),
        (facing_down([0.0, 5.0], [0.0, 5.0], 0.0), paint(0.5, 0.0)),
    ]);
    let tracer = PathTracer::new(&scene);
    let group = |z: f64, normal| {
        let point = tracer.locate(DVec3::new(1.0, 2.0, z), normal)?;
        Some(scene.triangles()[point.triangle].group)
    };
    assert_eq!(group(0.00005, DVec3::Z), Some(0));
    assert_eq!(group(0.00005, -DVec3::Z), Some(1));
    assert_eq!(group(0.1, DVec3::Z), None);
    assert_eq!(group(0.0, DVec3::X), None);
}
