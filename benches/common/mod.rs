//! What the benches share: the scene, the adapter, and which benches were asked for.
// Each bench uses a part of it.
#![allow(dead_code)]

use std::ops::ControlFlow;

use radiosity::{AdapterInfo, Backend, Mesh, Scene, load_obj};

/// The Cornell box that ships with the crate; its unit is the millimetre.
pub fn cornell_box() -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    load_obj(path).expect("the scene loads")
}

/// The Cornell box in elements of at most `size` millimetres.
pub fn cornell_mesh(size: f64) -> Mesh {
    Mesh::new(cornell_box(), size).expect("a good size")
}

/// The graphics adapter, whose name is printed: no number means anything without it.
pub fn gpu() -> Backend {
    let backend = Backend::gpu(None).expect("a graphics adapter");
    let AdapterInfo { name, kind, driver } = backend.adapter();
    eprintln!("adapter: {name} ({kind}), {driver}");
    backend
}

/// Progress that never stops the work.
pub fn go<T>(_: &T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Whether all of a bench is to run: `RADIOSITY_BENCH=full cargo bench --bench NAME`.
pub fn full() -> bool {
    std::env::var("RADIOSITY_BENCH").is_ok_and(|which| which == "full")
}
