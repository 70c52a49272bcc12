mod cie_171;
mod contacts;
pub mod cornell_box;
#[cfg(feature = "textures")]
mod cut_outs;
mod kept_mesh;
mod luminaires;
mod outcome;
mod previews;
mod sky;
mod sky_models;
mod surroundings;
mod target;
mod translucent;
