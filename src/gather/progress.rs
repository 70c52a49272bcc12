//! What the adaptive gather reports while it runs.

/// State of an adaptive gather, reported after every batch of gather points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// Gather passes completed: see [`gather_passes`].
    ///
    /// [`gather_passes`]: super::RefinementSettings::gather_passes
    pub pass: u32,
    /// Times that elements have been split, over all passes.
    pub refinements: u32,
    /// Elements so far.
    pub elements: usize,
    /// Vertices that have gathered since elements were split last.
    pub gathered: usize,
    /// Vertices that are to gather before elements are split again.
    pub total: usize,
}
