//! How much to do between two calls of a progress callback, and where the time went.

use std::fmt;
use std::time::{Duration, Instant};

/// Why a solve or a gather stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// What is left is as small as was asked for: the unshot share, or the error.
    Converged,
    /// The number of shots asked for is done.
    Shots,
    /// The number of steps asked for is done: bounces, sweeps or products.
    Steps,
    /// There are as many elements as there may be.
    Elements,
    /// The progress callback said so; the solution is what was reached.
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

/// As much at once as takes about this long: progress is told several times a second.
const PACE: Duration = Duration::from_millis(250);

/// A number of like things to do at once, which follows the clock. What comes out must not depend on it.
pub(crate) struct BatchSizer(usize);

impl BatchSizer {
    /// Begins with `first` at once.
    pub fn new(first: usize) -> BatchSizer {
        BatchSizer(first)
    }

    /// Takes what is to be done next off `left`, and does it.
    pub fn next<'t, T, R>(&mut self, left: &mut &'t [T], work: impl FnOnce(&'t [T]) -> R) -> R {
        let now;
        (now, *left) = left.split_at(left.len().min(self.0));
        let begun = Instant::now();
        let done = work(now);
        self.0 = match begun.elapsed() {
            t if t > PACE => (self.0 / 2).max(1),
            t if t < PACE / 3 && now.len() == self.0 => self.0 * 2,
            _ => self.0,
        };
        done
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

/// Seconds since `start`, which becomes now.
pub(crate) fn lap(start: &mut Instant) -> f64 {
    let seconds = start.elapsed().as_secs_f64();
    *start = Instant::now();
    seconds
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_done_once_and_in_order() {
        let all: Vec<u32> = (0..1000).collect();
        let (mut left, mut pace, mut done) = (&all[..], BatchSizer::new(3), vec![]);
        while !left.is_empty() {
            pace.next(&mut left, |now| done.extend(now.iter().copied()));
        }
        assert_eq!(done, all);
    }
}
