//! What a solver gives back and tells on its way: solution, energy ledger, progress.

mod kept_rows;
mod shooting;

use std::fmt;
use std::ops::ControlFlow;
use std::time::Duration;

use crate::scene::Rgb;
pub use shooting::Shooting;
pub(crate) use shooting::shooters;

/// Radiosity of every element, and how the solver got there.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Radiosity B of each element: emitted plus reflected, W/m² per channel.
    pub radiosity: Vec<Rgb>,
    /// Where all emitted light has gone.
    pub ledger: Ledger,
    /// Patches shot.
    pub shots: u64,
    /// Rows that had to be made; fewer than shots where rows were kept.
    pub rows_made: u64,
    /// Why the solver stopped.
    pub stop: Stop,
}

/// Where all emitted flux has gone, W per channel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Exitance times area, over all elements.
    pub emitted: Rgb,
    /// Not reflected at the fronts of elements.
    pub absorbed: Rgb,
    /// Met no surface.
    pub left: Rgb,
    /// Met the back of a surface and was lost there.
    pub back: Rgb,
    /// Received or emitted, not yet passed on.
    pub unshot: Rgb,
}

impl Ledger {
    /// Emitted minus all else, relative to emitted: the worst channel. 0 when nothing is emitted.
    pub fn imbalance(&self) -> f64 {
        let accounted = self.absorbed + self.left + self.back + self.unshot;
        largest_share((self.emitted - accounted).abs(), self.emitted)
    }

    /// Share of the emitted flux that is unshot: the worst channel. 0 when nothing is emitted.
    pub fn unshot_share(&self) -> f64 {
        largest_share(self.unshot, self.emitted)
    }
}

/// Largest ratio part/whole over the channels in which the whole is above zero.
pub(crate) fn largest_share(part: Rgb, whole: Rgb) -> f64 {
    let share = |(p, w): (f64, f64)| if w > 0.0 { p / w } else { 0.0 };
    part.to_array().into_iter().zip(whole.to_array()).map(share).fold(0.0, f64::max)
}

/// Why a solver stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The unshot share is as low as was asked for.
    Converged,
    /// The number of shots asked for is done.
    Shots,
    /// There are as many elements as there may be.
    Elements,
    /// The progress callback said so; the solution is what was reached.
    Cancelled,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Stop::Converged => "converged",
            Stop::Shots => "shots",
            Stop::Elements => "elements",
            Stop::Cancelled => "cancelled",
        })
    }
}

/// How far a solver is, told after every shot.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// Patches shot so far.
    pub shots: u64,
    /// Rows made so far.
    pub rows_made: u64,
    /// Share of the emitted flux that is unshot, in the worst channel.
    pub unshot_share: f64,
    /// Time since the solver started.
    pub elapsed: Duration,
}

/// What a progress callback answers: go on, or stop with what there is.
pub type Go = ControlFlow<()>;
