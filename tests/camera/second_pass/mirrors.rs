//! Mirrors.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::scene::Specular;
use radiosity::{Camera, Material, Rgb, Sky};

use super::{LEFT_OUT, directions, draw, lit, lit_walls, mirror, scene};
use crate::common::scenes::{Quad, block, grey};

/// Looks at the plane x = 0 from the side.
const CAMERA: Camera = Camera {
    eye: DVec3::new(4.0, 1.0, 0.5),
    target: DVec3::new(0.0, 0.2, 0.1),
    up: DVec3::Y,
    vertical_fov: 70.0,
};

const LOW: [f64; 2] = [-1.5, -1.0];
const HIGH: [f64; 2] = [1.0, 2.0];

/// In the plane x = 0, facing +x.
fn glass_of_mirror() -> Quad {
    let ([y0, z0], [y1, z1]) = (LOW, HIGH);
    [[0., y0, z0], [0., y1, z0], [0., y1, z1], [0., y0, z1]]
}

/// What stands before the mirror, some of it behind the camera.
fn things() -> Vec<Quad> {
    let near = block([1.0, -1.0, -0.7], [1.6, -0.3, 0.1]);
    let behind = block([5.0, -2.0, -3.0], [6.0, 3.0, 4.0]);
    let floor = [[0.5, -1.2, -4.0], [0.5, -1.2, 4.0], [7.0, -1.2, 4.0], [7.0, -1.2, -4.0]];
    near.into_iter().chain(behind).chain([floor]).collect()
}

/// The other way round seen from its front, in the mirror image.
fn mirrored(quad: Quad) -> Quad {
    let [a, b, c, d] = quad.map(|[x, y, z]| [-x, y, z]);
    [a, d, c, b]
}

/// Whether a ray meets the plane of the mirror within it.
fn meets_mirror(direction: DVec3) -> bool {
    let at = CAMERA.eye - direction * (CAMERA.eye.x / direction.x);
    let ([y0, z0], [y1, z1]) = (LOW, HIGH);
    direction.x < 0.0 && (y0..y1).contains(&at.y) && (z0..z1).contains(&at.z)
}

#[test]
fn mirror_shows_the_mirrored_scene() {
    let tint = Rgb::new(0.9, 0.5, 0.2);
    let silver = Specular::Mirror { reflectance: tint };
    let silver = Material { specular: Some(silver), ..Material::grey("mirror", 0.0) };
    let plain: Vec<_> = things().into_iter().map(|quad| (quad, grey())).collect();
    let with_mirror = [plain.clone(), vec![(glass_of_mirror(), silver)]].concat();
    let images = things().into_iter().map(|quad| (mirrored(quad), grey()));
    let twice = plain.iter().cloned().chain(images).collect::<Vec<_>>();
    let in_mirror = draw(&CAMERA, &lit_walls(scene(&with_mirror)), 1);
    let without = draw(&CAMERA, &lit_walls(scene(&plain)), 1);
    // Through a hole in place of the mirror: things in front are as bright as they are.
    let radiance = |p: DVec3| super::wall_radiance(DVec3 { x: p.x.abs(), ..p });
    let twice = lit(scene(&twice), |place, _| PI * radiance(place));
    let through = draw(&CAMERA, &twice, 1);
    let (mut reflected, mut lit_ones) = (0, 0);
    for (k, direction) in directions(&CAMERA).into_iter().enumerate() {
        let blocked = without.pixels[k] != Rgb::ZERO;
        let want = if meets_mirror(direction) && !blocked {
            reflected += 1;
            lit_ones += usize::from(through.pixels[k] != Rgb::ZERO);
            tint * through.pixels[k]
        } else {
            without.pixels[k]
        };
        assert!((in_mirror.pixels[k] - want).length() < 1e-9, "{k}: {}", in_mirror.pixels[k]);
    }
    assert!(reflected > 100 && lit_ones > 80, "{reflected} {lit_ones}");
}

#[test]
fn backs_of_mirrors_are_black() {
    let behind = Camera { eye: DVec3::new(-4.0, 0.0, 0.0), ..CAMERA };
    let light = lit(scene(&[(glass_of_mirror(), mirror(1.0))]), |_, _| Rgb::ONE);
    assert!(draw(&behind, &light, 2).pixels.iter().all(|&c| c == Rgb::ZERO));
}

#[test]
fn diffuse_part_of_a_mirror_is_seen_with_its_reflection() {
    // A mirror of radiosity 1 before a sky of radiance 2.
    for (specular, cosine_matters) in [
        (Specular::Mirror { reflectance: Rgb::splat(0.3) }, false),
        (Specular::Polished { reflectance: Rgb::splat(0.3) }, true),
    ] {
        let plate = Material { specular: Some(specular), ..Material::grey("plate", 0.5) };
        let mut light = lit(scene(&[(glass_of_mirror(), plate)]), |_, _| Rgb::ONE);
        light.surface.sky = Sky::uniform(Rgb::splat(2.0));
        let image = draw(&CAMERA, &light, 1);
        for (pixel, direction) in image.pixels.iter().zip(directions(&CAMERA)) {
            let rise = if cosine_matters { (1.0 + direction.x).powi(5) } else { 0.0 };
            let want = match meets_mirror(direction) {
                true => (1.0 - rise) / PI + 2.0 * (0.3 + 0.7 * rise),
                false => 2.0,
            };
            assert!((*pixel - Rgb::splat(want)).length() < 1e-12, "{pixel} {want}");
        }
    }
}

#[test]
fn facing_mirrors_come_to_an_end() {
    // Two that face each other, and the eye looks from one straight at the other: the sum of all
    // images of their own light is a geometric series.
    let front = [[-9., -9., -1.], [9., -9., -1.], [9., 9., -1.], [-9., 9., -1.]];
    let behind = front.map(|[x, y, _]| [y, x, 1.]);
    let camera =
        Camera { eye: DVec3::ZERO, target: DVec3::NEG_Z, up: DVec3::Y, vertical_fov: 1e-6 };
    for reflectance in [0.0, 0.5, 0.9] {
        let both = [(front, mirror(reflectance)), (behind, mirror(reflectance))];
        let glow = |mut m: Material| {
            m.exitance = Rgb::ONE;
            m
        };
        let both = both.map(|(quad, material)| (quad, glow(material)));
        let image = draw(&camera, &lit(scene(&both), |_, _| Rgb::splat(PI)), 1);
        let want = 1.0 / (1.0 - reflectance);
        // The rest of the series, from a weight of 1/1024 on, is not looked at.
        for pixel in &image.pixels {
            assert!((want - pixel.x).abs() <= LEFT_OUT * want + 1e-9, "{pixel} {want}");
        }
    }
    // Nothing is ever lost between these, and nothing is seen.
    let both = [(front, mirror(1.0)), (behind, mirror(1.0))];
    let image = draw(&camera, &lit(scene(&both), |_, _| Rgb::ZERO), 1);
    assert!(image.pixels.iter().all(|&c| c == Rgb::ZERO));
}
