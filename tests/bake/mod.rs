pub mod cornell_box;
mod outcome;
mod surroundings;
mod target;
