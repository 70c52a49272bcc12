//! Lesson 1 of 9: the Cornell box, from an OBJ file to radiosity at vertices and a picture. Writes
//! `cornell_box.ply`, `.exr` and `.png` to the current folder.
//!
//!     cargo run --release --example cornell_box

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::bake::BakeProgress;
use radiosity::{Backend, BakeTarget, Camera, load_scene, write_exr, write_ply, write_png};

fn main() -> Result<(), radiosity::Error> {
    let scene = load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj"))?;
    let backend = Backend::gpu(None)?; // the best adapter; Backend::Cpu does without one
    eprintln!("baking on {}", backend.adapter().name);
    let baked = BakeTarget::Error(0.015).bake(scene, &backend, |stage| {
        match stage {
            BakeProgress::Shooting(p) => eprint!("\r{:7.3} % unshot ", 100.0 * p.unshot_share),
            BakeProgress::Gathering(p) => eprint!("\r{} of {} vertices   ", p.gathered, p.total),
            BakeProgress::Estimating { samples, of } => eprint!("\r{samples} of {of} points      "),
            _ => {}
        }
        ControlFlow::Continue(()) // Break(()) stops with what there is
    })?;
    let surface = &baked.light.surface; // positions, faces, radiosity
    eprintln!("\nerror about {:.1} %", 100.0 * baked.estimate.total);
    write_ply("cornell_box.ply", surface)?;
    let camera = Camera {
        eye: DVec3::new(278.0, 273.0, -800.0), // millimetres, as the scene
        target: DVec3::new(278.0, 273.0, 0.0),
        up: DVec3::Y,
        vertical_fov: 39.3077, // degrees
    };
    let image = camera.image(surface, 512, 512, 4)?; // 4 × 4 rays a pixel
    write_exr("cornell_box.exr", &image)?; // linear radiance, W/(m² sr)
    write_png("cornell_box.png", &image) // tone mapped
}
