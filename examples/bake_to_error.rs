//! Lesson 2 of 9: a scene of your own, to an error or within a time.
//!
//!     cargo run --release --example bake_to_error -- SCENE.obj

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use radiosity::{Backend, BakeResult, BakeTarget, Error, load_scene, write_ply};

fn main() -> Result<(), Error> {
    let scenes = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    let scene = Arc::new(load_scene(std::env::args().nth(1).unwrap_or(scenes.into()))?);
    for warning in scene.warnings() {
        eprintln!("{warning}"); // what was repaired or looks wrong
    }
    let backend = Backend::gpu(None)?;

    // 5 % of the radiosity, root mean square over the area. All settings follow from it.
    let to_error = BakeTarget::Error(0.05);
    print("to 5 %", &to_error.bake(scene.clone(), &backend, |_| ControlFlow::Continue(()))?);

    // As exact as two seconds allow, with one of the settings chosen by hand.
    let in_time = BakeTarget::Time(Duration::from_secs(2));
    let settings = |settings: &mut radiosity::BakeSettings| settings.solve.near_reach = 2.0;
    let go = |_: &_| ControlFlow::Continue(());
    let baked = in_time.bake_with(scene, &backend, settings, go)?;
    print("in 2 s", &baked);
    write_ply("baked.ply", &baked.light.surface)
}

fn print(name: &str, baked: &BakeResult) {
    let error = baked.estimate;
    println!("{name}: {:.2} s, error {:.2} %", baked.timings.total(), 100.0 * error.total);
    let parts = [error.mesh, error.sampling, error.truncation, error.unshot].map(|e| 100.0 * e);
    println!("  of the mesh, of sampling, of bounces and light left out: {parts:.2?} %");
}
