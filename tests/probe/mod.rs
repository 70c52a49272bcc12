//! Probes: harmonics of known light, what is inside, grids.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::gather::{GatherPoint, irradiance_at};
use radiosity::probe::{Probe, ProbeGrid, correct_probes, probes_at};
use radiosity::scene::Aabb;
use radiosity::{Backend, BakeSettings, ErrorKind, GatheredMesh, Mesh, Rgb, Scene};

use crate::common::scenes::{block, facing_up, grey, paint};
use crate::common::{cube, keep_counting, keep_going, quads};

/// The light of a scene whose elements all have this radiosity, W/m².
fn even_light(scene: Scene, radiosity: f64) -> GatheredMesh {
    let mesh = Mesh::new(scene, 10.0).unwrap();
    GatheredMesh::from_elements(&mesh, &vec![Rgb::splat(radiosity); mesh.element_count()]).unwrap()
}

fn probes(light: &GatheredMesh, noise: f64, positions: &[DVec3]) -> Vec<Probe> {
    let mut gatherer = Backend::Cpu.gather_to_noise(light, noise).unwrap();
    probes_at(light, positions, 0.1, &mut *gatherer, keep_counting).unwrap().unwrap()
}

/// In a closed cube, reflectance 0.5 and exitance 1 everywhere: B = 1 / (1 − 0.5).
#[test]
fn furnace_has_constant_harmonics() {
    // All of it as if reflected, which rays find alike; and the half that is emitted from points on
    // the walls, which is noisy.
    for (exitance, noise, tolerance) in [(0.0, 0.1, 1e-12), (1.0, 0.02, 0.02)] {
        let light = even_light(cube(&paint(0.5, exitance)), 2.0);
        for probe in probes(&light, noise, &[DVec3::splat(0.5), DVec3::new(0.1, 0.2, 0.95)]) {
            let [constant, others @ ..] = probe.irradiance.coefficients;
            // ∫ E Y_00 dω = 2 · √(4π).
            let want = 2.0 * (4.0 * PI).sqrt();
            assert!((constant / want - 1.0).length() < tolerance, "{probe:?}");
            assert!(others.iter().all(|c| c.length() < tolerance * want), "{probe:?}");
            assert!((probe.irradiance.at(DVec3::Z) / 2.0 - 1.0).length() < 2.0 * tolerance);
            let radiance = probe.irradiance.radiance_of_irradiance();
            assert!((radiance.at(DVec3::X) * PI / 2.0 - 1.0).length() < 4.0 * tolerance);
            assert!(!probe.is_inside() && probe.escaped == 0.0);
            assert!(probe.deviation < 2.0 * tolerance, "{}", probe.deviation);
        }
    }
}

/// A cube whose walls emit 1 and reflect half, in light that lacks 0.3 of the reflected radiosity
/// of 1 at one end and nothing at the other: by paths, irradiance is 2 whatever the normal, to the
/// error that is stated.
#[test]
fn paths_correct_probes_in_light_that_is_wrong() {
    let mesh = Mesh::new(cube(&paint(0.5, 1.0)), 0.2).unwrap();
    let told = |e: usize| Rgb::splat(1.7 + 0.3 * mesh.centroid(mesh.element(e)).x);
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(told).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let positions: Vec<DVec3> = (0..64)
        .map(|k| DVec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)))
        .collect();
    let positions: Vec<DVec3> = positions.iter().map(|p| 0.2 + 0.2 * p).collect();
    let mut found = probes(&light, 0.01, &positions);
    let error = 0.02;
    let correct = correct_probes(&light, &mut found, 0.1, error, keep_counting).unwrap().unwrap();
    assert!(correct.is_reached && correct.correction > 0.05, "{correct:?}");
    let (mut squares, mut stated) = (0.0, 0.0);
    for probe in &found {
        let [constant, others @ ..] = probe.irradiance.coefficients;
        // The constant 2, a length over the channels; the mean over the sphere is that over 4π.
        let off = (constant - 2.0 * (4.0 * PI).sqrt()).length_squared();
        let off = (off + others.iter().map(|c| c.length_squared()).sum::<f64>()) / (4.0 * PI);
        assert!(off.sqrt() < error * 2.0 * 3f64.sqrt(), "{probe:?}");
        squares += off;
        stated += probe.deviation.powi(2);
    }
    // `deviation` has the noise of gathers once more than it is in the coefficients.
    let ratio = (squares / stated).sqrt();
    assert!(ratio > 0.3 && ratio < 1.1, "{ratio}");
}

#[test]
fn sphere_is_lit_as_by_gathering_at_its_points() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let scene = radiosity::load_scene(path).unwrap();
    let settings = BakeSettings::elements_only(&scene);
    let light = settings.bake(scene, &Backend::Cpu, keep_going).unwrap().light;
    let positions = [DVec3::new(278.0, 273.0, 100.0), DVec3::new(120.0, 420.0, 300.0)];
    for probe in probes(&light, 0.05, &positions) {
        let normals: Vec<DVec3> = (0..200)
            .map(|k| {
                let (z, turn) = (1.0 - (f64::from(k) + 0.5) / 100.0, 2.4 * f64::from(k));
                let radius = (1.0 - z * z).sqrt();
                DVec3::new(radius * turn.cos(), radius * turn.sin(), z)
            })
            .collect();
        let at = |&n: &DVec3| GatherPoint { position: probe.position, normal: n, near: 1e-3 };
        let points: Vec<GatherPoint> = normals.iter().map(at).collect();
        let mut gatherer = Backend::Cpu.gather_to_noise(&light, 0.005).unwrap();
        let truth = irradiance_at(&light, &points, &mut *gatherer, keep_counting).unwrap().unwrap();
        let brightest = truth.iter().map(|t| t.irradiance.length()).fold(0.0, f64::max);
        let off: Vec<f64> = normals
            .iter()
            .zip(&truth)
            .map(|(&n, truth)| probe.irradiance.at(n).distance(truth.irradiance) / brightest)
            .collect();
        let mean_square = off.iter().map(|x| x * x).sum::<f64>() / 200.0;
        let most = off.iter().copied().fold(0.0, f64::max);
        println!("off by {:.4}, {most:.4} at most", mean_square.sqrt());
        // Were all light from one direction, order 4 would be 9 Â_4 / 4π = 9.4 % of the brightest,
        // a third of that root mean square (P_4 is 1/3 so): 3.1 %. Noise is less than 2 %.
        assert!(most < 0.094 && mean_square.sqrt() < 0.04, "{most} {mean_square}");
        // The probe tells it by 26 directions, between which it is off by other amounts.
        let told = probe.deviation / brightest / mean_square.sqrt();
        println!("told {told:.2} of that");
        assert!((0.5..2.0).contains(&told), "{told}");
    }
}

#[test]
fn probes_in_solids_are_marked() {
    let mut parts: Vec<_> =
        block([0.0, 0.0, 0.1], [1.0, 1.0, 1.1]).map(|side| (side, grey())).into();
    parts.push((facing_up([-3.0, 3.0], [-3.0, 3.0], 0.0), grey()));
    let light = even_light(quads(&parts), 1.0);
    let places = [DVec3::new(0.4, 0.5, 0.6), DVec3::new(1.5, 0.5, 0.6), DVec3::new(0.4, 0.5, -0.5)];
    let found = probes(&light, 0.1, &places);
    assert!(found[0].is_inside() && found[0].backface > 0.99, "{:?}", found[0]);
    assert!(!found[1].is_inside() && found[1].escaped > 0.3, "{:?}", found[1]);
    // Below the ground half of what is seen are backs, or nearly so.
    assert!((0.3..0.5).contains(&found[2].backface), "{:?}", found[2]);
}

#[test]
fn probes_do_not_depend_on_their_order_or_threads() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let light = even_light(radiosity::load_scene(path).unwrap(), 30.0);
    let at = |k: u32| DVec3::new(5.0 * f64::from(k), 200.0, 100.0);
    let places: Vec<DVec3> = (1..50).map(at).collect();
    let all = probes(&light, 0.1, &places);
    let reversed: Vec<DVec3> = places.iter().rev().copied().collect();
    let mut again = probes(&light, 0.1, &reversed);
    again.reverse();
    assert_eq!(all, again);
    assert_eq!(all[7], probes(&light, 0.1, &places[7..8])[0]);
}

#[test]
fn grids_of_probes_fill_their_box() {
    let bounds = Aabb { low: DVec3::new(1.0, 2.0, 3.0), high: DVec3::new(5.0, 4.0, 4.0) };
    let grid = ProbeGrid::with_spacing(&bounds, 1.0).unwrap();
    assert_eq!((grid.counts, grid.spacing, grid.size()), ([4, 2, 1], DVec3::ONE, 1.0));
    let positions = grid.positions();
    assert_eq!(positions.len(), 8);
    assert_eq!(positions[0], DVec3::new(1.5, 2.5, 3.5));
    assert_eq!(positions[5], DVec3::new(2.5, 3.5, 3.5));
    let coarse = ProbeGrid::with_counts(&bounds, [2, 1, 1]).unwrap();
    assert_eq!((coarse.spacing, coarse.size()), (DVec3::new(2.0, 2.0, 1.0), 1.0));
    let flat = Aabb { high: DVec3::new(5.0, 4.0, 3.0), ..bounds };
    assert_eq!(ProbeGrid::with_spacing(&flat, 2.0).unwrap().counts, [2, 1, 1]);
    let endless = Aabb { high: DVec3::INFINITY, ..bounds };
    let refused = [
        ProbeGrid::with_counts(&bounds, [1, 0, 1]),
        ProbeGrid::with_counts(&bounds, [1000; 3]),
        ProbeGrid::with_counts(&endless, [1; 3]),
        ProbeGrid::with_spacing(&bounds, 0.0),
        ProbeGrid::with_spacing(&bounds, 1e-300),
    ];
    for refused in refused {
        assert_eq!(refused.unwrap_err().kind(), ErrorKind::Setting);
    }
}

#[test]
fn stopping_gives_nothing_and_wrong_probes_are_refused() {
    let light = even_light(quads(&[(facing_up([0.0, 1.0], [0.0, 1.0], 0.0), grey())]), 1.0);
    let mut gatherer = Backend::Cpu.gather_to_noise(&light, 0.1).unwrap();
    let stop = |_, _| ControlFlow::Break(());
    let stopped = probes_at(&light, &[DVec3::ONE], 0.1, &mut *gatherer, stop);
    assert!(stopped.unwrap().is_none());
    for (position, size) in [(DVec3::NAN, 0.1), (DVec3::ONE, 0.0), (DVec3::ONE, f64::NAN)] {
        let refused = probes_at(&light, &[position], size, &mut *gatherer, keep_counting);
        assert_eq!(refused.unwrap_err().kind(), ErrorKind::Setting);
    }
}
