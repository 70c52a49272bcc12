//! Ray casting: closest hits and occlusion between points.

pub(crate) mod buried;
mod collapse;
pub(crate) mod cut_outs;
pub(crate) mod lit_sides;
pub(crate) mod offset;
pub(crate) mod panes;
mod ray32;
pub(crate) mod ray_scene;
mod ray_stream;
pub(crate) mod sah_tree;
mod triangle_pack;
mod triangle_plane;
mod wide_bvh;
