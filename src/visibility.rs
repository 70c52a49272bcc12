//! What a ray meets first, and whether anything is in between.

pub(crate) mod buried;
pub(crate) mod cut_outs;
pub(crate) mod lit_sides;
pub(crate) mod offset;
pub(crate) mod panes;
pub(crate) mod ray_scene;
mod wide_bvh;
