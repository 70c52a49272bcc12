//! How far off a solution is, by path tracing the scene at random points: an instrument that shares
//! nothing with the solver but the casting of rays.
//!
//! ```text
//! scene ──► random points of ──► told: the solution's face there ─────────────┐
//!           each group      └──► true: paths in four independent parts ──► mean square error
//!                                 ▲                                        of groups, of all
//!                                 └── more paths, or more points, by which adds more variance
//! ```
//!
//! # The measure
//!
//! Over the area of the surfaces that reflect (reflectance not zero), the root mean square of
//!
//! ```text
//! e = |B_told − B_true| / max(|B_true|, 0.05 m)
//! ```
//!
//! where B is the *reflected* radiosity, that is radiosity minus the material's exitance; lengths
//! |·| are Euclidean over the three channels; and m is the mean of |B_true| over the area of all
//! reflecting surfaces of the scene. A textured point is told and measured with the mean
//! reflectance of its material: that compares the light, and no detail of the texture, which takes
//! part where paths go on. What emits and does not reflect has no error and no weight. A group's
//! error is the same root mean square over the group's own reflecting area, with the scene's m.
//!
//! What is hidden is left out unless asked for ([`Settings::hidden`]): points that see backs in
//! more than 95 % of their hemisphere, weighted by the cosine; or in more than 40 % of it backs
//! nearer than 0.2 % of the diagonal of all that reflects; or whose mean of 1/distance to what they
//! see is above 10 000 over that diagonal. They lie inside a solid, under what stands on them,
//! right behind a plate or in a crack; nobody sees them, and bakes tell there what would be
//! seen without it. The mean m is over all points.
//!
//! Noise of the paths is no error: (B_told − T₁)·(B_told − T₂), of two independent means T₁ and T₂,
//! has the mean |B_told − B_true|², however noisy they are.

mod emitters;
mod path_tracer;
mod sampler;
mod solution;
mod statistics;
mod surfaces;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::scene::{Rgb, Scene};
use crate::vertex::VertexMesh;
pub use path_tracer::{PathTracer, Reflected, SurfacePoint};
use sampler::Sampler;
pub use statistics::Estimate;

/// Points of the first round, at least.
const FIRST_POINTS: usize = 512;

/// Paths a point in the first round.
const FIRST_PATHS: usize = 64;

/// A standard error below this share of the error leaves it known roughly.
const ROUGHLY: f64 = 0.25;

/// An error surely below this share is negligible, however well it is known.
const NEGLIGIBLE: f64 = 1e-4;

/// How well, and how long, to look.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Settings {
    /// The same seed gives the same points and paths.
    pub seed: u64,
    /// The standard error wanted, as a share of the error of the whole scene.
    pub precision: f64,
    /// Points that each group has at least.
    pub points_per_group: usize,
    /// No round is begun that would end later; the first always is.
    pub time: Option<Duration>,
    /// Whether points count that are hidden: see the measure.
    pub hidden: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        let time = Some(Duration::from_secs(120));
        Settings { seed: 0, precision: 0.1, points_per_group: 16, time, hidden: false }
    }
}

impl Settings {
    fn check(&self) -> Result<(), Error> {
        let wrong =
            |place, found, remedy| Err(Error::new(ErrorKind::Setting, place, found, remedy));
        if !(self.precision > 0.0 && self.precision <= 1.0) {
            let found = self.precision.to_string();
            return wrong("precision", found, "give a share of the error above 0, and up to 1");
        }
        if !(2..=1 << 20).contains(&self.points_per_group) {
            let found = self.points_per_group.to_string();
            return wrong("points per group", found, "give at least 2, and no more than a million");
        }
        Ok(())
    }
}

/// How far a verification has come.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// Points done in this round.
    pub done: usize,
    /// Points of this round.
    pub of: usize,
    /// What the rounds before found, after the first.
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
    /// About how much too large the square of the error is: see the statistics.
    pub(crate) bias: f64,
    /// The same with what is hidden.
    pub error_with_hidden: Option<Estimate>,
    /// Share of the area that reflects which is hidden.
    pub hidden_share: f64,
    /// The groups that reflect, in the scene's order.
    pub groups: Vec<GroupError>,
    /// The points, group by group.
    pub points: Vec<PointError>,
    /// Mean length of the reflected radiosity over the area that reflects, W/m².
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
    /// Reflected radiosity that the solution tells, W/m².
    pub told: Rgb,
    /// Reflected radiosity that the paths found, W/m².
    pub found: Rgb,
    /// Length of the standard error of `found`, W/m².
    pub standard_error: f64,
    /// The error e, as a share: zero where less than noise is left.
    pub error: f64,
    /// Whether the point is hidden: see the measure.
    pub hidden: bool,
}

/// Measures how far `solution` is off on `scene`. `progress` hears several times a second how far
/// it has come; with a break, what the rounds before found is given.
///
/// The same scene, solution and settings give the same numbers, whatever the number of threads;
/// where time runs out, how many rounds there are depends on the machine.
///
/// # Errors
/// - [`ErrorKind::Setting`] for a setting out of range.
/// - [`ErrorKind::Scene`] when nothing in the scene reflects or nothing emits, when the solution is
///   malformed, emits something else than the scene, as far as its vertices tell that (they have
///   irradiance), or when more than one point in a hundred lies on none of its faces.
pub fn verify(
    scene: &Scene,
    solution: &VertexMesh,
    settings: &Settings,
    mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Verification, Error> {
    settings.check()?;
    let mut verifier = Verifier::new(scene, settings.clone(), FIRST_POINTS)?;
    verifier.measure(solution, Limits::default(), &mut progress)
}

/// Measures one solution of a scene after the other at the same points: paths are traced once.
pub(crate) struct Verifier<'a> {
    sampler: Sampler<'a>,
    settings: Settings,
    /// Points over all, before those that groups have at least; and paths at each.
    points: usize,
    paths: usize,
}

/// What ends a measurement before it is as precise as asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Limits {
    /// An error that is to be met: it is enough to know whether it is.
    pub error: Option<f64>,
    /// Paths over all points, for all measurements together.
    pub paths: Option<u64>,
}

impl<'a> Verifier<'a> {
    /// For solutions of `scene`, with so many `points` in the first round.
    pub fn new(scene: &'a Scene, settings: Settings, points: usize) -> Result<Verifier<'a>, Error> {
        let sampler = Sampler::new(scene, &settings)?;
        Ok(Verifier { sampler, settings, points, paths: FIRST_PATHS })
    }

    /// See [`verify`].
    pub fn measure(
        &mut self,
        solution: &VertexMesh,
        limits: Limits,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Verification, Error> {
        let (sampler, settings) = (&mut self.sampler, &self.settings);
        let start = Instant::now();
        let solution = sampler.lookup(solution)?;
        sampler.forget();
        let mut verification = sampler.verification();
        verification.stop = loop {
            sampler.add_points(self.points);
            sampler.tell(&solution)?;
            let round = |done, of| progress(&Progress { done, of, error: verification.error });
            if sampler.trace(self.paths, round).is_break() {
                break Stop::Cancelled;
            }
            verification = sampler.verification();
            let all = sampler.mean_square(settings.hidden);
            let error = all.root();
            // What a biased mean square adds to its root.
            let biased = all.bias > settings.precision * all.value;
            if error.value + 2.0 * error.standard_error <= NEGLIGIBLE {
                break Stop::Negligible;
            }
            let is_precise = error.standard_error <= settings.precision * error.value;
            if !biased && (is_precise || limits.decided_by(&error)) {
                break Stop::Precise;
            }
            // Another round doubles all that was done so far.
            if settings.time.is_some_and(|time| 2 * start.elapsed() > time) {
                break Stop::Time;
            }
            let traced = (sampler.drawn() * self.paths) as u64;
            let too_many = limits.paths.is_some_and(|most| 2 * traced > most);
            if too_many || self.points >= MAX_POINTS || self.paths >= MAX_PATHS {
                break Stop::Rounds;
            }
            match 2.0 * all.noise > all.variance || biased {
                true => self.paths *= 2,
                false => self.points *= 2,
            }
        };
        Ok(verification)
    }
}

impl Limits {
    /// Whether `error` is surely above or below what is to be met, and roughly known.
    fn decided_by(&self, error: &Estimate) -> bool {
        let off = error.standard_error;
        let is_far = |limit: f64| (error.value - limit).abs() > 2.0 * off;
        self.error.is_some_and(is_far) && off <= ROUGHLY * error.value
    }
}

/// Points there are at most, before those that groups have at least.
const MAX_POINTS: usize = 1 << 22;

/// Paths a point at most.
const MAX_PATHS: usize = 1 << 30;
