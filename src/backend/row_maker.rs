//! What rows of form factors are made with.

use std::fmt;

/// What makes rows of form factors. Shown as `hemicubes` or `rays`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RowMaker {
    /// Hemicubes on a graphics device: `gpu::HemicubeRows`.
    Hemicubes,
    /// Rays on the CPU: [`RayRows`](crate::RayRows).
    Rays,
}

impl fmt::Display for RowMaker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            RowMaker::Hemicubes => "hemicubes",
            RowMaker::Rays => "rays",
        })
    }
}
