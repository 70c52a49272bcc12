//! The one room that knows wgpu: device, item buffer, reduction; hemicubes come out as rows.

mod cells;
mod chunks;
mod device;
mod hemicubes;
mod item_buffer;
mod layout;
mod reduce;

pub use device::{Adapter, Gpu};
pub use hemicubes::{Hemicubes, StageSeconds};
