//! Methods of computing rows of form factors.

use std::fmt;

/// A method of computing rows of form factors. Shown as `hemicubes`, `rays on the device` or
/// `rays`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowMaker {
    /// Hemicubes on a graphics device: `gpu::HemicubeRows`.
    Hemicubes,
    /// Rays on a graphics device: `gpu::TracedRows`.
    DeviceRays,
    /// Rays on the CPU: [`RayRows`](crate::backend::cpu::RayRows).
    Rays,
}

impl fmt::Display for RowMaker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            RowMaker::Hemicubes => "hemicubes",
            RowMaker::DeviceRays => "rays on the device",
            RowMaker::Rays => "rays",
        })
    }
}
