//! What the tests share: scenes with known answers, sources of rows, and the graphics device.
#![allow(dead_code, reason = "each test program uses a part of it")]

pub mod changes;
pub mod closed_forms;
pub mod cut_outs;
pub mod device_rays;
pub mod fakes;
pub mod files;
pub mod framed;
#[cfg(feature = "glb")]
pub mod gltf;
pub mod hemicubes;
pub mod measures;
pub mod processes;
pub mod scenes;
pub mod surface;
pub mod textured;
pub mod truth;
pub mod view_factors;
pub mod weather;

use std::ops::ControlFlow;

use radiosity::Gpu;

#[allow(unused_imports, reason = "each test program uses a part of it")]
pub use scenes::{cornell_box, cube, quads};

/// The graphics device. Tests that need one fail where there is none, and are ignored where
/// RADIOSITY_NO_GPU is set (see `build.rs`).
pub fn gpu() -> Gpu {
    Gpu::new(None).expect("a graphics adapter; RADIOSITY_NO_GPU=1 ignores tests that need one")
}

/// A progress callback that never stops the work.
pub fn keep_going<T>(_: &T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// The same for callbacks that hear how much is done, of how much.
pub fn keep_counting<N>(_: N, _: N) -> ControlFlow<()> {
    ControlFlow::Continue(())
}
