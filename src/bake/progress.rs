//! What a bake tells while it works.

use std::ops::ControlFlow;

use crate::bake::error_estimate::ErrorEstimate;
use crate::bake::fallback::ResilientBackend;
use crate::error::Error;
use crate::solver::Progress;
use crate::vertex::gathering::GatherProgress;

/// The stage that a bake is at, reported several times a second.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum BakeProgress {
    /// Light is shot on the elements of the first mesh.
    Shooting(Progress),
    /// Vertices gather, and elements are split.
    Gathering(GatherProgress),
    /// Random points are gathered at, which the error is estimated by.
    Estimating {
        /// Points done so far.
        samples: usize,
        /// How many there are.
        of: usize,
    },
    /// The error was estimated.
    Estimated(ErrorEstimate),
    /// The graphics device failed. Nothing is lost: rays on the CPU go on from here, more slowly; or,
    /// if the callback stops the bake, what was reached is returned.
    DeviceFailed(Error),
}

/// The caller's callback; [`ControlFlow::Break`] stops the bake.
pub(super) type ProgressCallback<'a> = &'a mut dyn FnMut(&BakeProgress) -> ControlFlow<()>;

/// Reports `stage`; before that, once, that the device of `backend` has failed.
pub(super) fn report(
    backend: &ResilientBackend,
    stage: &BakeProgress,
    progress: ProgressCallback,
) -> ControlFlow<()> {
    if let Some(error) = backend.new_failure() {
        progress(&BakeProgress::DeviceFailed(error))?;
    }
    progress(stage)
}
