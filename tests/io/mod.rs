mod image;
mod mtl;
mod obj;
mod obj_polygons;
mod obj_texts;
mod ply;
mod tone;
mod view_factors;
