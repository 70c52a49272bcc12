//! The one room that knows wgpu: device, item buffer, reduction; hemicubes come out as
//! rows, or as the light that they gather.

mod adapters;
mod device;
mod draw_list;
mod error;
mod field;
mod gather;
mod hemisphere_sum;
mod item_buffer;
mod item_table;
pub(crate) mod layout;
mod limits;
mod memory;
mod pipeline;
mod radiance;
mod readback;
mod reduce;
mod render_targets;
mod resolution;
mod rows;
mod shaders;
mod sky;
mod sources;
mod split_float;
mod traced_gather;
mod traced_rows;
mod traced_scene;
mod tracing;
#[cfg(test)]
mod test_support;

pub use crate::backend::adapter::AdapterInfo;
pub use device::Gpu;
pub(crate) use error::check_hemicubes_see;
pub use gather::HemicubeGather;
pub use limits::GpuLimits;
pub use rows::HemicubeRows;
pub use traced_gather::TracedGather;
pub use traced_rows::TracedRows;
