mod checks;
mod exact;
mod partial;
mod sampled;
mod sparse;
