//! Rows and gathers by rays on the CPU.

pub(crate) mod gather;
pub(crate) mod rows;

pub use gather::RayGather;
pub use rows::RayRows;
