//! Light in bands: closed forms, beside the bake in red, green and blue, and in any order.

mod checks;
mod closed_forms;
mod cornell_box;
mod order;
mod red_green_blue;

use radiosity::bands::{Band, BandLight, BandMaterial, Bands};
use radiosity::{Backend, BakeResult, BakeSettings, Material, Rgb, Scene};

use crate::common::{keep_counting, keep_going};

/// The scene baked on elements of `size` that are never split, with `rays` a vertex.
fn bake(scene: Scene, size: f64, rays: u32) -> BakeResult {
    let mut settings = BakeSettings::gathering(&scene);
    settings.solve.element_size = size;
    let gather = settings.gather.as_mut().unwrap();
    gather.element_size = size;
    gather.rays = rays;
    gather.refinement.mesh_error = 1.0;
    gather.refinement.interpolation_tolerance = f64::INFINITY;
    settings.bake(scene, &Backend::Cpu, keep_going).unwrap()
}

fn light(bands: &Bands, baked: &BakeResult) -> BandLight {
    bands.light(baked, keep_counting).unwrap().unwrap()
}

/// Bands without wavelengths, by their numbers.
fn numbered(count: usize) -> Vec<Band> {
    (0..count).map(|b| Band { name: b.to_string(), wavelength: None }).collect()
}

/// A material that reflects and emits this.
fn glowing(reflectance: Vec<f64>, exitance: Vec<f64>) -> BandMaterial {
    BandMaterial { exitance, ..BandMaterial::opaque(reflectance) }
}

/// The largest of some numbers.
fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().fold(0.0, f64::max)
}

/// A surface that reflects half of the light and emits some, in red, green and blue.
fn glow() -> Material {
    Material { exitance: Rgb::ONE, ..Material::grey("glow", 0.5) }
}
