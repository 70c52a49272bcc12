//! The spectra that were measured in the Cornell box add up to the colours of its MTL file.

use radiosity::bands::Band;
use radiosity::bands::cie::Observer;
use serde_json::Value;

/// The illuminant D65 from 400 to 700 nm by 10 (CIE 15): reflectances were reduced under it.
const D65: [f64; 31] = [
    82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811,
    109.354, 107.802, 104.79, 107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062,
    89.5991, 87.6987, 83.2886, 83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
];

/// The value at `nm` of a table from 400 nm on by `step`, linear in between.
fn linear(table: &[f64], step: f64, nm: f64) -> f64 {
    let k = (((nm - 400.0) / step) as usize).min(table.len() - 2);
    let t = (nm - 400.0) / step - k as f64;
    table[k] * (1.0 - t) + table[k + 1] * t
}

#[test]
fn measured_spectra_have_the_colours_of_the_material_file() {
    let text = include_str!("../../scenes/cornell_box.bands.json");
    let file: Value = serde_json::from_str(text).unwrap();
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let wavelengths = numbers(&file["bands"]);
    assert_eq!(wavelengths, (400..=700).step_by(4).map(f64::from).collect::<Vec<_>>());
    let band = |nm: &f64| Band { name: nm.to_string(), wavelength: Some(*nm) };
    let observer = Observer::new(&wavelengths.iter().map(band).collect::<Vec<_>>()).unwrap();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let scene = radiosity::load_scene(path).unwrap();
    let material = |name: &str| scene.materials().iter().find(|m| m.name == name).unwrap();
    let daylight: Vec<f64> = wavelengths.iter().map(|&nm| linear(&D65, 10.0, nm)).collect();
    let white = observer.linear_srgb(&daylight);
    for name in ["white", "red", "green"] {
        let spectrum = numbers(&file["materials"][name]["reflectance"]);
        let reflected: Vec<f64> = spectrum.iter().zip(&daylight).map(|(r, e)| r * e).collect();
        let colour = observer.linear_srgb(&reflected) / white;
        let off = colour - material(name).reflectance;
        // The fit of the observer's functions is off by up to 1 % of their tops.
        assert!(off.abs().max_element() < 0.01, "{name}: {colour}, off by {off}");
    }
    let emission = ["400", "500", "600", "700"]
        .map(|nm| file["materials"]["light"]["emission"][nm].as_f64().unwrap());
    let lamp = |&nm: &f64| linear(&emission, 100.0, nm);
    let radiance = observer.linear_srgb(&wavelengths.iter().map(lamp).collect::<Vec<_>>());
    let told = material("light").exitance / std::f64::consts::PI;
    assert!(((radiance - told) / told).abs().max_element() < 0.01, "{radiance} for {told}");
}
