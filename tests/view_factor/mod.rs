mod checks;
mod exact;
mod sampled;
