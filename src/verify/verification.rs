//! Results of a verification: underway, and in the end.

use glam::DVec3;

use crate::accuracy::Estimate;
use crate::scene::Rgb;

/// How far a verification has come.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// Points done in this round.
    pub done: usize,
    /// Points of this round.
    pub of: usize,
    /// The error by the rounds before, after the first.
    pub error: Option<Estimate>,
}

/// Why a verification stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The error is known as well as was asked for.
    Precise,
    /// The error is surely below 0.01 %.
    Negligible,
    /// Another round would have taken longer than there was time.
    Time,
    /// There are as many points or paths as there may be.
    Rounds,
    /// The progress callback said so.
    Cancelled,
}

/// How far off a solution is.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Verification {
    /// The error of all that reflects, and its standard error, as shares (0.01 for 1 %); none if
    /// the first round was cancelled.
    pub error: Option<Estimate>,
    /// Root mean square of the errors in the tail, the share of the area that
    /// [`Measure::tail`](crate::accuracy::Measure) leaves out, where they are largest.
    pub tail: Option<f64>,
    /// The error with the tail: the plain root mean square.
    pub error_with_tail: Option<Estimate>,
    /// About how much too large the square of the error is: see the statistics.
    pub(crate) bias: f64,
    /// The error with what is hidden.
    pub error_with_hidden: Option<Estimate>,
    /// Share of the area that reflects which is hidden.
    pub hidden_share: f64,
    /// The groups that reflect, in the scene's order.
    pub groups: Vec<GroupError>,
    /// The points, group by group.
    pub points: Vec<PointError>,
    /// Mean length of the reflected radiosity over the area that counts, W/m².
    pub mean_reflected: f64,
    /// Paths traced at each point.
    pub paths: usize,
    /// Points left out because they lie on no face of the solution.
    pub missing: usize,
    /// Why it ended.
    pub stop: Stop,
}

/// How far off a solution is on a group.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct GroupError {
    /// Index of the group in the scene.
    pub group: usize,
    /// The group's share of the area that reflects.
    pub area_share: f64,
    /// Points of the group, hidden ones too.
    pub points: usize,
    /// The share of them that is hidden.
    pub hidden_share: f64,
    /// The error and its standard error, as shares; none of fewer than two points that count.
    pub error: Option<Estimate>,
    /// Share of the squared errors of the scene's tail that is on this group.
    pub tail_share: f64,
    /// As that of [`Verification`].
    pub(crate) bias: f64,
}

/// How far off a solution is at a point.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct PointError {
    /// Where, scene unit.
    pub position: DVec3,
    /// Unit normal of the front.
    pub normal: DVec3,
    /// Index of the group in the scene.
    pub group: usize,
    /// Reflected radiosity of the solution, W/m².
    pub solution: Rgb,
    /// Reflected radiosity by the paths, W/m².
    pub measured: Rgb,
    /// Length of the standard error of `measured`, W/m².
    pub standard_error: f64,
    /// The error e, as a share: zero where less than noise is left.
    pub error: f64,
    /// Share of the area for which the point stands that is in the tail: 1 where the error is among
    /// the largest by each half of the paths, 0 for hidden points.
    pub tail: f64,
    /// Whether the point is hidden: see the measure.
    pub hidden: bool,
}
