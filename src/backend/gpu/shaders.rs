//! Sources of the shaders; what two of them share stands once, in `shaders/shared`.

/// Draw shaders begin with what they share.
macro_rules! draw_shader {
    ($file:literal, $($shared:literal),*) => {
        concat!(
            $(include_str!(concat!("../../../shaders/shared/", $shared)),)*
            include_str!(concat!("../../../shaders/", $file)),
        )
    };
}

pub const ITEM_BUFFER_WGSL: &str = draw_shader!("item_buffer.wgsl", "corner.wgsl", "lattice.wgsl");
pub const REDUCE_WGSL: &str = include_str!("../../../shaders/reduce.wgsl");
pub const RADIANCE_WGSL: &str =
    draw_shader!("radiance.wgsl", "corner.wgsl", "lattice.wgsl", "view.wgsl");
pub const SKY_WGSL: &str = draw_shader!("sky.wgsl", "view.wgsl");
pub const HEMISPHERE_SUM_WGSL: &str = include_str!("../../../shaders/hemisphere_sum.wgsl");
