//! A closed room of one radiance everywhere: whatever mirror or glass stands in it, that radiance
//! is all that is to be seen.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::gather::{GatherPoint, IrradianceSample, RadiosityField};
use radiosity::scene::Specular;
use radiosity::{Camera, Error, Gather, GatheredMesh, Material, Rgb};

use super::glass::{turned_inside_out, with_ball};
use super::{LEFT_OUT, SIZE, block_of, draw, glass, lit, mirror, scene, tinted_glass};
use crate::common::keep_counting;
use crate::common::scenes::{Quad, walls};

/// W/(m² sr).
const RADIANCE: Rgb = Rgb::new(1.0, 2.0, 3.0);

/// Of what falls on it, what a wall reflects; the rest of its light it emits.
const REFLECTANCE: f64 = 0.5;

const CAMERA: Camera = Camera {
    eye: DVec3::new(-2.5, 0.4, 0.3),
    target: DVec3::new(0.1, 0.0, 0.05),
    up: DVec3::Y,
    vertical_fov: 50.0,
};

fn room() -> Vec<(Quad, Material)> {
    let wall = Material {
        exitance: (1.0 - REFLECTANCE) * PI * RADIANCE,
        ..Material::grey("wall", REFLECTANCE)
    };
    walls([-3.0; 3], [3.0; 3]).map(|quad| (quad, wall.clone())).to_vec()
}

/// Every surface has the radiosity that it has in the furnace.
fn furnace(scene: radiosity::Scene) -> GatheredMesh {
    lit(scene, |_, material| material.exitance + material.reflectance * PI * RADIANCE)
}

/// Finds the furnace everywhere.
struct Furnace;

impl Gather for Furnace {
    fn gather(
        &mut self,
        _: &RadiosityField,
        points: &[GatherPoint],
    ) -> Result<Vec<IrradianceSample>, Error> {
        let sample = IrradianceSample { irradiance: PI * RADIANCE, ..Default::default() };
        Ok(vec![sample; points.len()])
    }
}

/// Interpolated and gathered, the picture is as bright as the furnace, but for what is not looked
/// at.
fn shows_furnace(what: &str, camera: &Camera, light: &GatheredMesh) {
    for (way, image) in [
        ("interpolated", draw(camera, light, 2)),
        (
            "gathered",
            camera
                .gathered_image(light, &mut Furnace, SIZE.0, SIZE.1, 2, keep_counting)
                .unwrap()
                .unwrap(),
        ),
    ] {
        for (k, pixel) in image.pixels.iter().enumerate() {
            let share = *pixel / RADIANCE;
            let good = share.min_element() >= 1.0 - LEFT_OUT && share.max_element() < 1.0 + 1e-12;
            assert!(good, "{what}, {way}, pixel {k}: {share}");
        }
    }
}

#[test]
fn furnace_is_seen_through_and_in_everything() {
    let sheet = [[-0.2, -1., -1.], [-0.2, 1., -1.2], [0.1, 1., 1.1], [0.2, -1., 1.]];
    let (low, high) = ([-0.6, -0.7, -0.5], [0.5, 0.6, 0.8]);
    let (inner_low, inner_high) = ([-0.3; 3], [0.3; 3]);
    let diffuse = Rgb::new(0.1, 0.2, 0.0);
    let milky = Material { reflectance: diffuse, ..tinted_glass(1.5, Rgb::ONE - diffuse) };
    let varnish = Specular::Polished { reflectance: Rgb::ONE - diffuse };
    let varnish =
        Material { reflectance: diffuse, specular: Some(varnish), ..Material::grey("wood", 0.0) };
    let silver = Specular::Mirror { reflectance: Rgb::ONE - diffuse };
    let silver =
        Material { reflectance: diffuse, specular: Some(silver), ..Material::grey("tin", 0.0) };
    let nested = |outer: &Material, inner: &Material| {
        [block_of(low, high, outer), block_of(inner_low, inner_high, inner)].concat()
    };
    let cavity = {
        let inner = block_of(inner_low, inner_high, &glass(1.5));
        [block_of(low, high, &glass(1.5)), turned_inside_out(&inner)].concat()
    };
    for (what, things) in [
        ("pane", vec![(sheet, glass(1.5))]),
        (
            "two panes",
            vec![(sheet, glass(1.5)), (sheet.map(|[x, y, z]| [x + 0.3, y, z]), glass(2.0))],
        ),
        ("block", block_of(low, high, &glass(1.5))),
        ("milky block", block_of(low, high, &milky)),
        ("block in a block", nested(&glass(1.5), &glass(1.33))),
        ("denser block in a block", nested(&glass(1.33), &glass(2.4))),
        ("bubble in a block", cavity),
        ("mirror", turned_inside_out(&[(sheet, mirror(1.0))])),
        ("mirrors around", block_of(low, high, &mirror(1.0))),
        ("mirror in a block", nested(&glass(1.5), &mirror(1.0))),
        ("tin", block_of(low, high, &silver)),
        ("varnish", block_of(low, high, &varnish)),
    ] {
        let light = furnace(scene(&[room(), things].concat()));
        shows_furnace(what, &CAMERA, &light);
    }
    let light = furnace(with_ball(&room(), &glass(1.5), DVec3::ZERO, 1.0, 3));
    shows_furnace("ball", &CAMERA, &light);
    // From inside.
    let light = furnace(scene(&[room(), nested(&glass(1.5), &glass(1.33))].concat()));
    shows_furnace("within a block", &Camera { eye: DVec3::new(-0.4, 0.1, 0.2), ..CAMERA }, &light);
    shows_furnace(
        "within the inner",
        &Camera { eye: DVec3::new(-0.1, 0.1, 0.2), ..CAMERA },
        &light,
    );
}
