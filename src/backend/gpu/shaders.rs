//! Sources of the shaders; shared parts are in `shaders/shared`.

use super::layout::constants_wgsl;

/// Shaders begin with the shared constants and their shared parts.
macro_rules! shader {
    ($file:literal $(, $shared:literal)*) => {
        concat!(
            constants_wgsl!(),
            $(include_str!(concat!("../../../shaders/shared/", $shared)),)*
            include_str!(concat!("../../../shaders/", $file)),
        )
    };
}

pub const ITEM_BUFFER_WGSL: &str = shader!("item_buffer.wgsl", "corner.wgsl", "lattice.wgsl");
pub const REDUCE_WGSL: &str = shader!("reduce.wgsl");

/// Ray-casting shaders begin with ray–scene intersection.
macro_rules! ray_shader {
    ($file:literal $(, $shared:literal)*) => {
        shader!(
            $file,
            "trace.wgsl",
            "lights.wgsl"
            $(, $shared)*
        )
    };
}

/// A pass whose rays look light up in a field.
macro_rules! field_shader {
    ($file:literal) => {
        ray_shader!(
            $file,
            "sky.wgsl",
            "gather_state.wgsl",
            "hemisphere.wgsl",
            "near_field.wgsl",
            "work_list.wgsl",
            "lattice.wgsl",
            "element.wgsl",
            "field.wgsl"
        )
    };
}

pub const RANK_LIGHTS_WGSL: &str = ray_shader!("rank_lights.wgsl", "gather_state.wgsl");
pub const HEMISPHERE_RAYS_WGSL: &str = field_shader!("hemisphere_rays.wgsl");
pub const NEAR_PATHS_WGSL: &str = field_shader!("near_paths.wgsl");
pub const LIGHT_RAYS_WGSL: &str =
    ray_shader!("light_rays.wgsl", "sky.wgsl", "gather_state.wgsl", "work_list.wgsl");
pub const SETTLE_WGSL: &str = ray_shader!("settle.wgsl", "gather_state.wgsl", "near_field.wgsl");
pub const ROW_RAYS_WGSL: &str =
    ray_shader!("row_rays.wgsl", "lattice.wgsl", "element.wgsl", "row_settings.wgsl");
pub const COMPACT_ROWS_WGSL: &str = shader!("compact_rows.wgsl", "row_settings.wgsl");
