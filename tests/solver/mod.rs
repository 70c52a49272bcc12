mod checkpoint;
#[cfg(feature = "textures")]
mod cut_outs;
mod incremental;
mod methods;
mod odd_geometry;
mod patch_cut;
mod requests;
pub mod shooting;
mod translucent;
