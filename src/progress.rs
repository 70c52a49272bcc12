//! Long work: reason of its stop, time by stage.
//!
//! Work that takes more than a second is done in batches. Between batches a progress callback is
//! called with the state reached; it returns [`ControlFlow<()>`](std::ops::ControlFlow), and a
//! break cancels the work: the state reached is returned with [`StopReason::Cancelled`].
//!
//! ```text
//! items      ┌─┬──┬────┬────────┬────────┬────────┬───┐
//!            └─┴──┴────┴────────┴────────┴────────┴───┘
//! callback     ↑  ↑    ↑        ↑        ↑        ↑   ↑     some 250 ms apart
//! ```

use std::fmt;

/// The clock of the library: that of the platform, in browsers `performance.now()`.
pub(crate) use web_time::Instant;

/// Why a solve or a gather stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// The unshot fraction, or the error, is at most the one requested.
    Converged,
    /// The requested number of shots is done.
    Shots,
    /// The requested number of steps is done: bounces, sweeps or products.
    Steps,
    /// The maximum number of elements is reached.
    Elements,
    /// The progress callback cancelled; the solution is the state reached.
    Cancelled,
}

impl fmt::Display for StopReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            StopReason::Converged => "converged",
            StopReason::Shots => "shots",
            StopReason::Steps => "steps",
            StopReason::Elements => "elements",
            StopReason::Cancelled => "cancelled",
        })
    }
}

/// Seconds of wall time by stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Timings {
    /// Cutting the scene into elements, and getting the device ready.
    pub mesh: f64,
    /// Rows: rendering item buffers, or casting rays.
    pub draw: f64,
    /// Rows: adding up pixel weights.
    pub reduce: f64,
    /// Rows: copying them from the device.
    pub readback: f64,
    /// Shooting along rows, corrections of rows included.
    pub solve: f64,
    /// Elements to vertices, gathering and splitting included.
    pub vertices: f64,
    /// Estimating the error.
    pub estimate: f64,
}

impl Timings {
    /// The sum of all stages.
    pub fn total(&self) -> f64 {
        let rows = self.draw + self.reduce + self.readback;
        self.mesh + rows + self.solve + self.vertices + self.estimate
    }
}

impl std::ops::AddAssign for Timings {
    fn add_assign(&mut self, other: Timings) {
        self.mesh += other.mesh;
        self.draw += other.draw;
        self.reduce += other.reduce;
        self.readback += other.readback;
        self.solve += other.solve;
        self.vertices += other.vertices;
        self.estimate += other.estimate;
    }
}

/// Seconds since `start`, which is set to the present.
pub(crate) fn lap(start: &mut Instant) -> f64 {
    let seconds = start.elapsed().as_secs_f64();
    *start = Instant::now();
    seconds
}
