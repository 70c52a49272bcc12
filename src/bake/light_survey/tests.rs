//! Where the light of rooms, skies and planes falls.

use std::f64::consts::PI;

use glam::DVec3;

use super::*;
use crate::scene::Triangle;

/// Quads of one material each: corners counter-clockwise from the front, in a group of their own.
fn scene(quads: &[([DVec3; 4], Material)]) -> Scene {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (k, (corners, _)) in (0..).zip(quads) {
        let first = positions.len() as u32;
        positions.extend(corners);
        for corners in [[0, 1, 2], [0, 2, 3]] {
            let corners = corners.map(|c| first + c);
            triangles.push(Triangle { corners, group: k, material: k, smoothing: None });
        }
    }
    let names = (0..quads.len()).map(|k| format!("quad {k}")).collect();
    let materials = quads.iter().map(|(_, material)| material.clone()).collect();
    Scene::new(positions, triangles, names, materials).unwrap()
}

/// A square at height `z`, of half the side `half`, that faces up or down.
fn level(half: f64, z: f64, up: bool) -> [DVec3; 4] {
    let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, z);
    let mut corners = [corner(-1., -1.), corner(1., -1.), corner(1., 1.), corner(-1., 1.)];
    if !up {
        corners.reverse();
    }
    corners
}

fn grey() -> Material {
    Material::grey("grey", 0.5)
}

fn glow() -> Material {
    Material { exitance: Rgb::ONE, ..Material::grey("glow", 0.0) }
}

#[test]
fn lamp_near_a_floor_is_shot() {
    let survey = LightSurvey::new(&scene(&[
        (level(1.0, 0.0, true), grey()),
        (level(0.2, 0.3, false), glow()),
    ]));
    assert_eq!(
        survey,
        LightSurvey { region: None, diagonal: 8f64.sqrt(), gathered_materials: vec![] }
    );
}

#[test]
fn far_sky_is_gathered_and_black_surfaces_have_no_extent() {
    let sky = level(1000.0, 1000.0, false);
    let survey = LightSurvey::new(&scene(&[(level(1.0, 0.0, true), grey()), (sky, glow())]));
    assert_eq!(survey.gathered_materials, [1]);
    assert_eq!((survey.region, survey.diagonal), (None, 8f64.sqrt()));
}

#[test]
fn region_is_that_of_the_light() {
    let ground = level(500.0, -0.1, true);
    let room = [(level(1.0, 0.0, true), grey()), (level(0.2, 0.3, false), glow())];
    let survey = LightSurvey::new(&scene(&[room[0].clone(), room[1].clone(), (ground, grey())]));
    let region = survey.region.expect("a region");
    let room = Aabb { low: DVec3::new(-1.0, -1.0, -0.1), high: DVec3::new(1.0, 1.0, 0.01) };
    assert!(room.contains(region.low) && room.contains(region.high), "{region:?}");
    // All but some of the light falls within 0.5 of the middle.
    assert!(survey.diagonal > 0.7 && survey.diagonal < 8f64.sqrt(), "{survey:?}");
    // A sky over all of it fills the ground.
    let sky = (level(5000.0, 5000.0, false), glow());
    let survey =
        LightSurvey::new(&scene(&[(level(1.0, 0.0, true), grey()), sky, (ground, grey())]));
    assert_eq!(survey.region, None);
}

#[test]
fn points_see_closed_form_factors() {
    let floor = (level(0.01, 0.0, true), grey());
    let lamp = (level(1.0, 1.0, false), glow());
    let scene = scene(&[floor, lamp]);
    let seen = look(&scene, &strongest_lights(&scene), &survey_points(&scene));
    // A point below the middle of a square of side 2 at distance 1: 4 corner terms (Howell, C-4).
    let r = 1.0 / 2f64.sqrt();
    let expected = 4.0 / PI * r * r.atan();
    // The floor is 1 % of the distance wide: 1e-4 off, and rays see all of the lamp.
    assert!(seen.iter().all(|s| (s.irradiance.x - expected).abs() < 2e-4), "{expected} {seen:?}");
    let area: f64 = survey_points(&scene).iter().map(|point| point.area).sum();
    assert!((area / 4e-4 - 1.0).abs() < 1e-9, "points stand for all of the area");
}

#[test]
fn a_sky_lights_what_nothing_is_above() {
    // A slab, wide and thin, on a floor a hundred times as wide: below it is no light.
    let floor = (level(100.0, 0.0, true), grey());
    let roof = (level(90.0, 1.0, false), Material::grey("roof", 0.0));
    let open = scene(std::slice::from_ref(&floor)).with_sky(Rgb::ONE).unwrap();
    assert_eq!(LightSurvey::new(&open).region, None);
    let sheltered = scene(&[(level(1.0, 2.0, true), grey()), floor, roof]);
    let survey = LightSurvey::new(&sheltered.with_sky(Rgb::ONE).unwrap());
    assert_eq!((survey.region, survey.gathered_materials), (None, vec![]));
    let samples = look(&open, &[], &survey_points(&open));
    assert!(samples.iter().all(|sample| sample.escaped == 1.0));
}

#[test]
fn dark_scenes_have_no_region() {
    let survey = LightSurvey::new(&scene(&[(level(1.0, 0.0, true), grey())]));
    assert_eq!(
        survey,
        LightSurvey { region: None, diagonal: 8f64.sqrt(), gathered_materials: vec![] }
    );
    let black = Material::grey("black", 0.0);
    assert_eq!(LightSurvey::new(&scene(&[(level(1.0, 0.0, true), black)])).diagonal, 8f64.sqrt());
}
