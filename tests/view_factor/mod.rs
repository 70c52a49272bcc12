mod checks;
mod exact;
mod sampled;
mod sparse;
