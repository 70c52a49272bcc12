//! What the benches share: scenes, the adapter, and which benches were asked for.
//!
//! `cargo bench` runs what takes seconds, `RADIOSITY_BENCH=full cargo bench --bench NAME` all of
//! one.
#![allow(dead_code, reason = "each bench uses a part of it")]

#[path = "../../tests/common/scenes.rs"]
pub mod scenes;
#[path = "../../tests/common/truth.rs"]
pub mod truth;

use std::ops::ControlFlow;
use std::time::Duration;

use criterion::Criterion;
use radiosity::backend::AdapterInfo;
use radiosity::{Gpu, Scene, load_scene};

/// The Cornell box that ships with the crate; its unit is the millimetre.
pub fn cornell_box() -> Scene {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    load_scene(path).expect("the scene loads")
}

/// The graphics adapter. Its name is printed: times mean nothing without it.
pub fn gpu() -> Gpu {
    let gpu = Gpu::new(None).expect("a graphics adapter");
    let AdapterInfo { name, kind, driver } = gpu.adapter();
    eprintln!("adapter: {name} ({kind}), {driver}");
    gpu
}

/// A progress callback that never stops the work.
pub fn keep_going<T>(_: &T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Ten samples, each of a few milliseconds or one iteration: enough for 5 %.
pub fn criterion() -> Criterion {
    Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(100))
        .measurement_time(Duration::from_secs(1))
}

/// Whether all of a bench was asked for.
pub fn full() -> bool {
    std::env::var("RADIOSITY_BENCH").is_ok_and(|which| which == "full")
}

/// Whether a bench that runs in full only was asked for; says so if not.
pub fn asked_for(name: &str) -> bool {
    if !full() {
        println!("{name}: left out; RADIOSITY_BENCH=full cargo bench --bench {name} runs it");
    }
    full()
}
