#[cfg(feature = "textures")]
mod blender;
mod glb;
mod glb_frame;
mod glb_sides;
#[cfg(feature = "glb")]
mod gltf;
mod image;
#[cfg(feature = "textures")]
mod masks;
mod mtl;
mod obj;
mod obj_libraries;
mod obj_light;
mod obj_polygons;
mod obj_texts;
#[cfg(feature = "textures")]
mod obj_textures;
mod photometry;
mod ply;
mod ply_reader;
mod stl;
mod tone;
mod view_factors;
