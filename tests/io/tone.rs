//! The tone curve: exposure from the median, highlights rolled off, sRGB.

use radiosity::camera::RadianceImage;
use radiosity::io::ToneCurve;
use radiosity::{Camera, Rgb};

use crate::common::framed::{self, HERE};

/// What greys of these radiances are shown as in one picture.
fn shown<const N: usize>(radiances: [f64; N]) -> [u8; N] {
    let greys = radiances.map(Rgb::splat);
    let tone = ToneCurve::fit(&greys);
    greys.map(|grey| {
        let [red, green, blue] = tone.display(grey);
        assert!(red == green && green == blue, "{red} {green} {blue}");
        red
    })
}

#[test]
fn even_picture_is_shown_at_the_key() {
    // The median is exposed to the key, 0.28, and white is at 8 · 0.28 = 2.24. Reinhard et al.
    // (2002), equation 4, makes that 0.28 (1 + 0.28/2.24²)/(1 + 0.28) = 0.23096. In sRGB (IEC
    // 61966-2-1) that is 1.055 · 0.23096^(1/2.4) − 0.055 = 0.51784, 132.05 of 255.
    for radiance in [1e-6, 1.0, 7.0, 1e6] {
        assert_eq!(shown([radiance]), [132], "{radiance}");
    }
}

#[test]
fn median_is_exposed_to_the_key_whatever_else_is_in_view() {
    // A lamp and a deep shadow, each on up to half of the picture less one, of any radiance.
    for other in [1e-300, 1e-6, 1e6, 1e300] {
        assert_eq!(shown([1.0, 1.0, 1.0, other, other])[0], 132, "{other}");
    }
    // Of an even number the upper one of the two in the middle.
    assert_eq!(shown([0.5, 1.0])[1], 132);
}

#[test]
fn highlights_roll_off_to_white_at_eight_medians() {
    // Exposed 2.24, which is white: 2.24 (1 + 2.24/2.24²)/(1 + 2.24) = 1 exactly. At four medians,
    // 1.12: 1.12 (1 + 1.12/5.0176)/2.12 = 0.64622, in sRGB 0.82457, 210.3 of 255. An eighth of the
    // median, 0.035: 0.035 (1 + 0.035/5.0176)/1.035 = 0.03405, in sRGB 0.20291, 51.7 of 255.
    assert_eq!(shown([1.0, 1.0, 1.0, 8.0, 80.0])[3..], [255, 255]);
    assert_eq!(shown([1.0, 1.0, 1.0, 4.0, 0.125])[3..], [210, 52]);
}

#[test]
fn exposure_weighs_channels_by_luminance() {
    // BT.709: green has 0.7152 of the luminance, so that 0.23096/0.7152 = 0.32293 of it is shown,
    // in sRGB 0.60370, 153.9 of 255. As dark as that, red would be shown at 0.23096/0.2126 > 1:
    // clipped.
    for (colour, display) in [(Rgb::Y, [0, 154, 0]), (Rgb::X, [255, 0, 0])] {
        assert_eq!(ToneCurve::fit(&[colour]).display(colour), display);
    }
}

#[test]
fn radiosity_is_shown_as_its_radiance() {
    let tone = ToneCurve::fit(&[Rgb::splat(2.0)]);
    let radiance = Rgb::new(0.3, 1.0, 4.0);
    let (a, b) =
        (tone.linear(radiance), tone.of_radiosity().linear(radiance * std::f64::consts::PI));
    // Two roundings.
    assert!((a - b).abs().max_element() < 1e-15, "{a} {b}");
    assert!(a.cmpge(Rgb::ZERO).all() && a.cmple(Rgb::ONE).all());
}

#[test]
fn an_exposure_that_is_given_counts() {
    let fitted = ToneCurve::fit(&[Rgb::splat(2.0)]);
    assert_eq!(ToneCurve::with_exposure(fitted.exposure()), fitted);
    // Twice the exposure shows what half the light does.
    let (once, twice) = (ToneCurve::with_exposure(0.5), ToneCurve::with_exposure(1.0));
    assert_eq!(twice.linear(Rgb::splat(0.3)), once.linear(Rgb::splat(0.6)));
}

#[test]
fn black_pixels_do_not_count() {
    let grey = Rgb::splat(0.3);
    assert_eq!(ToneCurve::fit(&[Rgb::ZERO, grey, Rgb::ZERO]), ToneCurve::fit(&[grey]));
    assert_eq!(ToneCurve::fit(&[grey]).display(Rgb::ZERO), [0; 3]);
    // Nor does the sky in a picture, however much of it there is; if there is no more, it does.
    let sky = Rgb::new(3.0, 4.0, 5.0);
    let with_sky = |pixels: Vec<Rgb>| {
        let sky = pixels.iter().map(|&pixel| pixel == sky).collect();
        let image = RadianceImage { width: 4, height: 1, pixels, sky };
        ToneCurve::fit_image(&image)
    };
    assert_eq!(with_sky(vec![sky, grey, sky, sky]), ToneCurve::fit(&[grey]));
    assert_eq!(with_sky(vec![sky; 4]), ToneCurve::fit(&[sky]));
    for none in [&[][..], &[Rgb::ZERO]] {
        assert_eq!(ToneCurve::fit(none).display(Rgb::ZERO), [0; 3]);
    }
    // As dark as numbers get, and as bright: no division by zero, nothing that is not a number.
    for radiance in [f64::from_bits(1), f64::MIN_POSITIVE, f64::MAX / 4.0] {
        let grey = Rgb::splat(radiance);
        let tone = ToneCurve::fit(&[grey]);
        assert!(tone.exposure().is_finite() && tone.linear(grey).is_finite(), "{radiance}");
    }
}

#[test]
fn picture_is_independent_of_exitance() {
    let [eye, target] = [[0.9, 0.2, 0.5], [0.2, 0.5, 0.4]].map(|p| HERE.place(p).into());
    let camera = Camera { eye, target, up: Rgb::Y, vertical_fov: 60.0 };
    let of = |radiosity: f64| {
        let image = camera.image(&framed::even_surface(HERE, radiosity), 16, 16, 1).unwrap();
        let tone = ToneCurve::fit(&image.pixels);
        image.pixels.iter().map(|&c| tone.display(c)).collect::<Vec<_>>()
    };
    assert!(of(1.0).iter().any(|c| c[0] > 50));
    // Scaled by a power of two nothing is rounded: the same bytes.
    for scale in [2f64.powi(-20), 2f64.powi(20)] {
        assert_eq!(of(scale), of(1.0));
    }
    // The tone curve has no unit of light: the same but for rounding, which a byte hardly shows.
    for radiosity in [1e-30, 1e-6, 1e6, 1e30] {
        let pairs = of(1.0).into_iter().zip(of(radiosity));
        assert!(pairs.into_iter().all(|(a, b)| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1)));
    }
}
