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
mod solution;
mod statistics;
mod surfaces;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;

use crate::error::{Error, ErrorKind, quoted};
use crate::progress::BatchSizer;
use crate::scene::{Rgb, Scene};
use crate::vertex::VertexMesh;
use path_tracer::random_numbers;
pub use path_tracer::{PathTracer, Reflected, SurfacePoint};
use solution::SolutionLookup;
pub use statistics::Estimate;
use statistics::{FLOOR, MeanSquare, PARTS, Sample, SquareError};
use surfaces::ReflectingGroup;

/// Points of the first round, at least.
const FIRST_POINTS: usize = 512;

/// Paths a point in the first round.
const FIRST_PATHS: usize = 64;

/// A point is hidden where more than this share of its rays meets backs first,
const HIDDEN: f64 = 0.95;

/// or more than this share meets backs that are near:
const HIDDEN_NEAR: f64 = 0.4;

/// nearer than this share of the diagonal of all that reflects.
const NEAR: f64 = 0.002;

/// It is hidden in a crack, too, where the mean of 1/distance to what it sees is above one over
/// this share of that diagonal.
const CRACK: f64 = 1e-4;

/// Rays that find that out.
const HIDDEN_RAYS: usize = 128;

/// An error surely below this share is negligible, however well it is known.
const NEGLIGIBLE: f64 = 1e-4;

/// A solution is of another scene if more than this share of the points lie on none of its faces.
const MISSING_SHARE: f64 = 0.01;

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
    let start = Instant::now();
    let mut sampler = Sampler::new(scene, solution, settings)?;
    let (mut points, mut paths) = (FIRST_POINTS, FIRST_PATHS);
    let mut verification = sampler.verification();
    verification.stop = loop {
        sampler.add_points(points)?;
        let round = |done, of| progress(&Progress { done, of, error: verification.error });
        if sampler.trace(paths, round).is_break() {
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
        if error.standard_error <= settings.precision * error.value && !biased {
            break Stop::Precise;
        }
        // Another round doubles all that was done so far.
        if settings.time.is_some_and(|time| 2 * start.elapsed() > time) {
            break Stop::Time;
        }
        if points >= MAX_POINTS || paths >= MAX_PATHS {
            break Stop::Rounds;
        }
        match 2.0 * all.noise > all.variance || biased {
            true => paths *= 2,
            false => points *= 2,
        }
    };
    Ok(verification)
}

/// Points there are at most, before those that groups have at least.
const MAX_POINTS: usize = 1 << 22;

/// Paths a point at most.
const MAX_PATHS: usize = 1 << 30;

/// Points of groups, and what was traced at them so far.
struct Sampler<'a> {
    scene: &'a Scene,
    settings: &'a Settings,
    tracer: PathTracer<'a>,
    solution: SolutionLookup<'a>,
    strata: Vec<Stratum>,
    /// Of all that reflects, scene unit.
    diagonal: f64,
    /// Paths done at every point but the new ones.
    paths: usize,
}

/// A group, and its points.
struct Stratum {
    surface: ReflectingGroup,
    /// Points drawn, those on no face of the solution too.
    drawn: usize,
    points: Vec<TracedPoint>,
}

/// A point, and the paths that began there.
#[derive(Clone, Copy)]
struct TracedPoint {
    /// Number among those of its group.
    index: usize,
    point: SurfacePoint,
    told: Rgb,
    /// Known with the first paths.
    hidden: bool,
    paths: usize,
    /// What the paths found, part by part: sums, W/m².
    sums: [Rgb; PARTS],
}

impl<'a> Sampler<'a> {
    fn new(
        scene: &'a Scene,
        solution: &'a VertexMesh,
        settings: &'a Settings,
    ) -> Result<Sampler<'a>, Error> {
        let lookup = SolutionLookup::new(solution, scene)?;
        lookup.check_emission(scene)?;
        let stratum = |surface| Stratum { surface, drawn: 0, points: vec![] };
        Ok(Sampler {
            strata: ReflectingGroup::all(scene)?.into_iter().map(stratum).collect(),
            solution: lookup,
            tracer: PathTracer::new(scene),
            diagonal: scene.reflecting_bounds().diagonal(),
            scene,
            settings,
            paths: 0,
        })
    }

    /// Adds points until there are about `points` of them, spread over the area, and as many in
    /// each group as it has at least.
    fn add_points(&mut self, points: usize) -> Result<(), Error> {
        let mut lost = None;
        for Stratum { surface, drawn, points: list } in &mut self.strata {
            let by_area = (surface.share * points as f64).ceil() as usize;
            while *drawn < by_area.max(self.settings.points_per_group) {
                let words = [self.settings.seed, surface.group as u64, *drawn as u64];
                let point = surface.point(self.scene, &mut random_numbers(&words));
                match self.solution.reflected(self.scene, &point) {
                    Some(told) => list.push(TracedPoint {
                        index: *drawn,
                        point,
                        told,
                        hidden: false,
                        paths: 0,
                        sums: [Rgb::ZERO; PARTS],
                    }),
                    None => lost = lost.or(Some((surface.group, point.position))),
                }
                *drawn += 1;
            }
        }
        let (drawn, missing) = (self.drawn(), self.missing());
        match lost {
            Some((group, at)) if missing as f64 > MISSING_SHARE * drawn as f64 => {
                let group = quoted(&self.scene.groups()[group..=group]);
                let found = format!(
                    "{missing} of {drawn} random points of the scene lie on none of its faces, \
                     the first at {at} in group {group}"
                );
                let remedy = "give the solution of this scene, in the same place and unit";
                Err(Error::new(ErrorKind::Scene, "solution", found, remedy))
            }
            _ => Ok(()),
        }
    }

    fn drawn(&self) -> usize {
        self.strata.iter().map(|stratum| stratum.drawn).sum()
    }

    fn missing(&self) -> usize {
        self.drawn() - self.strata.iter().map(|stratum| stratum.points.len()).sum::<usize>()
    }

    /// Traces until every point has `paths`. Stopped, it changes nothing.
    fn trace(
        &mut self,
        paths: usize,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let jobs: Vec<(usize, TracedPoint)> = self.traced().filter(|p| p.1.paths < paths).collect();
        let (mut remaining, mut done) = (&jobs[..], vec![]);
        let mut batches = BatchSizer::new(rayon::current_num_threads());
        while !remaining.is_empty() {
            done.extend(batches.next(&mut remaining, |batch| {
                let traced =
                    |(group, point): &(usize, TracedPoint)| self.more(*group, point, paths);
                batch.par_iter().map(traced).collect::<Vec<_>>()
            }));
            progress(done.len(), jobs.len())?;
        }
        let mut done = done.into_iter();
        for point in self.strata.iter_mut().flat_map(|stratum| &mut stratum.points) {
            if point.paths < paths
                && let Some(more) = done.next()
            {
                *point = more;
            }
        }
        self.paths = paths;
        ControlFlow::Continue(())
    }

    /// All points, with the groups that they are of.
    fn traced(&self) -> impl Iterator<Item = (usize, TracedPoint)> {
        self.strata.iter().flat_map(|s| s.points.iter().map(|&point| (s.surface.group, point)))
    }

    /// `point` with as many paths as to have `paths`.
    fn more(&self, group: usize, point: &TracedPoint, paths: usize) -> TracedPoint {
        let mut traced = *point;
        let (before, index) = (point.paths as u64, point.index as u64);
        for (part, sum) in (1..).zip(&mut traced.sums) {
            let mut rng = random_numbers(&[self.settings.seed, group as u64, index, part, before]);
            *sum += self.tracer.sum(&point.point, (paths - point.paths) / PARTS, &mut rng);
        }
        if point.paths == 0 {
            let mut rng = random_numbers(&[self.settings.seed, group as u64, index, 0]);
            let hits = self.tracer.hits(&point.point, HIDDEN_RAYS, &mut rng);
            let backs = |nearer: f64| {
                let near = hits.iter().filter(|hit| !hit.front && hit.distance < nearer);
                near.count() as f64 / HIDDEN_RAYS as f64
            };
            let inverse = hits.iter().map(|hit| 1.0 / hit.distance).sum::<f64>();
            traced.hidden = backs(f64::INFINITY) > HIDDEN
                || backs(NEAR * self.diagonal) > HIDDEN_NEAR
                || inverse / HIDDEN_RAYS as f64 * CRACK * self.diagonal > 1.0;
        }
        traced.paths = paths;
        traced
    }

    /// The mean length of reflected radiosity over all that reflects, W/m².
    fn mean_reflected(&self) -> f64 {
        let mean = |s: &Stratum| {
            let lengths = s.points.iter().map(|p| p.sample().found().length());
            s.surface.share * lengths.sum::<f64>() / (s.points.len() as f64).max(1.0)
        };
        self.strata.iter().map(mean).sum()
    }

    /// The mean square error of every group, and the share that it counts with.
    fn by_group(&self, hidden: bool) -> Vec<Option<(f64, MeanSquare)>> {
        let floor = FLOOR * self.mean_reflected();
        let group = |s: &Stratum| {
            let counting = s.points.iter().filter(|p| hidden || !p.hidden);
            let squares: Vec<SquareError> =
                counting.map(|p| p.sample().square_error(floor)).collect();
            let share = s.surface.share * squares.len() as f64 / s.points.len() as f64;
            Some((share, MeanSquare::of_group(&squares)?))
        };
        self.strata.iter().map(group).collect()
    }

    /// The mean square error of all that reflects.
    fn mean_square(&self, hidden: bool) -> MeanSquare {
        MeanSquare::stratified(self.by_group(hidden).into_iter().flatten())
    }

    /// What is known so far.
    fn verification(&self) -> Verification {
        let mean_reflected = self.mean_reflected();
        let by_group = self.by_group(self.settings.hidden);
        let group = |(s, error): (&Stratum, Option<(f64, MeanSquare)>)| GroupError {
            group: s.surface.group,
            area_share: s.surface.share,
            points: s.points.len(),
            hidden_share: s.hidden_share(),
            error: error.map(|(_, error)| error.root()),
        };
        let point = |(group, traced): (usize, TracedPoint)| {
            let sample = traced.sample();
            PointError {
                position: traced.point.position,
                normal: self.scene.normal(traced.point.triangle),
                group,
                told: traced.told,
                found: sample.found(),
                standard_error: sample.variance().sqrt(),
                error: sample.square_error(FLOOR * mean_reflected).value.max(0.0).sqrt(),
                hidden: traced.hidden,
            }
        };
        let error = |hidden| (self.paths > 0).then(|| self.mean_square(hidden).root());
        Verification {
            error: error(self.settings.hidden),
            error_with_hidden: error(true),
            hidden_share: self.strata.iter().map(|s| s.surface.share * s.hidden_share()).sum(),
            groups: self.strata.iter().zip(by_group).map(group).collect(),
            points: self.traced().map(point).collect(),
            mean_reflected,
            paths: self.paths,
            missing: self.missing(),
            stop: Stop::Cancelled,
        }
    }
}

impl Stratum {
    /// The share of the points that is hidden.
    fn hidden_share(&self) -> f64 {
        let hidden = self.points.iter().filter(|point| point.hidden).count();
        hidden as f64 / (self.points.len() as f64).max(1.0)
    }
}

impl TracedPoint {
    fn sample(&self) -> Sample {
        let paths = (self.paths / PARTS).max(1) as f64;
        Sample { told: self.told, parts: self.sums.map(|sum| sum / paths) }
    }
}
