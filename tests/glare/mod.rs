//! The unified glare rating, against closed forms.

use std::f64::consts::PI;
use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::glare::{Glare, Observer, position_index};
use radiosity::scene::{IntensityDistribution, Luminaire, Opening};
use radiosity::{ErrorKind, Material, Rgb, Scene};

use crate::common::quads;
use crate::common::scenes::{facing_down, grey, lamp, walls};

const OBSERVER: Observer = Observer { eye: DVec3::ZERO, direction: DVec3::X, up: DVec3::Z };

fn glare(scene: &Scene, observer: &Observer) -> Glare {
    Glare::of(scene, observer, |_, _| ControlFlow::Continue(())).unwrap().unwrap()
}

/// A flat lamp of 0.2 m by 0.2 m, 5 m before the observer and 2 m above, whose exitance is π times
/// 1000 cd/m².
fn below_a_lamp() -> Scene {
    let quad = facing_down([4.9, 5.1], [-0.1, 0.1], 2.0);
    quads(&[(quad, lamp([1000.0 * PI; 3]))])
}

/// In the open under a sky of 50 cd/m²: L_b is that, less what the lamp covers.
#[test]
fn rating_of_one_lamp_is_its_closed_form() {
    let scene = below_a_lamp().with_sky(Rgb::splat(50.0)).unwrap();
    let found = glare(&scene, &OBSERVER);
    // A cos/d² at the middle of the lamp, whose size is 4 % of its distance: within the square of
    // that, 1.4e-3.
    let (d2, omega) = (29.0f64, 0.04 * 2.0 / 29f64.powf(1.5));
    let [source] = &found.sources[..] else { panic!("{found:?}") };
    assert!((source.luminance - 1000.0).abs() < 1e-9 && source.name == "q0", "{source:?}");
    assert!((source.solid_angle / omega - 1.0).abs() < 1.4e-3, "{source:?} {omega}");
    // Straight above the line of sight: ln p = 33.98e-3 σ + 21e-5 σ², σ = atan 2/5 = 21.8014°.
    let p = (33.98e-3 * 21.801_409 + 21e-5 * 21.801_409f64.powi(2)).exp();
    assert!((source.position_index / p - 1.0).abs() < 1e-3, "{source:?} {p}");
    // The lamp covers ω cos σ/π of the eye's field, below the 0.5 % that L_b is found to.
    let background = 50.0 * (1.0 - omega * 5.0 / d2.sqrt() / PI);
    let off = (found.background.luminance - background).abs();
    assert!(off <= 4.0 * found.background.standard_error, "{found:?}");
    assert!(found.background.standard_error <= 0.005 * background);
    let truth = 8.0 * (0.25 / background * 1e6 * omega / (p * p)).log10();
    let rating = found.rating().unwrap();
    // 8/ln 10 of 1.4e-3 + 2 · 1e-3, and four standard errors.
    assert!((rating - truth).abs() < 0.012 + 4.0 * found.standard_error(), "{rating} {truth}");
    // Four times the luminance is 8 log₁₀ 16 more; the background four times as bright 8 log₁₀ 4
    // less, with the same random numbers.
    let bright = quads(&[(facing_down([4.9, 5.1], [-0.1, 0.1], 2.0), lamp([4000.0 * PI; 3]))]);
    let bright = glare(&bright.with_sky(Rgb::splat(50.0)).unwrap(), &OBSERVER).rating().unwrap();
    assert!((bright - rating - 8.0 * 16f64.log10()).abs() < 1e-9);
    let day = glare(&scene.with_sky(Rgb::splat(200.0)).unwrap(), &OBSERVER).rating().unwrap();
    assert!((rating - day - 8.0 * 4f64.log10()).abs() < 1e-9);
}

/// Walls that emit E and reflect ρ all around: they reflect ρ E/(1 − ρ), and π L_b is that.
#[test]
fn background_of_a_furnace_is_what_its_walls_reflect() {
    let shiny = Material { exitance: Rgb::ONE, ..Material::grey("shiny", 0.6) };
    let parts = walls([0.0; 3], [2.0, 3.0, 2.5]).map(|wall| (wall, shiny.clone()));
    let observer = Observer { eye: DVec3::new(0.7, 1.1, 1.2), ..OBSERVER };
    let found = glare(&quads(&parts), &observer);
    let (off, truth) = (found.background, 0.6 / 0.4 / PI);
    assert!((off.luminance - truth).abs() < 4.0 * off.standard_error, "{off:?} {truth}");
    // All walls hang together; half of the sphere around the eye is in front of it.
    let [source] = &found.sources[..] else { panic!("{found:?}") };
    // 341 points a triangle: of those whose middle the edge of the field crosses, a row of 18 or
    // so is in or out, 1/18 of a quarter of all.
    assert!((source.solid_angle / (2.0 * PI) - 1.0).abs() < 0.25 / 18.0 + 0.005, "{source:?}");
}

/// Intensity over the projected opening is the luminance; shadows and sources behind do not count.
#[test]
fn luminaires_count_as_far_as_they_are_seen() {
    let even = IntensityDistribution::isotropic(100.0).unwrap();
    let mut lamp = Luminaire::new(even, DVec3::new(4.0, 0.0, 3.0), DVec3::NEG_Z);
    lamp.opening = Opening { size: DVec3::new(0.3, 0.2, 0.0), is_round: false };
    let behind = Luminaire { position: DVec3::new(-4.0, 0.0, 3.0), ..lamp.clone() };
    let point = Luminaire { opening: Opening::default(), ..lamp.clone() };
    let open = |more: &[_]| {
        let mut parts = vec![(facing_down([90.0, 91.0], [0.0, 1.0], 0.0), grey())];
        parts.extend_from_slice(more);
        let scene = quads(&parts).with_sky(Rgb::splat(20.0)).unwrap();
        scene.with_luminaires(vec![lamp.clone(), behind.clone(), point.clone()]).unwrap()
    };
    let found = glare(&open(&[]), &OBSERVER);
    let [source] = &found.sources[..] else { panic!("{found:?}") };
    let area = 0.06 * 3.0 / 5.0;
    assert!((source.luminance / (100.0 / area) - 1.0).abs() < 1e-12, "{source:?}");
    assert!((source.solid_angle / (area / 25.0) - 1.0).abs() < 1e-12, "{source:?}");
    assert_eq!(
        (&found.behind[..], &found.without_size[..]),
        (&["luminaire 2".to_string()][..], &["luminaire 3".to_string()][..])
    );
    // A shutter half-way hides what lies on one side of the middle.
    let shutter = facing_down([1.0, 3.0], [0.0, 9.0], 1.5);
    let half = glare(&open(&[(shutter, grey())]), &OBSERVER);
    // 256 points evenly on both sides: (0, 2)-nets are exact.
    assert!((half.sources[0].solid_angle / source.solid_angle - 0.5).abs() < 1e-12, "{half:?}");
    assert!((half.sources[0].luminance / source.luminance - 1.0).abs() < 1e-12);
}

#[test]
fn without_a_source_there_is_no_rating() {
    let scene = below_a_lamp().with_sky(Rgb::splat(50.0)).unwrap();
    let away = Observer { direction: DVec3::NEG_X, ..OBSERVER };
    let found = glare(&scene, &away);
    assert!(found.rating().is_none() && found.sources.is_empty(), "{found:?}");
    assert_eq!(found.behind, ["q0"]);
    // In the dark it is undefined too.
    let dark = glare(&below_a_lamp(), &OBSERVER);
    assert!(dark.rating().is_none() && dark.sources.len() == 1, "{dark:?}");
    let bad = Observer { direction: DVec3::Z, ..OBSERVER };
    let error = Glare::of(&scene, &bad, |_, _| ControlFlow::Continue(())).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::Setting);
}

/// Guth's table as CIE 117 has it (table 4.1): p by T/R and H/R, with σ and τ of those.
#[test]
fn position_index_is_that_of_guths_table() {
    let at = |t: f64, h: f64| position_index(&OBSERVER, DVec3::new(1.0, t, h).normalize()).unwrap();
    // The formula is a fit to curves: the table has two decimals, and differs by up to 4 %.
    for (t, h, p) in [(0.0, 0.0, 1.0), (0.0, 0.5, 2.86), (0.0, 1.0, 7.0), (1.0, 0.0, 2.11)] {
        assert!((at(t, h) / p - 1.0).abs() < 0.04, "{t} {h}: {} {p}", at(t, h));
    }
    assert!((at(0.0, -0.5) - 1.4).abs() < 1e-12 && (at(0.0, -1.0) - 2.2).abs() < 1e-12);
    assert_eq!(position_index(&OBSERVER, DVec3::Y), None);
}
