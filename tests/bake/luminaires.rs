//! Scenes that luminaires light: the ledger, the error, and nothing where there are none.

use std::f64::consts::PI;

use glam::DVec3;
use radiosity::bake::Outcome;
use radiosity::scene::{IntensityDistribution, Luminaire, Opening};
use radiosity::verify::{Settings, verify};
use radiosity::{Backend, BakeSettings, BakeTarget, Camera, Material, Rgb, SceneSettings, Sky};

use crate::common::scenes::{paint, quads, standing_block, walls};
use crate::common::{cube, keep_going};

fn even(flux: f64) -> IntensityDistribution {
    IntensityDistribution::isotropic(flux / (4.0 * PI)).unwrap()
}

#[test]
fn all_flux_of_a_lamp_is_received_however_near_it_is() {
    // In a closed room all of it arrives: near a wall, in a corner, right at the floor.
    for place in [[0.5, 0.5, 0.98], [0.02, 0.03, 0.05], [0.4, 0.3, 0.001]] {
        let lamp = Luminaire::new(even(7.0), DVec3::from_array(place), DVec3::NEG_Z);
        let scene = cube(&Material::grey("wall", 0.5)).with_luminaires(vec![lamp]).unwrap();
        let mut settings = BakeSettings::elements_only(&scene);
        settings.solve.element_size = 0.1;
        let baked = settings.bake(scene, &Backend::Cpu, keep_going).unwrap();
        // Of the half that reaches the near wall, middles of parts make 3 % more at its foot, less
        // around; below parts that are cut no further lies a twentieth of that half.
        let received = baked.solution.ledger.emitted.x / 7.0;
        println!("{place:?}: {received}");
        assert!((received - 1.0).abs() < 0.03, "{place:?}: {received}");
        assert!(baked.light.surface.radiosity.iter().all(|b| b.is_finite()));
    }
}

#[test]
fn a_room_lit_by_luminaires_is_as_exact_as_asked() {
    // A spotlight on a block, and a flat lamp that also lights the ceiling.
    let polar = [0.0, 15.0, 20.0, 30.0];
    let spot = IntensityDistribution::new(&[0.0], &polar, vec![9.0, 9.0, 4.0, 0.0]).unwrap();
    let spot = Luminaire {
        scale: Rgb::new(1.0, 0.8, 0.5),
        ..Luminaire::new(spot, DVec3::new(3.0, 0.5, 2.0), DVec3::new(-1.0, 1.0, -1.5))
    };
    let flat = Luminaire {
        opening: Opening { size: DVec3::new(1.2, 0.1, 0.0), is_round: false },
        ..Luminaire::new(even(10.0), DVec3::new(1.0, 3.0, 2.2), DVec3::NEG_Z)
    };
    let room = walls([0.0; 3], [4.0, 4.0, 2.5]).map(|wall| (wall, paint(0.6, 0.0)));
    let block =
        standing_block([1.5, 2.2], [1.8, 2.4], 0.0, 0.7).map(|side| (side, paint(0.4, 0.0)));
    let scene = quads(&room.into_iter().chain(block).collect::<Vec<_>>());
    let scene = scene.with_luminaires(vec![spot, flat]).unwrap();
    let baked = BakeTarget::Error(0.05).bake(scene.clone(), &Backend::Cpu, keep_going).unwrap();
    assert_eq!(baked.outcome, Outcome::Reached);
    let mut settings = Settings::default();
    settings.precision = 0.1;
    let found = verify(&scene, &baked.light.surface, &settings, keep_going).unwrap();
    let error = found.error.unwrap().value;
    println!("asked 5 %, told {}, measured {error}", baked.estimate.total);
    assert!(error < 0.05, "{error}");
    // A picture has light in it.
    let image = Camera::framing(&baked.light, 1.0).image(&baked.light.surface, 32, 32, 1).unwrap();
    assert!(image.pixels.iter().any(|pixel| pixel.x > 0.0));
}

#[test]
fn luminaires_take_the_place_of_the_sky_that_nobody_asked_for() {
    let obj = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";
    let mut settings = SceneSettings::default();
    settings.sky = Some(Sky::default());
    let scene = settings.read("floor.obj", obj, &[]).unwrap();
    let warned = scene.warnings().len();
    let lamp = Luminaire::new(even(1.0), DVec3::new(0.5, 0.5, 1.0), DVec3::NEG_Z);
    let lit = scene.with_luminaires(vec![lamp]).unwrap();
    assert_eq!(lit.warnings().len(), warned - 1);
    let baked = BakeTarget::Error(0.1).bake(lit, &Backend::Cpu, keep_going).unwrap();
    assert!(baked.light.surface.radiosity.iter().any(|b| b.x > 0.0));
}
