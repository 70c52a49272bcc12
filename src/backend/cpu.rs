//! Rays on the CPU: rows of form factors, and light gathered at points.

mod gather;
mod rows;

pub use gather::RayGather;
pub use rows::RayRows;
