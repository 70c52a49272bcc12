mod elements;
mod light;
mod pictures;
mod results;
