mod contacts;
pub mod cornell_box;
mod outcome;
mod sky;
mod surroundings;
mod target;
