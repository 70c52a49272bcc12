//! Random points of groups, with the radiosity by paths and that of a solution.

use std::ops::ControlFlow;

use fastrand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::settings::Settings;
use super::solution::Solution;
use super::statistics::{PARTS, Sample};
use super::surfaces::ReflectingGroup;
use super::verification::{GroupError, PointError, Stop, Verification};
use crate::accuracy::Estimate;
use crate::accuracy::hidden::{LitRegion, Outlook, PATHS_IN_THE_DARK};
use crate::accuracy::mean_square::{MeanSquare, MeasuredPoint, TrimmedSquare};
use crate::error::{Error, ErrorKind, quoted};
use crate::light::{PathTracer, SurfacePoint};
use crate::sampling::random::random_numbers;
use crate::scene::{Aabb, Rgb, Scene};
use crate::work::{self, Batches, agree};

/// Points of groups, and what was traced at them so far.
#[derive(Debug)]
pub(super) struct Sampler<'a> {
    scene: &'a Scene,
    settings: Settings,
    tracer: PathTracer<'a>,
    strata: Vec<Stratum>,
    /// Paths done at every point but the new ones.
    paths: usize,
}

/// A group, and its points.
#[derive(Debug)]
struct Stratum {
    surface: ReflectingGroup,
    points: Vec<TracedPoint>,
    /// Sum of the weights of the points.
    weight: f64,
    /// Minimum number of points.
    least: usize,
}

/// A point, and the paths that began there.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct TracedPoint {
    /// Number among those of its group.
    index: usize,
    point: SurfacePoint,
    /// Area that it stands for, over that of points spread evenly over the group.
    weight: f64,
    /// Reflected radiosity of the solution, W/m²; none before it is looked up, and where the
    /// solution has no face.
    solution: Option<Rgb>,
    /// Known with the first paths, as is whether the point is hidden.
    outlook: Outlook,
    /// Reflected radiosity by direct light of lamps and luminaires, known with the first paths if
    /// the point may be in the open, W/m².
    from_lamps: Rgb,
    hidden: bool,
    paths: usize,
    /// Sums over the paths of each part, W/m².
    sums: [Rgb; PARTS],
}

impl<'a> Sampler<'a> {
    pub fn new(scene: &'a Scene, settings: &Settings) -> Result<Sampler<'a>, Error> {
        let least = settings.points_per_group;
        let stratum = |surface| Stratum { surface, points: vec![], weight: 0.0, least };
        Ok(Sampler {
            strata: ReflectingGroup::all(scene)?.into_iter().map(stratum).collect(),
            tracer: PathTracer::new(scene),
            scene,
            settings: settings.clone(),
            paths: 0,
        })
    }

    pub fn scene(&self) -> &'a Scene {
        self.scene
    }

    /// Adds points until there are about `points` of them, spread over the area that counts as far
    /// as that is known, and as many in each group as it has at least.
    pub fn add_points(&mut self, points: usize) {
        let counting = |s: &Stratum| s.surface.share * (1.0 - s.hidden_share());
        let whole: f64 = self.strata.iter().map(counting).sum();
        for stratum in &mut self.strata {
            // Where all points are hidden so far, all area has points.
            let share = match whole > 0.0 {
                true => counting(stratum) / whole,
                false => stratum.surface.share,
            };
            let Stratum { surface, points: list, weight: of_all, least } = stratum;
            let by_area = (share * points as f64).ceil() as usize;
            while list.len() < by_area.max(*least) {
                let index = list.len();
                let words = [self.settings.seed, surface.group as u64, index as u64];
                let (point, weight) = surface.point(self.scene, &mut random_numbers(&words));
                *of_all += weight;
                list.push(TracedPoint {
                    index,
                    point,
                    weight,
                    solution: None,
                    outlook: Outlook::default(),
                    from_lamps: Rgb::ZERO,
                    hidden: false,
                    paths: 0,
                    sums: [Rgb::ZERO; PARTS],
                });
            }
        }
    }

    /// Has the groups whose error `is_open` have twice as many points, from the next
    /// [`add_points`](Sampler::add_points) on; how many that will be more.
    pub fn double(&mut self, is_open: impl Fn(&Estimate) -> bool) -> usize {
        let errors = self.by_group(&self.counting(self.settings.hidden));
        let mut more = 0;
        for (stratum, error) in self.strata.iter_mut().zip(errors) {
            if error.is_some_and(|error| is_open(&error.root())) {
                more += stratum.points.len();
                stratum.least = 2 * stratum.points.len();
            }
        }
        more
    }

    /// Removes the radiosity of a solution from all points.
    pub fn forget(&mut self) {
        for point in self.strata.iter_mut().flat_map(|stratum| &mut stratum.points) {
            point.solution = None;
        }
    }

    /// Looks up `solution` at all points that lack it.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] where too many points lie on none of its faces.
    pub fn look_up(&mut self, solution: &dyn Solution) -> Result<(), Error> {
        let scene = self.scene;
        let points = self.strata.iter_mut().flat_map(|stratum| &mut stratum.points);
        let unknown: Vec<&mut TracedPoint> = points.filter(|p| p.solution.is_none()).collect();
        let found = work::map(unknown.len(), |k| solution.reflected(scene, &unknown[k].point));
        unknown.into_iter().zip(found).for_each(|(point, found)| point.solution = found);
        let (drawn, missing) = (self.drawn(), self.missing());
        let mut lost = self.traced().filter(|(_, point)| point.solution.is_none());
        match lost.next() {
            // Of another scene.
            Some((group, lost)) if missing as f64 > 0.01 * drawn as f64 => {
                let (group, at) = (quoted(&scene.groups()[group..=group]), lost.point.position);
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

    /// Points there are.
    pub fn drawn(&self) -> usize {
        self.strata.iter().map(|stratum| stratum.points.len()).sum()
    }

    fn missing(&self) -> usize {
        self.traced().filter(|(_, point)| point.solution.is_none()).count()
    }

    /// Traces until every point has `paths`. Stopped, it changes nothing.
    pub fn trace(
        &mut self,
        paths: usize,
        mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let jobs: Vec<(usize, TracedPoint)> = self.traced().filter(|p| p.1.paths < paths).collect();
        let (mut remaining, mut done) = (&jobs[..], vec![]);
        let mut batches = Batches::new(rayon::current_num_threads());
        while !remaining.is_empty() {
            let traced = |(group, point): &(usize, TracedPoint)| self.more(*group, point, paths);
            let (_, more) = batches
                .next(&mut remaining, |batch| batch.par_iter().map(traced).collect::<Vec<_>>());
            done.extend(more);
            agree(progress(done.len(), jobs.len()))?;
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
        let region = self.lit_region();
        for point in self.strata.iter_mut().flat_map(|stratum| &mut stratum.points) {
            let dark = point.sample().measured() == Rgb::ZERO && point.paths >= PATHS_IN_THE_DARK;
            let all = point.sample().measured().length();
            let lamps = if all > 0.0 { point.from_lamps.length() / all } else { 0.0 };
            let outlook = Outlook { dark, lamps, ..point.outlook };
            point.hidden = outlook.is_hidden(&region, point.point.position);
        }
        ControlFlow::Continue(())
    }

    /// Where the light is: what is near or narrow is so beside a lit room, and not beside the wide
    /// plane that the room stands on.
    fn lit_region(&self) -> LitRegion {
        let points = self.strata.iter().flat_map(|s| {
            let flux = |p: &TracedPoint| s.area_of(p) * p.sample().measured().length();
            s.points.iter().map(move |p| (p.point.position, flux(p)))
        });
        let all = self.scene.reflecting_bounds();
        let lit = Aabb::concentrated(&points.collect::<Vec<_>>(), all.diagonal());
        LitRegion::new(lit, || all)
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
            traced.outlook = outlook(&self.tracer, &point.point, &mut rng);
            if traced.outlook.is_open() {
                traced.from_lamps = self.tracer.light_of_lamps(&point.point, 64, &mut rng);
            }
        }
        traced.paths = paths;
        traced
    }

    /// The mean length of reflected radiosity over all that counts, W/m².
    fn mean_reflected(&self, hidden: bool) -> f64 {
        let (mut sum, mut share) = (0.0, 0.0);
        for s in &self.strata {
            let counting = s.points.iter().filter(|p| hidden || !p.hidden);
            for point in counting {
                sum += s.area_of(point) * point.sample().measured().length();
                share += s.area_of(point);
            }
        }
        if share > 0.0 { sum / share } else { 0.0 }
    }

    /// The points of every group that count, in order; none of a group with fewer than two.
    fn counting(&self, hidden: bool) -> Vec<Vec<MeasuredPoint>> {
        let floor = self.settings.measure.floor * self.mean_reflected(hidden);
        let of_group = |(stratum, s): (usize, &Stratum)| {
            let counts = |p: &&TracedPoint| p.solution.is_some() && (hidden || !p.hidden);
            let measured = |p: &TracedPoint| {
                let error = p.sample().square_error(floor);
                MeasuredPoint { stratum, area: s.area_of(p), error }
            };
            let points: Vec<MeasuredPoint> = s.points.iter().filter(counts).map(measured).collect();
            if points.len() < 2 { vec![] } else { points }
        };
        self.strata.iter().enumerate().map(of_group).collect()
    }

    /// The error of every group, by the measure on its own area.
    fn by_group(&self, counting: &[Vec<MeasuredPoint>]) -> Vec<Option<MeanSquare>> {
        let tail = self.settings.measure.tail;
        counting.iter().map(|group| Some(TrimmedSquare::new(group, tail)?.mean)).collect()
    }

    fn trimmed(&self, counting: &[Vec<MeasuredPoint>]) -> TrimmedSquare {
        TrimmedSquare::new(&counting.concat(), self.settings.measure.tail).unwrap_or_default()
    }

    /// The result so far, and the mean square error of the whole.
    pub fn verification(&self) -> (Verification, MeanSquare) {
        let hidden = self.settings.hidden;
        let counting = self.counting(hidden);
        let all = self.trimmed(&counting);
        let is_known = self.paths > 0 && self.missing() < self.drawn();
        let hidden_share: f64 =
            self.strata.iter().map(|s| s.surface.share * s.hidden_share()).sum();
        let with_hidden = match hidden || hidden_share == 0.0 {
            true => all.mean,
            false => self.trimmed(&self.counting(true)).mean,
        };
        let plain = match self.settings.measure.tail {
            0.0 => all.mean,
            _ => TrimmedSquare::new(&counting.concat(), 0.0).unwrap_or_default().mean,
        };
        let verification = Verification {
            error: is_known.then(|| all.mean.root()),
            tail: is_known.then(|| all.tail.max(0.0).sqrt()),
            bias: all.mean.bias,
            error_with_tail: is_known.then(|| plain.root()),
            error_with_hidden: is_known.then(|| with_hidden.root()),
            hidden_share,
            groups: self.group_errors(&counting, &all),
            points: self.point_errors(&counting, &all),
            mean_reflected: self.mean_reflected(hidden),
            paths: self.paths,
            missing: self.missing(),
            stop: Stop::Cancelled,
        };
        (verification, all.mean)
    }

    /// The error of every group, and its share of the tail of `all`, the points `counting`.
    fn group_errors(
        &self,
        counting: &[Vec<MeasuredPoint>],
        all: &TrimmedSquare,
    ) -> Vec<GroupError> {
        // Noise may take the sum of a group below zero, where it has no part in the tail.
        let mut squares = all.tail_squares.iter().copied();
        let of_group =
            |group: &Vec<MeasuredPoint>| squares.by_ref().take(group.len()).sum::<f64>().max(0.0);
        let tails: Vec<f64> = counting.iter().map(of_group).collect();
        let tail_squares: f64 = tails.iter().sum();
        let errors = self.strata.iter().zip(self.by_group(counting)).zip(tails);
        let group_error = |((s, error), tail): ((&Stratum, Option<MeanSquare>), f64)| GroupError {
            group: s.surface.group,
            area_share: s.surface.share,
            points: s.points.len(),
            hidden_share: s.hidden_share(),
            error: error.map(|error| error.root()),
            tail_share: if tail_squares > 0.0 { tail / tail_squares } else { 0.0 },
            bias: error.map_or(0.0, |error| error.bias),
        };
        errors.map(group_error).collect()
    }

    /// The errors of the points where the solution is known, with their shares in the tail of
    /// `all`, the points `counting`.
    fn point_errors(
        &self,
        counting: &[Vec<MeasuredPoint>],
        all: &TrimmedSquare,
    ) -> Vec<PointError> {
        let hidden = self.settings.hidden;
        let floor = self.settings.measure.floor * self.mean_reflected(hidden);
        // Those of the points that count, in the order of all.
        let mut tails = all.in_tail.iter().copied();
        let mut points = vec![];
        for (s, counting) in self.strata.iter().zip(counting) {
            for traced in &s.points {
                let Some(solution) = traced.solution else { continue };
                let sample = traced.sample();
                let counts = !counting.is_empty() && (hidden || !traced.hidden);
                points.push(PointError {
                    position: traced.point.position,
                    normal: self.scene.normal(traced.point.triangle),
                    group: s.surface.group,
                    solution,
                    measured: sample.measured(),
                    standard_error: sample.variance().sqrt(),
                    error: sample.square_error(floor).value.max(0.0).sqrt(),
                    tail: if counts { tails.next().unwrap_or(0.0) } else { 0.0 },
                    hidden: traced.hidden,
                });
            }
        }
        points
    }
}

/// What `point` sees, by rays.
fn outlook(tracer: &PathTracer, point: &SurfacePoint, rng: &mut Rng) -> Outlook {
    let rays = 128;
    let hits = tracer.hits(point, rays, rng);
    let share = 1.0 / rays as f64;
    Outlook {
        covered: share * hits.len() as f64,
        backs: share * hits.iter().filter(|hit| !hit.front).count() as f64,
        inverse_distance: share * hits.iter().map(|hit| 1.0 / hit.distance).sum::<f64>(),
        ..Outlook::default()
    }
}

impl Stratum {
    /// The area that `point` stands for, as a share of that of the scene.
    fn area_of(&self, point: &TracedPoint) -> f64 {
        self.surface.share * point.weight / self.weight
    }

    /// The share of its area that is hidden, by its points.
    fn hidden_share(&self) -> f64 {
        let hidden: f64 = self.points.iter().filter(|p| p.hidden).map(|p| p.weight).sum();
        if hidden > 0.0 { hidden / self.weight } else { 0.0 }
    }
}

impl TracedPoint {
    fn sample(&self) -> Sample {
        let paths = (self.paths / PARTS).max(1) as f64;
        Sample {
            solution: self.solution.unwrap_or(Rgb::ZERO),
            parts: self.sums.map(|sum| sum / paths),
        }
    }
}
