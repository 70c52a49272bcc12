//! Tests that need a graphics adapter.

mod failures;
mod gather;
mod resolutions;
mod rows;
mod solves;
