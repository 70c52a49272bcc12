//! Lesson 1 of 8: the Cornell box, from an OBJ file to radiosity at vertices and a picture. Writes
//! `cornell_box.ply`, `.exr` and `.png` to the current folder.
//!
//!     cargo run --release --example cornell_box

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::{Backend, BakeTarget, Camera, Error, load_obj, write_exr, write_ply, write_png};

fn main() -> Result<(), Error> {
    let scene = load_obj(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj"))?;
    let device = Backend::gpu(None)?; // or Backend::Cpu
    let baked = BakeTarget::Error(0.02).bake(scene, &device, |_| ControlFlow::Continue(()))?;
    write_ply("cornell_box.ply", &baked.light.surface)?;
    let camera = Camera {
        eye: DVec3::new(278.0, 273.0, -800.0),
        target: DVec3::new(278.0, 273.0, 0.0),
        vertical_fov: 39.3077, // degrees
    };
    let image = camera.image(&baked.light.surface, 512, 512, 4)?;
    write_exr("cornell_box.exr", &image)?; // radiance, W/(m² sr)
    write_png("cornell_box.png", &image) // to look at
}
