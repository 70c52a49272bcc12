//! Lesson 6 of 9: the best picture of a bake: every pixel gathers the light of the surface that it
//! sees, rather than interpolate between vertices. Shadows are sharp whatever the mesh.
//!
//!     cargo run --release --example camera_image

use std::ops::ControlFlow;

use glam::DVec3;
use radiosity::{Backend, BakeTarget, Camera, Error, load_scene, write_exr, write_png};

fn main() -> Result<(), Error> {
    let scene = load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj"))?;
    let backend = Backend::gpu(None)?;
    // A coarse bake is enough: its error is seen only by way of a reflection.
    let baked = BakeTarget::Error(0.05).bake(scene, &backend, |_| ControlFlow::Continue(()))?;
    let camera = Camera {
        eye: DVec3::new(278.0, 273.0, -800.0),
        target: DVec3::new(278.0, 273.0, 0.0),
        up: DVec3::Y,
        vertical_fov: 39.3077,
    };
    let mut gather = backend.gather(&baked.light.mesh, 512)?; // rays a pixel
    let progress = |done, of| {
        eprint!("\r{} % ", 100 * done / of);
        ControlFlow::Continue(())
    };
    // 4 × 4 lines of sight a pixel; those that meet the same smooth surface share a gather.
    let image = camera.gathered_image(&baked.light, &mut *gather, 256, 256, 4, progress)?;
    let image = image.expect("only a Break of the callback leaves none");
    write_exr("camera_image.exr", &image)?;
    write_png("camera_image.png", &image)
}
