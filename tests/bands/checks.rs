//! What cannot be bands of a scene is refused, and what its bake does not see is told.

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::Material;
use radiosity::bands::{Band, BandMaterial, Bands};
use radiosity::scene::{IntensityDistribution, Luminaire};

use super::{bake, glow, glowing, numbered};
use crate::common::cube;

fn good() -> Bands {
    let materials = vec![glowing(vec![0.5, 0.6], vec![1.0, 0.0]); 6];
    Bands { materials, ..Bands::dark(numbered(2)) }
}

#[test]
fn bad_bands_are_refused() {
    let scene = cube(&glow());
    good().check(&scene).unwrap();
    let refused = |change: &dyn Fn(&mut Bands), words: &[&str]| {
        let mut bands = good();
        change(&mut bands);
        let error = bands.check(&scene).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "'{word}' not in: {error}");
        }
    };
    refused(&|bands| *bands = Bands::dark(vec![]), &["none", "one or more"]);
    refused(&|bands| bands.bands[1].name = "0".into(), &["two named 0"]);
    refused(&|bands| bands.bands[1].name = "a b".into(), &["'a b'", "letters"]);
    refused(&|bands| bands.bands[0].wavelength = Some(-1.0), &["band 0", "-1 nm"]);
    refused(&|bands| bands.materials.truncate(5), &["5 of them", "6"]);
    refused(&|bands| bands.materials[0].exitance.truncate(1), &["'glow'", "1 values of exitance"]);
    refused(&|bands| bands.materials[2].reflectance[1] = 1.0, &["'glow' in band 1", "below 1"]);
    refused(&|bands| bands.materials[2].reflectance[1] = f64::NAN, &["NaN"]);
    refused(&|bands| bands.materials[3].transmittance[0] = 0.1, &["band 0", "opaque"]);
    refused(&|bands| bands.materials[4].exitance[1] = -1.0, &["exitance -1"]);
    refused(&|bands| bands.sky = vec![], &["sky", "0 values"]);
    refused(&|bands| bands.sun[1] = f64::INFINITY, &["sun", "inf"]);
    let three = Band { name: "2".into(), wavelength: None };
    refused(&|bands| bands.bands.push(three.clone()), &["sky: 2 values", "give 3"]);
}

#[test]
fn every_luminaire_wants_its_bands() {
    let intensity = IntensityDistribution::isotropic(1.0).unwrap();
    let lamp = Luminaire::new(intensity, DVec3::splat(0.5), -DVec3::Z);
    let scene = cube(&glow()).with_luminaires(vec![lamp]).unwrap();
    for (luminaires, words) in [
        (vec![], "luminaires of bands: 0 of them; give one for each of the scene's 1"),
        (vec![vec![1.0]], "luminaire: 1 values; give 2"),
        (vec![vec![1.0, -1.0]], "luminaire: -1 in a band"),
    ] {
        let bands = Bands { luminaires, ..good() };
        let error = bands.check(&scene).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    Bands { luminaires: vec![vec![0.0, 3.0]], ..good() }.check(&scene).unwrap();
}

#[test]
fn what_the_bake_does_not_see_is_told() {
    let scene = cube(&Material::grey("wall", 0.5));
    let mut bands = Bands { materials: vec![BandMaterial::opaque(vec![0.5, 0.6]); 6], ..good() };
    assert!(bands.unseen_by(&scene).is_empty());
    bands.materials[3].exitance[1] = 1.0;
    assert_eq!(bands.unseen_by(&scene), ["wall"]);
    let black = cube(&Material::grey("black", 0.0));
    assert_eq!(bands.unseen_by(&black).len(), 6);
}

#[test]
fn a_break_ends_it_and_work_of_several_bakes_is_refused() {
    let baked = bake(cube(&glow()), 1.0, 64);
    assert!(good().light(&baked, |_, _| ControlFlow::Break(())).unwrap().is_none());
    let mut last = (0, 0);
    good()
        .light(&baked, |done, of| {
            assert!(done >= last.0 && done <= of);
            last = (done, of);
            ControlFlow::Continue(())
        })
        .unwrap();
    assert!(last.0 == last.1 && last.1 > 0);
    let mut mixed = baked.clone();
    mixed.light.surface = bake(cube(&glow()), 0.5, 64).light.surface;
    let error = good().light(&mixed, |_, _| ControlFlow::Continue(())).unwrap_err();
    assert!(error.to_string().contains("vertices"), "{error}");
}
