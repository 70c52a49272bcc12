//! The tone curve.

use radiosity::Camera;

use crate::common::framed::{self, HERE};

#[test]
fn picture_is_independent_of_exitance() {
    let [eye, target] = [[0.9, 0.2, 0.5], [0.2, 0.5, 0.4]].map(|p| HERE.place(p).into());
    let camera = Camera { eye, target, vertical_fov: 60.0 };
    let of = |radiosity: f64| {
        let image = camera.image(&framed::even_surface(HERE, radiosity), 16, 16, 1).unwrap();
        let tone = radiosity::ToneCurve::fit(&image.pixels);
        image.pixels.iter().map(|&c| tone.display(c)).collect::<Vec<_>>()
    };
    assert!(of(1.0).iter().any(|c| c[0] > 50));
    // The tone curve has no unit of light: the same but for rounding, which a byte hardly shows.
    for radiosity in [1e-30, 1e30] {
        let pairs = of(1.0).into_iter().zip(of(radiosity));
        assert!(pairs.into_iter().all(|(a, b)| (0..3).all(|k| a[k].abs_diff(b[k]) <= 1)));
    }
}
