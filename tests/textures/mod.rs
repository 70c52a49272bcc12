mod cut_outs;
mod elements;
mod light;
mod pictures;
mod results;
