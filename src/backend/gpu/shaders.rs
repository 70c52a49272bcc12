//! Sources of the shaders; shared parts are in `shaders/shared`.

use super::layout::{constants_wgsl, structs_wgsl, wgsl_type};

/// Name and source of a shader: it begins with the shared constants and structs, and its shared
/// parts.
macro_rules! shader {
    ($file:literal $(, $shared:literal)*) => {
        (
            $file,
            concat!(
                constants_wgsl!(),
                structs_wgsl!(),
                $(include_str!(concat!("../../../shaders/shared/", $shared)),)*
                include_str!(concat!("../../../shaders/", $file)),
            ),
        )
    };
}

/// Ray-casting shaders begin with ray–scene intersection.
macro_rules! ray_shader {
    ($file:literal $(, $shared:literal)*) => {
        shader!($file, "trace.wgsl", "lights.wgsl" $(, $shared)*)
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

/// All shaders: file in `shaders/`, and source.
pub const SHADERS: [(&str, &str); 9] = [
    shader!("item_buffer.wgsl", "corner.wgsl", "lattice.wgsl"),
    shader!("reduce.wgsl"),
    ray_shader!("rank_lights.wgsl", "gather_state.wgsl"),
    field_shader!("hemisphere_rays.wgsl"),
    field_shader!("near_paths.wgsl"),
    ray_shader!("light_rays.wgsl", "sky.wgsl", "gather_state.wgsl", "work_list.wgsl"),
    ray_shader!("settle.wgsl", "gather_state.wgsl", "near_field.wgsl"),
    ray_shader!("row_rays.wgsl", "lattice.wgsl", "element.wgsl"),
    shader!("compact_rows.wgsl"),
];
