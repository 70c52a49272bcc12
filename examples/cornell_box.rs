//! The Cornell box, from OBJ to per-vertex radiosity and a picture. No arguments; writes
//! `cornell_box.ply`, `.exr`, `.png` and `.json` to the current folder.
//!
//!     cargo run --release --example cornell_box

mod support;

use glam::DVec3;
use radiosity::Camera;

fn main() -> Result<(), radiosity::Error> {
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let bake = support::Bake {
        out: "cornell_box".into(),
        changes: vec![Box::new(|settings| settings.solve.element_size = 30.0)],
        camera: Some(Camera {
            eye: DVec3::new(278.0, 273.0, -800.0),
            target: DVec3::new(278.0, 273.0, 0.0),
            vertical_fov: 39.3077,
        }),
        ..support::Bake::new(scene)
    };
    let report = bake.run()?;
    println!("{}", support::table(&report));
    println!("wrote      cornell_box.ply, .exr, .png and .json");
    Ok(())
}
