//! Twins of the ray-casting shaders, named as the WGSL files: the same functions over the same
//! arrays, one ray after the other.

pub(in crate::backend) mod compact_rows;
mod element;
mod field;
pub(in crate::backend) mod gather_state;
pub(in crate::backend) mod hemisphere_rays;
pub(in crate::backend) mod light_rays;
pub(in crate::backend) mod lights;
mod near_field;
pub(in crate::backend) mod near_paths;
pub(in crate::backend) mod rank_lights;
pub(in crate::backend) mod ray_arrays;
pub(in crate::backend) mod row_rays;
pub(in crate::backend) mod settle;
pub(in crate::backend) mod shift;
pub(in crate::backend) mod sky;
pub(in crate::backend) mod trace;
