//! The tone curve: exposure from the logarithmic mean, highlights rolled off, sRGB.

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
    // Reinhard et al. (2002), equation 1: the logarithmic mean is exposed to the key, 0.24. White
    // is at 1 then, and equation 4 leaves 0.24 (1 + 0.24/1²)/(1 + 0.24) = 0.24. In sRGB (IEC
    // 61966-2-1) that is 1.055 · 0.24^(1/2.4) − 0.055 = 0.5271, 134.4 of 255.
    for radiance in [1e-6, 1.0, 7.0, 1e6] {
        assert_eq!(shown([radiance]), [134], "{radiance}");
    }
}

#[test]
fn curve_is_linear_up_to_white_at_one() {
    // The logarithmic mean is 1: exposed 0.06 and 0.96, below white at 1, so that nothing is rolled
    // off. In sRGB 0.2717 and 0.9822: 69.3 and 250.5 of 255.
    assert_eq!(shown([0.25, 4.0]), [69, 250]);
}

#[test]
fn highlights_roll_off_to_white() {
    // Exposed 0.03 and 1.92, which is white: 1.92 (1 + 1.92/1.92²)/(1 + 1.92) = 1 exactly. The dark
    // one: 0.03 (1 + 0.03/1.92²)/1.03 = 0.02936, in sRGB 0.1876, 47.8 of 255.
    assert_eq!(shown([0.125, 8.0]), [48, 255]);
}

#[test]
fn lamps_burn_out_beyond_eight_means() {
    // Exposed 0.0024 and 24: white stays at 8 · 0.24 = 1.92 and the lamp is clipped. The dark one:
    // 0.0024 (1 + 0.0024/1.92²)/1.0024 = 0.002396, in the straight part of sRGB: 12.92 times that,
    // 7.9 of 255.
    assert_eq!(shown([0.01, 100.0]), [8, 255]);
}

#[test]
fn exposure_weighs_channels_by_luminance() {
    // BT.709: green has 0.7152 of the luminance, so that 0.24/0.7152 = 0.3356 of it is shown, in
    // sRGB 0.6144, 156.7 of 255. As dark as that, red would be shown at 0.24/0.2126 > 1: clipped.
    for (colour, display) in [(Rgb::Y, [0, 157, 0]), (Rgb::X, [255, 0, 0])] {
        assert_eq!(ToneCurve::fit(&[colour]).display(colour), display);
    }
}

#[test]
fn black_pixels_do_not_count() {
    let grey = Rgb::splat(0.3);
    assert_eq!(ToneCurve::fit(&[Rgb::ZERO, grey, Rgb::ZERO]), ToneCurve::fit(&[grey]));
    assert_eq!(ToneCurve::fit(&[grey]).display(Rgb::ZERO), [0; 3]);
    for none in [&[][..], &[Rgb::ZERO]] {
        assert_eq!(ToneCurve::fit(none).display(Rgb::ZERO), [0; 3]);
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
    // The tone curve has no unit of light: the same but for rounding, which a byte hardly shows.
    for radiosity in [1e-30, 1e30] {
        let pairs = of(1.0).into_iter().zip(of(radiosity));
        assert!(pairs.into_iter().all(|(a, b)| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1)));
    }
}
