//! The only module that uses wgpu: device, item buffer, reduction and rays; its results are rows
//! and gathered light.

mod adapters;
mod clock;
mod compacted_rows;
mod device;
mod draw_list;
mod error;
mod field;
mod item_buffer;
mod item_table;
pub(crate) mod layout;
mod limits;
mod memory;
mod pipeline;
mod reduce;
mod render_targets;
mod resolution;
mod rows;
mod shaders;
mod slots;
mod split_float;
#[cfg(test)]
mod test_support;
mod traced_gather;
mod traced_rows;
pub(super) mod traced_scene;
mod tracing;
mod wait;

pub use crate::backend::adapter::AdapterInfo;
pub use device::Gpu;
pub(crate) use error::check_hemicubes_see;
pub use limits::GpuLimits;
pub use rows::HemicubeRows;
pub use traced_gather::TracedGather;
pub use traced_rows::TracedRows;
#[cfg(target_family = "wasm")]
pub use wait::{BlockOn, set_block_on};
