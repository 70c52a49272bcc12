//! What measuring grids measure, against closed forms and paths.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::GatheredMesh;
use radiosity::grid::{GridPlane, GridSettings, MeasuredGrid, MeasuringGrid, Quantity};
use radiosity::{Backend, Material, Mesh, Rgb, Scene};

use crate::common::scenes::{block, facing_down, facing_up, grey, lamp, walls};
use crate::common::{keep_counting, quads};

const METRES: GridSettings = GridSettings { metre: 1.0, strip: 0.0, spacing: None };

/// What a plane at height 1 over the origin measures of what `scene` emits.
fn measured(scene: Scene) -> MeasuredGrid {
    let mesh = Mesh::new(scene, 10.0).unwrap();
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let plane = GridPlane { origin: DVec3::Z, edges: [DVec3::X * 3.0, DVec3::Y * 2.0] };
    let grid = MeasuringGrid::on_plane("plane", plane, &METRES).unwrap();
    let mut gatherer = Backend::Cpu.gather_to_noise(&light, 0.05).unwrap();
    grid.measure(&light, &mut *gatherer, keep_counting).unwrap().unwrap()
}

#[test]
fn uniform_sky_gives_pi_times_its_radiance_everywhere() {
    let ground = quads(&[(facing_up([-9.0, 9.0], [-9.0, 9.0], 0.0), grey())]);
    let found = measured(ground.with_sky(Rgb::new(1.0, 2.0, 0.5)).unwrap());
    let want = PI * (0.2126 + 2.0 * 0.7152 + 0.5 * 0.0722);
    let lux = found.statistics(Quantity::Illuminance).unwrap();
    assert_eq!(lux.points, found.grid.points.len());
    // Sums of a hundred equal rays.
    for value in [lux.mean, lux.minimum, lux.maximum] {
        assert!((value / want - 1.0).abs() < 1e-12, "{lux:?} {want}");
    }
    assert!((lux.uniformity - 1.0).abs() < 1e-12 && lux.mean_error < 1e-12);
    let watts = found.statistics(Quantity::Irradiance).unwrap();
    assert!((watts.mean / (PI * 3.5 / 3.0) - 1.0).abs() < 1e-12);
}

#[test]
fn lamp_gives_its_closed_form_at_each_point() {
    let quad = facing_down([0.5, 1.5], [0.5, 1.0], 3.0);
    let found = measured(quads(&[(quad, lamp([300.0 * PI; 3]))]));
    let corners = quad.map(DVec3::from_array);
    let truth: Vec<f64> = (found.grid.points.iter().flatten())
        .map(|&p| 300.0 * PI * point_to_polygon(p, DVec3::Z, &corners))
        .collect();
    assert_eq!(found.measured(Quantity::Illuminance).count(), truth.len());
    for (value, truth) in found.measured(Quantity::Illuminance).zip(&truth) {
        // Points lie up to 1.7e-3 of a cell higher: 2 m below the lamp, 6e-4 at most.
        assert!((value.unwrap()[0] / truth - 1.0).abs() < 1e-3, "{value:?} {truth}");
    }
    let told = found.statistics(Quantity::Illuminance).unwrap();
    let mean = truth.iter().sum::<f64>() / truth.len() as f64;
    let least = truth.iter().copied().fold(f64::INFINITY, f64::min);
    let most = truth.iter().copied().fold(0.0, f64::max);
    for (value, truth) in [
        (told.mean, mean),
        (told.minimum, least),
        (told.maximum, most),
        (told.uniformity, least / mean),
    ] {
        assert!((value / truth - 1.0).abs() < 1e-3, "{told:?}");
    }
    assert!(told.mean_error < 1e-3 * mean);
}

#[test]
fn points_in_solids_do_not_count() {
    let mut parts = vec![(facing_down([0.5, 1.5], [0.5, 1.0], 3.0), lamp([1.0; 3]))];
    parts.extend(block([0.0, 0.0, 0.5], [1.0, 2.0, 1.5]).map(|side| (side, grey())));
    let found = measured(quads(&parts));
    let statistics = found.statistics(Quantity::Irradiance).unwrap();
    let outside = |p: &&DVec3| p.x > 1.0;
    let count = found.grid.points.iter().flatten().filter(outside).count();
    assert!(count > 10 && statistics.points == count, "{statistics:?}");
    assert!(statistics.minimum > 0.0);
}

/// A cube whose walls emit 1 and reflect half: irradiance is 2 everywhere. The light that is given
/// lacks a fifth of what is reflected, and up to three times as much at one end: paths bring values
/// to 2, and errors are as large as stated.
#[test]
fn paths_correct_light_that_is_wrong() {
    let shiny = Material { exitance: Rgb::ONE, ..Material::grey("shiny", 0.5) };
    let scene = quads(&walls([0.0; 3], [1.0; 3]).map(|wall| (wall, shiny.clone())));
    let mesh = Mesh::new(scene, 0.2).unwrap();
    let plane =
        GridPlane { origin: DVec3::new(0.1, 0.1, 0.4), edges: [DVec3::X * 0.8, DVec3::Y * 0.8] };
    let settings = GridSettings { spacing: Some(0.09), ..METRES };
    let grid = MeasuringGrid::on_plane("plane", plane, &settings).unwrap();
    for (slope, error) in [(0.0, 0.05), (0.4, 0.05), (0.4, 0.02)] {
        let reflected = |e: usize| 0.8 - slope * mesh.centroid(mesh.element(e)).x;
        let radiosity: Vec<Rgb> =
            (0..mesh.element_count()).map(|e| Rgb::splat(1.0 + reflected(e))).collect();
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        let mut gatherer = Backend::Cpu.gather_to_noise(&light, 0.01).unwrap();
        let mut found = grid.measure(&light, &mut *gatherer, keep_counting).unwrap().unwrap();
        let before = found.statistics(Quantity::Irradiance).unwrap();
        assert!((before.mean - 2.0 + 0.2 + slope / 2.0).abs() < 0.05, "{before:?}");
        let correction = found.correct(&light, error, keep_counting).unwrap().unwrap();
        assert!(correction.is_reached && correction.correction > 0.05, "{correction:?}");
        let (mut squares, mut stated, mut within) = (0.0, 0.0, 0);
        for [value, deviation] in found.measured(Quantity::Irradiance).flatten() {
            squares += (value - 2.0).powi(2);
            stated += deviation * deviation;
            within += usize::from((value - 2.0).abs() <= error * 2.0);
            assert!(deviation <= 0.5 * error * 2.0 && (value - 2.0).abs() < 5.0 * deviation);
        }
        // Stated a little too large, by the uncertainty of the spread.
        let ratio = (squares / stated).sqrt();
        assert!(ratio > 0.3 && ratio < 1.2, "{slope} {error}: {ratio}");
        assert!(within as f64 >= 0.95 * grid.points.len() as f64, "{within}");
        let after = found.statistics(Quantity::Irradiance).unwrap();
        assert!((after.mean - 2.0).abs() < 4.0 * after.mean_error, "{after:?}");
        assert!(after.mean_error < 0.3 * error * 2.0, "{after:?}");
    }
}
