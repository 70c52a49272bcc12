//! The one room that knows wgpu: device, item buffer, reduction; hemicubes come out as
//! rows, or as the light that they gather.

mod cells;
mod chunks;
mod device;
mod gather;
mod hemicubes;
mod item_buffer;
mod layers;
mod layout;
mod limits;
mod local;
mod memory;
mod radiance;
mod readback;
mod reduce;
mod resolution;
mod sources;
mod sum;

pub use device::{Adapter, Gpu};
pub use gather::HemicubeGather;
pub use hemicubes::Hemicubes;
pub use limits::Limits;
pub use readback::StageSeconds;
