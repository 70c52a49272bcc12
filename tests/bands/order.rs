//! A band is the same, to the last bit, in any order and whichever others there are.

use radiosity::bands::{BandLight, BandMaterial, Bands};
use radiosity::load_scene;

use super::{bake, light, numbered};

/// Those of `bands` that are `chosen`, in that order.
fn selection(bands: &Bands, chosen: &[usize]) -> Bands {
    let values = |values: &[f64]| chosen.iter().map(|&b| values[b]).collect::<Vec<_>>();
    let material = |m: &BandMaterial| BandMaterial {
        reflectance: values(&m.reflectance),
        transmittance: values(&m.transmittance),
        exitance: values(&m.exitance),
    };
    Bands {
        bands: chosen.iter().map(|&b| bands.bands[b].clone()).collect(),
        materials: bands.materials.iter().map(material).collect(),
        sky: values(&bands.sky),
        sun: values(&bands.sun),
        luminaires: bands.luminaires.iter().map(|lamp| values(lamp)).collect(),
    }
}

/// All that is told of band `b`, bit by bit.
fn bits(light: &BandLight, b: usize) -> Vec<u64> {
    let of_vertices = [&light.radiosity, &light.irradiance, &light.noise];
    let values = of_vertices.into_iter().flat_map(|v| v.iter().skip(b).step_by(light.bands.len()));
    let error = light.errors[b];
    let whole = [error.total, error.noise, error.remainder, f64::from(light.sweeps[b])];
    values.chain(&whole).map(|value| value.to_bits()).collect()
}

#[test]
fn bands_have_the_same_bits_in_any_order_and_company() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let baked = bake(load_scene(path).unwrap(), 300.0, 64);
    // Each wall its own slope over nine bands, black in some; the lamp emits in all but the first.
    let walls = baked.mesh.scene().materials().iter().enumerate().map(|(m, material)| {
        let reflectance = (0..9).map(|b| ((b * (m + 1)) % 10) as f64 / 10.0).collect();
        let mut of_bands = BandMaterial::opaque(reflectance);
        if material.name == "light" {
            of_bands.exitance = (0..9).map(f64::from).collect();
        }
        of_bands
    });
    let mut bands = Bands { materials: walls.collect(), ..Bands::dark(numbered(9)) };
    bands.sky = (0..9).map(|b| f64::from(b % 3) / 10.0).collect();
    let all = light(&bands, &baked);
    assert!(all.radiosity.iter().any(|&b| b > 0.0));
    for chosen in [&[8, 3, 5, 0, 7, 1, 6, 2, 4][..], &[4, 2, 8], &[0], &[6], &[1, 7]] {
        let some = light(&selection(&bands, chosen), &baked);
        for (b, &of_all) in chosen.iter().enumerate() {
            assert!(bits(&some, b) == bits(&all, of_all), "band {of_all} among {chosen:?}");
        }
    }
    let one_thread = on_one_thread(|| light(&bands, &baked));
    assert!((0..9).all(|b| bits(&one_thread, b) == bits(&all, b)));
}

/// What `work` gives on a single thread.
fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap().install(work)
}
