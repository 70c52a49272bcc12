mod cpu_gather;
#[cfg(feature = "textures")]
mod cut_outs;
mod doubled_faces;
mod gpu;
mod luminaires;
mod many_lights;
mod panes;
