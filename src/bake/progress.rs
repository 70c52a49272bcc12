//! Progress of a bake, and wall time by stage.

use std::ops::ControlFlow;
use std::sync::Arc;

use crate::bake::error_estimate::ErrorEstimate;
use crate::bake::fallback::ResilientBackend;
use crate::error::Error;
use crate::gather::{GatheredMesh, Progress as GatherProgress};
use crate::progress::{Instant, Timings, lap};
use crate::solver::Progress;
use crate::work::{agree, is_shared};

/// The stage that a bake is at.
///
/// [`BakeProgress::Shooting`] comes after every row or shot, thousands in all, the others several
/// times a second. Match on what you want to show; `{:?}` prints any of them.
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
    /// Better light than before, complete: to be looked at while the bake goes on. First what is
    /// shot on elements, after a quarter of a second, half a second, and so on; then what vertices
    /// have gathered, each time the error is estimated.
    Light {
        /// Radiosity at vertices; their errors are not known yet.
        light: Arc<GatheredMesh>,
        /// Its estimated error; none of what was shot.
        estimate: Option<ErrorEstimate>,
    },
    /// The graphics device failed. Nothing is lost: rays on the CPU go on from here, more slowly;
    /// or, if the callback stops the bake, what was reached is returned.
    DeviceFailed(Error),
}

/// The caller's callback; [`ControlFlow::Break`] stops the bake.
pub(super) type ProgressCallback<'a> = &'a mut dyn FnMut(&BakeProgress) -> ControlFlow<()>;

/// Reports stages to the caller and, once, that the device has failed.
pub(super) struct Reporter<'a> {
    pub backend: &'a ResilientBackend<'a>,
    pub callback: ProgressCallback<'a>,
    /// Reports that processes have not agreed upon, and whether one of them was to stop the bake.
    pending: u32,
    stops: bool,
}

/// Reports of shooting that processes agree upon together: a row is made within microseconds.
const REPORTS_OF_SHOOTING: u32 = 64;

impl<'a> Reporter<'a> {
    pub fn new(backend: &'a ResilientBackend<'a>, callback: ProgressCallback<'a>) -> Reporter<'a> {
        Reporter { backend, callback, pending: 0, stops: false }
    }

    /// Reports `stage`, and before that a failure of the device that was not reported yet.
    pub fn report(&mut self, stage: BakeProgress) -> ControlFlow<()> {
        // Devices of other processes go on.
        let failure = self.backend.new_failure().map(BakeProgress::DeviceFailed);
        let failed = failure.map_or(ControlFlow::Continue(()), |failed| (self.callback)(&failed));
        self.stops |= failed.is_break() || (self.callback)(&stage).is_break();
        self.pending += 1;
        let few = matches!(stage, BakeProgress::Shooting(_)) && self.pending < REPORTS_OF_SHOOTING;
        let flow = if self.stops { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
        match few && is_shared() {
            true => ControlFlow::Continue(()),
            false => {
                (self.pending, self.stops) = (0, false);
                agree(flow)
            }
        }
    }
}

/// Attributes time to the stages of a bake.
pub(super) struct StageClock {
    pub timings: Timings,
    lap_start: Instant,
}

impl StageClock {
    pub fn start() -> StageClock {
        StageClock { timings: Timings::default(), lap_start: Instant::now() }
    }

    /// Seconds since the start or the last lap.
    pub fn lap(&mut self) -> f64 {
        lap(&mut self.lap_start)
    }
}
