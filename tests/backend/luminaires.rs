//! What arrives straight from luminaires: closed forms, shadows, panes, and what paths find.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use radiosity::backend::gpu::TracedGather;
use radiosity::form_factor::closed_form::point_to_polygon;
use radiosity::gather::{Gather, GatherPoint, IrradianceSample, RadiosityField};
use radiosity::scene::{IntensityDistribution, Luminaire, Opening};
use radiosity::verify::PathTracer;
use radiosity::{Backend, Mesh, Rgb, Scene};

use crate::common::scenes::{Quad, facing_down, facing_up, paint, quads};
use crate::common::{gpu, keep_counting};

/// A grey floor of 20 × 20 around the origin, and `others`, which are black, lit by these.
fn lit(luminaires: Vec<Luminaire>, others: &[Quad]) -> Scene {
    let floor = facing_up([-10.0, 10.0], [-10.0, 10.0], 0.0);
    let others = others.iter().map(|&quad| (quad, paint(0.0, 0.0)));
    let all: Vec<_> = std::iter::once((floor, paint(0.5, 0.0))).chain(others).collect();
    quads(&all).with_luminaires(luminaires).unwrap()
}

fn field<'a>(mesh: &'a Mesh, corners: &'a [[u32; 3]]) -> RadiosityField<'a> {
    RadiosityField { mesh, corners, reflected: &[Rgb::ZERO] }
}

fn above(x: f64, y: f64) -> GatherPoint {
    GatherPoint { position: DVec3::new(x, y, 0.0), normal: DVec3::Z, near: 1e-7 }
}

/// What rays find at `points` of light that nothing has reflected yet.
fn by_rays(scene: &Scene, points: &[GatherPoint]) -> Vec<IrradianceSample> {
    let mesh = Mesh::new(scene.clone(), f64::INFINITY).unwrap();
    let corners = vec![[0; 3]; mesh.element_count()];
    Backend::Cpu.gather(&mesh, 64).unwrap().gather(&field(&mesh, &corners), points).unwrap()
}

/// An intensity by the angle from the aim, in steps of `step` degrees up to 90°.
fn symmetric(step: f64, f: impl Fn(f64) -> f64) -> IntensityDistribution {
    let polar: Vec<f64> = (0..=(90.0 / step) as usize).map(|k| k as f64 * step).collect();
    let values = polar.iter().map(|a| f(a.to_radians()).max(0.0)).collect();
    IntensityDistribution::new(&[0.0], &polar, values).unwrap()
}

/// A lamp at `height` over the origin that aims down.
fn hung(intensity: IntensityDistribution, height: f64) -> Luminaire {
    Luminaire::new(intensity, DVec3::new(0.0, 0.0, height), DVec3::NEG_Z)
}

#[test]
fn a_point_lights_a_plane_by_its_closed_form() {
    // I(θ) cos³ θ / h² at h tan θ; linear in θ, it is what it is between the angles given.
    let intensity = |angle: f64| 100.0 * (1.0 - angle / FRAC_PI_2);
    let scale = Rgb::new(1.0, 0.5, 0.25);
    for height in [0.01, 1.0, 3.0] {
        let lamp = Luminaire { scale, ..hung(symmetric(22.5, intensity), height) };
        let angles = [0.0f64, 10.0, 33.0, 60.0, 80.0].map(f64::to_radians);
        let points =
            angles.map(|angle| above(height * angle.tan() * 0.6, height * angle.tan() * 0.8));
        let found = by_rays(&lit(vec![lamp], &[]), &points);
        for (angle, sample) in angles.iter().zip(found) {
            let truth = intensity(*angle) * angle.cos().powi(3) / (height * height) * scale;
            // Rounding of angles, 1e-16 of a radian or so of the 0.1 that are left at 80°.
            let off = (sample.irradiance / truth - 1.0).abs().max_element();
            assert!(off < 1e-13, "{height} {angle}: {sample:?} {truth}");
            assert_eq!(sample.direct, sample.irradiance);
        }
    }
    // Two lamps add up; in millimetres the same lux arrive.
    let lamp = hung(symmetric(22.5, intensity), 2.0);
    let one = by_rays(&lit(vec![lamp.clone()], &[]), &[above(1.0, 0.0)])[0].irradiance;
    let two = by_rays(&lit(vec![lamp.clone(); 2], &[]), &[above(1.0, 0.0)])[0].irradiance;
    // They are one node of the tree, whose rays choose between them: a few roundings.
    assert!((two / (2.0 * one) - 1.0).abs().max_element() < 1e-15, "{two} {one}");
    let in_mm = Luminaire { position: 1e3 * lamp.position, ..lamp.in_unit_of(1e-3) };
    let found = by_rays(&lit(vec![in_mm], &[]), &[above(1e3, 0.0)])[0].irradiance;
    assert!((found / one - 1.0).abs().max_element() < 1e-14, "{found} {one}");
}

#[test]
fn a_diffuse_opening_lights_as_the_surface_it_is() {
    // With L A cos γ an opening is a surface of radiance L: π L times its form factor. Chords of
    // the cosine in steps of a quarter of a degree are 2.4e-6 below it, Gauss points 4e-6 off.
    const SHARE: f64 = 1e-5;
    let rectangle = Opening { size: DVec3::new(1.2, 0.6, 0.0), is_round: false };
    let disc = Opening { size: DVec3::new(0.8, 0.8, 0.0), is_round: true };
    let radius = 0.4;
    for height in [0.5, 1.0, 4.0, 50.0, 1000.0] {
        let lamp = |opening| Luminaire { opening, ..hung(symmetric(0.25, f64::cos), height) };
        for (x, y) in [(0.0, 0.0), (0.7, 0.2), (3.0, -4.0)] {
            let found = by_rays(&lit(vec![lamp(rectangle)], &[]), &[above(x, y)])[0].irradiance.x;
            let corners = facing_down([-0.6, 0.6], [-0.3, 0.3], height).map(DVec3::from_array);
            let factor = point_to_polygon(DVec3::new(x, y, 0.0), DVec3::Z, &corners);
            let truth = PI * factor / (1.2 * 0.6);
            assert!((found / truth - 1.0).abs() < SHARE, "{height} {x} {y}: {found} {truth}");
        }
        let found = by_rays(&lit(vec![lamp(disc)], &[]), &[above(0.0, 0.0)])[0].irradiance.x;
        let truth = 1.0 / (radius * radius + height * height);
        assert!((found / truth - 1.0).abs() < SHARE, "{height}: {found} {truth}");
    }
}

#[test]
fn shadows_of_points_are_sharp_and_of_openings_as_wide_as_those() {
    let even = || IntensityDistribution::isotropic(1.0).unwrap();
    // What covers x below 0 half-way up.
    let shutter = facing_down([-10.0, 0.0], [-10.0, 10.0], 1.0);
    let points = [-0.2, -1e-6, 1e-6, 0.2].map(|x| above(x, 0.3));
    let sharp = by_rays(&lit(vec![hung(even(), 2.0)], &[shutter]), &points);
    let is_lit: Vec<bool> = sharp.iter().map(|s| s.irradiance.x > 0.0).collect();
    assert_eq!(is_lit, [false, false, true, true]);
    let opening = Opening { size: DVec3::new(0.4, 0.2, 0.0), is_round: false };
    for x in [-0.3, -0.15, 0.0, 0.1, 0.3] {
        let lamp = Luminaire { opening, ..hung(even(), 2.0) };
        let shaded =
            by_rays(&lit(vec![lamp.clone()], &[shutter]), &[above(x, 0.0)])[0].irradiance.x;
        let free = by_rays(&lit(vec![lamp], &[]), &[above(x, 0.0)])[0].irradiance.x;
        // Seen from x, the edge at 0 falls on the opening at -x: of it what lies beyond.
        let truth = ((0.2 + x) / 0.4).clamp(0.0, 1.0);
        // A row of 16 by 16 points may be missed or counted, and the nearer half is brighter by a
        // few parts in a hundred.
        let within = if truth % 1.0 == 0.0 { 1e-14 } else { 1.0 / 16.0 + 0.01 };
        assert!((shaded / free - truth).abs() < within, "{x}: {} {truth}", shaded / free);
    }
}

#[test]
#[cfg_attr(skip_gpu_tests, ignore = "RADIOSITY_NO_GPU is set")]
fn device_and_paths_find_the_same() {
    let opening = Opening { size: DVec3::new(0.4, 0.2, 0.1), is_round: true };
    let sharp = hung(symmetric(5.0, |angle| angle.cos().powi(3)), 3.0);
    let wide = Luminaire {
        opening,
        position: DVec3::new(1.0, 0.5, 2.0),
        ..hung(IntensityDistribution::isotropic(0.3).unwrap(), 2.0)
    };
    let shutter = facing_down([-10.0, 0.2], [-10.0, 10.0], 1.0);
    let scene = lit(vec![sharp, wide], &[shutter]);
    let points = [-0.5, 0.1, 0.3, 1.0, 2.0].map(|x| above(x, 0.1));
    let rays = by_rays(&scene, &points);
    let mesh = Mesh::new(scene.clone(), f64::INFINITY).unwrap();
    let corners = vec![[0; 3]; mesh.element_count()];
    let mut on_device = TracedGather::new(&gpu(), &mesh, 32).unwrap();
    let gathered = on_device.gather(&field(&mesh, &corners), &points).unwrap();
    let tracer = PathTracer::new(&scene);
    for ((point, rays), gathered) in points.iter().zip(rays).zip(gathered) {
        // The same rays, and 32 bits on the way to the device and back.
        for (ours, theirs) in
            [(rays.irradiance, gathered.irradiance), (rays.direct, gathered.direct)]
        {
            let off = (ours - theirs).abs().max_element();
            assert!(off <= 1e-6 * ours.max_element(), "{ours} {theirs}");
        }
        let at = tracer.locate(point.position, DVec3::Z).unwrap();
        let found = tracer.reflected(&[at], 20_000, 7, keep_counting)[0];
        let off = (found.radiosity - 0.5 * rays.irradiance).abs();
        // The penumbra to a row of 16 points. Nothing comes back from a black shutter.
        let within = 4.0 * found.standard_error + 0.07 * 0.5 * rays.irradiance;
        assert!(off.cmple(within).all(), "{point:?}: {found:?} {rays:?}");
    }
}
