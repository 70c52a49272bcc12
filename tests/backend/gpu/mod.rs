//! Tests that need a graphics adapter.

mod failures;
mod gather;
mod resolutions;
mod row_maker;
mod rows;
mod solves;
