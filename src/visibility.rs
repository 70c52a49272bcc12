//! Ray casting: closest hits and occlusion between points.

pub(crate) mod buried;
mod collapse;
pub(crate) mod cut_outs;
mod instances;
pub(crate) mod lit_sides;
mod min_max;
pub(crate) mod offset;
pub(crate) mod panes;
mod ray32;
pub(crate) mod ray_scene;
mod ray_stream;
mod repeated_groups;
pub(crate) mod sah_tree;
mod triangle_bvh;
mod triangle_pack;
mod triangle_plane;
pub(crate) mod triangle_tree;
mod wide_bvh;
