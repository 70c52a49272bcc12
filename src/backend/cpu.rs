//! Rays on the CPU: rows of form factors, and light gathered at points, without a GPU;
//! [`Backend::Cpu`](crate::Backend::Cpu) uses it for whole bakes.
//!
//! For tests only, a twin of every shader: the same entry points in plain sequential Rust, with the
//! names of the WGSL files. The results of the device are compared with those of the twins pixel by
//! pixel.
//!
//! | shader | twin | compared in |
//! |---|---|---|
//! | `item_buffer.wgsl` | `item_buffer` | `gpu/rows/twin_tests.rs`: items equal |
//! | `reduce.wgsl` | `reduce` | `gpu/rows/twin_tests.rs`: integers equal |
//! | `rank_lights.wgsl` | `twins/rank_lights` | `gpu/traced_gather/twin_tests.rs`: rounding |
//! | `hemisphere_rays.wgsl` | `twins/hemisphere_rays` | the same, but for rays near an edge |
//! | `near_paths.wgsl` | `twins/near_paths` | the same |
//! | `light_rays.wgsl` | `twins/light_rays` | the same |
//! | `settle.wgsl` | `twins/settle` | the same decisions, samples within rounding |
//! | `row_rays.wgsl` | `twins/row_rays` | `gpu/traced_rows/twin_tests.rs`: but for edges |
//! | `compact_rows.wgsl` | `twins/compact_rows` | the same: entries equal |
//! | `shared/*.wgsl` | `shared`, `twins` | with the shaders that need them |

pub(crate) mod gather;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod item_buffer;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod rasterizer;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod reduce;
pub(crate) mod rows;
#[cfg(all(test, feature = "gpu"))]
mod shared;
#[cfg(all(test, feature = "gpu"))]
pub(super) mod twins;

pub use gather::RayGather;
pub use rows::RayRows;
