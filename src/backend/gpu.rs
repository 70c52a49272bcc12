//! The one room that knows wgpu: device, item buffer, reduction; hemicubes come out as
//! rows, or as the light that they gather.

mod device;
mod draw_list;
mod gather;
mod hemisphere_sum;
mod item_buffer;
mod item_table;
mod layout;
mod limits;
mod memory;
mod radiance;
mod readback;
mod reduce;
mod render_targets;
mod resolution;
mod rows;
mod sources;
mod split_float;

pub use device::{AdapterInfo, Gpu};
pub use gather::HemicubeGather;
pub use limits::GpuLimits;
pub use readback::StageSeconds;
pub use rows::HemicubeRows;
