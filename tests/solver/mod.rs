mod checkpoint;
mod incremental;
mod many_triangles;
mod methods;
mod odd_geometry;
mod patch_cut;
pub mod shooting;
