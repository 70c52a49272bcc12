mod atlas;
mod correction;
mod directional;
mod files;
mod light;
mod pages;
mod shown_error;
#[cfg(feature = "textures")]
mod textured_glb;
