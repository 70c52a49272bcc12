//! Distributions of intensity against closed forms, and what a luminaire may be.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use radiosity::scene::{IntensityDistribution, Luminaire, Opening, Pole};
use radiosity::{ErrorKind, Rgb};

use crate::common::cube;
use crate::common::scenes::grey;

/// Angles from `from` to `to` in `steps` steps, degrees.
fn angles(from: f64, to: f64, steps: usize) -> Vec<f64> {
    (0..=steps).map(|k| from + (to - from) * k as f64 / steps as f64).collect()
}

/// The same all around the aim, by the angle from it in radians, up to `end` degrees.
fn symmetric(end: f64, steps: usize, f: impl Fn(f64) -> f64) -> IntensityDistribution {
    let polar = angles(0.0, end, steps);
    let values = polar.iter().map(|a| f(a.to_radians())).collect();
    IntensityDistribution::new(&[0.0], &polar, values).unwrap()
}

#[test]
fn flux_is_that_of_closed_forms() {
    let close = |found: f64, truth: f64, share: f64| {
        assert!((found / truth - 1.0).abs() < share, "{found} {truth}");
    };
    // Sums of some hundred terms, rounded once each.
    const ROUNDING: f64 = 1e-13;
    close(IntensityDistribution::isotropic(7.0).unwrap().flux(), 28.0 * PI, ROUNDING);
    close(symmetric(180.0, 37, |_| 7.0).flux(), 28.0 * PI, ROUNDING);
    // Linear in γ: 2π ∫ (1 − 2γ/π) sin γ dγ over a hemisphere.
    close(
        symmetric(90.0, 13, |a| 1.0 - a / FRAC_PI_2).flux(),
        2.0 * PI * (1.0 - 2.0 / PI),
        ROUNDING,
    );
    // Chords of cosⁿ γ are off by Δ²/8 times its second derivative, n at most: as a share of the
    // flux 2π/(n + 1), over a hemisphere.
    for n in [1, 2, 8, 40] {
        let step = 1f64.to_radians();
        let f64_n = f64::from(n);
        let found = symmetric(90.0, 90, |a| a.cos().powi(n)).flux();
        close(found, 2.0 * PI / (f64_n + 1.0), step * step / 8.0 * f64_n * (f64_n + 1.0));
    }
    // By azimuth: the mean of 1 + cos C at even steps is 1.
    let (azimuths, polar) = (angles(0.0, 360.0, 24), angles(0.0, 180.0, 4));
    let value = |azimuth: &f64| vec![1.0 + azimuth.to_radians().cos(); 5];
    let values = azimuths.iter().flat_map(value).collect();
    let uneven = IntensityDistribution::new(&azimuths, &polar, values).unwrap();
    close(uneven.flux(), 4.0 * PI, ROUNDING);
    // Around any pole; half of a turn is a hemisphere.
    let half = IntensityDistribution::new(&angles(-90.0, 90.0, 6), &polar, vec![3.0; 35]).unwrap();
    close(half.around(Pole::C0).flux(), 6.0 * PI, ROUNDING);
}

#[test]
fn angles_turn_around_their_pole() {
    // Values that tell the angles: 100 for each azimuth of 45°, and one for each polar of 45°.
    let (azimuths, polar) = (angles(-90.0, 90.0, 4), angles(0.0, 180.0, 4));
    let value = |k: usize| (0..5).map(move |row| (100 * k + row) as f64);
    let values: Vec<f64> = (0..5).flat_map(value).collect();
    let measured = IntensityDistribution::new(&azimuths, &polar, values).unwrap();
    let [c0, c90, aim] = [DVec3::X, DVec3::Y, DVec3::Z];
    // At azimuth 0°, the third, and at right angles to the pole; at 45° towards the second axis
    // and from the pole; a third of the way from one azimuth to the next; behind.
    let third = 15f64.to_radians();
    for (pole, axis, first, second) in
        [(Pole::Aim, aim, c0, c90), (Pole::C0, c0, aim, c90), (Pole::C90, c90, aim, c0)]
    {
        let measured = measured.clone().around(pole);
        let slanted = (first + second).normalize();
        let between = third.cos() * first + third.sin() * second;
        for (direction, intensity) in [
            (first, 202.0),
            (slanted, 302.0),
            ((slanted + axis).normalize(), 301.0),
            (between, 202.0 + 100.0 / 3.0),
            (-second, 2.0),
            (-first, 0.0),
        ] {
            let found = measured.along(direction);
            assert!((found - intensity).abs() < 1e-9, "{pole:?} {direction}: {found} {intensity}");
        }
    }
    // Nothing beyond the last polar angle.
    let down = symmetric(90.0, 2, |_| 1.0);
    assert_eq!([0.1, -0.1].map(|z| down.along(DVec3::new(1.0, 0.0, z).normalize())), [1.0, 0.0]);
}

#[test]
fn c_planes_run_counter_clockwise_from_above() {
    // Bright in a wedge around C = 90° only, hung up 2 high: seen from above +y is left of +x.
    let (azimuths, polar) = ([0.0, 80.0, 90.0, 100.0, 360.0], [0.0, 90.0]);
    let values = [0.0, 0.0, 1.0, 0.0, 0.0].iter().flat_map(|&v| [v, v]).collect();
    let wedge = IntensityDistribution::new(&azimuths, &polar, values).unwrap();
    let lamp = Luminaire::new(wedge, DVec3::new(0.5, 0.5, 0.9), DVec3::NEG_Z);
    let scene = cube(&grey()).with_luminaires(vec![lamp]).unwrap();
    let mesh = radiosity::Mesh::new(scene, f64::INFINITY).unwrap();
    let corners = vec![[0; 3]; mesh.element_count()];
    let field = radiosity::gather::RadiosityField {
        mesh: &mesh,
        corners: &corners,
        reflected: &[Rgb::ZERO],
    };
    let point = |x: f64, y: f64| radiosity::gather::GatherPoint {
        position: DVec3::new(x, y, 1e-6),
        normal: DVec3::Z,
        near: 1e-7,
    };
    let points = [point(0.5, 0.9), point(0.9, 0.5), point(0.5, 0.1), point(0.1, 0.5)];
    let mut rays = radiosity::Backend::Cpu.gather(&mesh, 4).unwrap();
    let found = rays.gather(&field, &points).unwrap();
    assert!(found[0].irradiance.x > 0.1 && found[1..].iter().all(|s| s.irradiance.x == 0.0));
}

#[test]
fn numbers_without_a_meaning_are_refused() {
    let wrong = |azimuths: &[f64], polar: &[f64], values: &[f64]| {
        let error = IntensityDistribution::new(azimuths, polar, values.to_vec()).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::Scene);
        error.to_string()
    };
    assert!(wrong(&[], &[0.0, 90.0], &[]).contains("0 azimuths"));
    assert!(wrong(&[0.0], &[0.0], &[1.0]).contains("1 polar"));
    assert!(wrong(&[0.0, 0.0], &[0.0, 90.0], &[1.0; 4]).contains("ascend"));
    assert!(wrong(&[0.0], &[0.0, f64::NAN], &[1.0; 2]).contains("ascend"));
    assert!(wrong(&[0.0, 361.0], &[0.0, 90.0], &[1.0; 4]).contains("turn"));
    assert!(wrong(&[0.0], &[0.0, 181.0], &[1.0; 2]).contains("180"));
    assert!(wrong(&[0.0], &[0.0, 90.0], &[1.0; 3]).contains("3 values"));
    assert!(wrong(&[0.0], &[0.0, 90.0], &[1.0, -1.0]).contains("-1"));
    assert!(wrong(&[0.0], &[0.0, 90.0], &[1.0, f64::INFINITY]).contains("inf"));

    let good = || {
        let even = IntensityDistribution::isotropic(1.0).unwrap();
        Luminaire::new(even, DVec3::ZERO, DVec3::NEG_Z)
    };
    let said = |luminaire| {
        let error = cube(&grey()).with_luminaires(vec![good(), luminaire]).unwrap_err();
        assert!(error.to_string().starts_with("luminaire 2"), "{error}");
        error.to_string()
    };
    assert!(said(Luminaire { position: DVec3::NAN, ..good() }).contains("position"));
    assert!(said(Luminaire { aim: DVec3::ZERO, ..good() }).contains("aim"));
    assert!(said(Luminaire { c0: DVec3::Z, ..good() }).contains("C = 0°"));
    let opening = Opening { size: DVec3::NEG_X, is_round: false };
    assert!(said(Luminaire { opening, ..good() }).contains("opening"));
    assert!(said(Luminaire { scale: -Rgb::X, ..good() }).contains("scale"));
    assert!(said(Luminaire { scale: Rgb::splat(f64::MAX), ..good() }).contains("scale"));
    // Axes of any length, C = 0° by what of it is across the aim.
    let skewed = Luminaire { aim: -3.0 * DVec3::Z, c0: DVec3::new(2.0, 0.0, 1.0), ..good() };
    let scene = cube(&grey()).with_luminaires(vec![skewed]).unwrap();
    assert_eq!([scene.luminaires()[0].aim, scene.luminaires()[0].c0], [DVec3::NEG_Z, DVec3::X]);
    assert_eq!(Luminaire::new(good().intensity, DVec3::ZERO, DVec3::NEG_X).c0, DVec3::Y);
}
