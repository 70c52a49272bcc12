//! Rays on the CPU: rows of form factors, and light gathered at points. Nothing of it needs a GPU;
//! [`Backend::Cpu`](crate::Backend::Cpu) uses it for whole bakes.
//!
//! Beside them, for tests alone, a twin of every shader: the same entry points in plain sequential
//! Rust, named as the WGSL files are, which the device's results are compared with pixel by pixel.
//!
//! | shader | twin | compared in |
//! |---|---|---|
//! | `item_buffer.wgsl` | `item_buffer` | `gpu/rows/twin_tests.rs`: items equal |
//! | `reduce.wgsl` | `reduce` | `gpu/rows/twin_tests.rs`: integers equal |
//! | `shared/*.wgsl` | `shared` | with the draw shaders |

mod gather;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod item_buffer;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod rasterizer;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod reduce;
pub(crate) mod rows;
#[cfg(all(test, feature = "gpu"))]
mod shared;

pub use gather::RayGather;
pub use rows::RayRows;
