mod checks;
mod exact;
mod partial;
mod sparse;
