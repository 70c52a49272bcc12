mod contacts;
pub mod cornell_box;
mod outcome;
mod sky;
mod sky_models;
mod surroundings;
mod target;
mod translucent;
