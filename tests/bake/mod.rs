pub mod cornell_box;
mod target;
