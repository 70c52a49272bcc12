//! Bands that are red, green and blue have the light of the bake itself.

use radiosity::bands::Bands;
use radiosity::{Backend, BakeResult, BakeTarget, Rgb, Scene, load_scene};

use super::light;
use crate::common::keep_going;

/// The root mean square over the area by which the reflected light of bands is off that of the
/// bake, over that of the bake; and the errors that both tell.
fn difference(baked: &BakeResult) -> [f64; 2] {
    let light = light(&Bands::of_rgb(baked.mesh.scene()), baked);
    let surface = &baked.light.surface;
    let (mut off, mut all) = (0.0, 0.0);
    for face in &surface.faces {
        let [a, b, c] = face.map(|v| surface.positions[v as usize]);
        let area = (b - a).cross(c - a).length();
        for v in face.map(|v| v as usize) {
            let of_bands = Rgb::from_slice(light.irradiance_at(v));
            off += area * (of_bands - surface.irradiance[v]).length_squared();
            all += area * surface.irradiance[v].length_squared();
        }
    }
    let told = light.errors.iter().map(|error| error.total).fold(0.0, f64::max);
    [(off / all).sqrt(), told]
}

fn check(scene: Scene, error: f64) {
    let baked = BakeTarget::Error(error).bake(scene, &Backend::Cpu, keep_going).unwrap();
    let [off, told] = difference(&baked);
    println!("{:.3} % off, {:.3} % told", 100.0 * off, 100.0 * told);
    // Both are off the truth by what they tell, on their own account.
    assert!(off < told * 2f64.sqrt(), "{off} off, {told} told");
}

#[test]
fn cornell_box_has_the_light_of_its_bake() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    check(load_scene(path).unwrap(), 0.05);
}
