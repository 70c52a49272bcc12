//! Sources of the shaders; what two of them share stands once, in `shaders/shared`.

/// Both draw shaders begin with what they share.
macro_rules! draw_shader {
    ($file:literal) => {
        concat!(
            include_str!("../../../shaders/shared/corner.wgsl"),
            include_str!("../../../shaders/shared/lattice.wgsl"),
            include_str!(concat!("../../../shaders/", $file)),
        )
    };
}

pub const ITEM_BUFFER_WGSL: &str = draw_shader!("item_buffer.wgsl");
pub const REDUCE_WGSL: &str = include_str!("../../../shaders/reduce.wgsl");
pub const RADIANCE_WGSL: &str = draw_shader!("radiance.wgsl");
pub const HEMISPHERE_SUM_WGSL: &str = include_str!("../../../shaders/hemisphere_sum.wgsl");
