use std::sync::Arc;

use super::*;
use crate::accuracy::hidden::LitRegion;
use crate::mesh::Mesh;
use crate::scene::{Material, Triangle};
use crate::verify::octaves_of;

/// A ground from -1000 to 1000 in two triangles, and a cube of 48 on it at the origin; all grey.
fn wide_ground() -> Scene {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let mut positions: Vec<DVec3> =
        corners.iter().map(|[x, y]| DVec3::new(1000.0 * x, 1000.0 * y, 0.0)).collect();
    let mut faces = vec![[0, 1, 2], [0, 2, 3]];
    for side in 0..24 {
        let height = 0.04 * f64::from(side) + 0.01;
        let first = positions.len() as u32;
        positions.extend(corners.map(|[x, y]| DVec3::new(0.5 * x, 0.5 * y, height)));
        faces.extend([[0, 1, 2], [0, 2, 3]].map(|face: [u32; 3]| face.map(|k| k + first)));
    }
    let triangles = (0..).zip(faces).map(|(k, corners)| Triangle {
        corners,
        group: u32::from(k >= 2),
        ..Default::default()
    });
    let names = vec!["ground".into(), "cube".into()];
    let bright = Material { exitance: Rgb::ONE, ..Material::grey("bright", 0.5) };
    Scene::new(positions, triangles.collect(), names, vec![bright]).unwrap()
}

/// Points that samples are asked for.
const POINTS: usize = 4096;

/// The samples on the ground that an estimate of `light` by these residuals takes, where errors are
/// relative to no less than `floor`.
fn samples_on_ground(light: &GatheredMesh, element_residual: &[f64], floor: f64) -> Vec<Sample> {
    let estimator = ErrorEstimator {
        light,
        lit_by: None,
        element_residual,
        ledger: &Ledger::default(),
        bounces: 0.0,
        measure: Measure::default(),
        region: LitRegion { bounds: None, diagonal: 1.0 },
        octaves: &octaves_of(light.mesh.scene()),
        expected_floor: 0.0,
        paths: None,
    };
    let counts = SampleCounts { total: POINTS, per_group: 8 };
    let (strata, samples) = estimator.samples(counts, floor);
    samples.into_iter().filter(|sample| strata[sample.stratum].group == Some(0)).collect()
}

#[test]
fn points_lie_in_every_octave_of_a_wide_ground() {
    let mesh = Mesh::new(Arc::new(wide_ground()), f64::INFINITY).unwrap();
    let radiosity = vec![Rgb::splat(2.0); mesh.element_count()];
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let ground = samples_on_ground(&light, &[], 1.0);
    assert!(ground.len() >= POINTS * 99 / 100);
    for half in [10.0, 100.0, 1000.0f64] {
        let within =
            |sample: &&Sample| sample.point.point.position.truncate().abs().max_element() <= half;
        let share: f64 = ground.iter().filter(within).map(|sample| sample.weight).sum();
        let count = ground.iter().filter(within).count();
        // Half of the points are in ten octaves, of which the smallest has three; an even spread
        // has one point in 10 000 there. They stand for the area that they are spread over, known
        // by as many of them.
        assert!(count as f64 > 0.1 * POINTS as f64, "{half}: {count}");
        let area = (half / 1000.0).powi(2);
        assert!((share / area - 1.0).abs() < 0.2, "{half}: {share}, not {area}");
    }
}

#[test]
fn points_go_where_light_may_jump() {
    // One half of the ground is lit, the other not; corners on the diagonal have the mean.
    let mesh = Mesh::new(Arc::new(wide_ground()), f64::INFINITY).unwrap();
    let mut radiosity = vec![Rgb::ONE; mesh.element_count()];
    radiosity[0] += 2.0;
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let lengths = |e: usize| light.corners[e].map(|v| light.reflected[v as usize].length());
    let share_of_dark = |element_residual: &[f64]| {
        let ground = samples_on_ground(&light, element_residual, 0.5);
        let dark = ground.iter().filter(|sample| sample.element == 1).count();
        dark as f64 / ground.len() as f64
    };
    let expected = |e: usize| {
        let [a, b, c] = lengths(e);
        let (least, most) = (a.min(b).min(c), a.max(b).max(c));
        RMS_OVER_JUMP * (most - least) / least.max(0.5)
    };
    let by_jumps = expected(1) / (expected(0) + expected(1));
    assert!(by_jumps > 0.6, "{by_jumps}");
    // Half of the points are spread evenly. They are not random: one in a hundred is off at most.
    let found = share_of_dark(&vec![0.0; mesh.element_count()]);
    assert!((found - (0.25 + by_jumps / 2.0)).abs() < 0.01, "{found}, {by_jumps}");
    // Residuals above the jumps count in their place, relative to the darkest corner.
    let same = share_of_dark(&vec![1e3; mesh.element_count()]);
    let [dark, bright] =
        [1, 0].map(|e| 1.0 / lengths(e).into_iter().fold(f64::INFINITY, f64::min).max(0.5));
    assert!((same - (0.25 + 0.5 * dark / (dark + bright))).abs() < 0.01, "{same}");
    // Before anything was gathered nothing is known of jumps.
    assert!((share_of_dark(&[]) - 0.5).abs() < 0.01);
}
