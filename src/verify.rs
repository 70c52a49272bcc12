//! How far off a solution is, by path tracing the scene at random points: an instrument that shares
//! nothing with the solver but the casting of rays.
//!
//! ```text
//! scene ──► random points of ──► B: the solution's face there ─────────────┐
//!           each group      └──► T: paths in four independent parts ──► mean square error
//!                                 ▲                                        of groups, of all
//!                                 └── more paths, or more points, by which adds more variance
//! ```
//!
//! The measure is that of [`accuracy`](crate::accuracy), over the points that are not hidden unless
//! these are asked for ([`Settings::hidden`]).
//!
//! Noise of the paths adds no error: with two independent means T₁ and T₂, (B − T₁)·(B − T₂) has
//! the expectation |B − B_true|². Which points are in the tail is decided by other paths than those
//! that measure them.

mod sampler;
mod settings;
mod solution;
mod statistics;
mod surfaces;
mod verification;

use std::ops::ControlFlow;

pub use crate::accuracy::Estimate;
use crate::error::{Error, ErrorKind};
pub use crate::light::{PathTracer, Reflected, SurfacePoint};
use crate::scene::Scene;
use crate::vertex::VertexMesh;
use crate::visibility::lit_sides::is_resolved;
use crate::work::now;
use sampler::Sampler;
pub use settings::Settings;
pub(crate) use solution::Solution;
use solution::SolutionLookup;
use statistics::PARTS;
pub(crate) use surfaces::octaves_of;
pub use verification::{GroupError, PointError, Progress, Stop, Verification};

/// Paths per point in the first round, and the minimum for a result.
const FIRST_PATHS: usize = 64;

/// Measures how far `solution` is off on `scene`. `progress` hears several times a second how far
/// it has come; with a break, the result is that of the rounds before.
///
/// The same scene, solution and settings give the same numbers, whatever the number of threads;
/// where time runs out, how many rounds there are depends on the machine.
///
/// # Errors
/// - [`Setting`](crate::ErrorKind::Setting) for a setting out of range.
/// - [`Scene`](crate::ErrorKind::Scene) when nothing in the scene reflects or nothing emits, when
///   the solution is malformed, emits something else than the scene, as far as its vertices tell
///   that (they have irradiance), or when more than one point in a hundred lies on none of its
///   faces.
pub fn verify(
    scene: &Scene,
    solution: &VertexMesh,
    settings: &Settings,
    progress: impl FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Verification, Error> {
    Verifier::new(&scene.resolve_sides(), settings)?.measure(solution, progress)
}

/// Random points of a scene with the light that paths find there, at which solutions of the scene
/// are measured, one after the other: paths are traced once for all of them.
#[derive(Debug)]
pub struct Verifier<'a> {
    sampler: Sampler<'a>,
    settings: Settings,
    /// Points over all, before those that groups have at least; and paths at each.
    points: usize,
    paths: usize,
}

/// What ends a measurement before it is as precise as asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Limits {
    /// Target: the measurement may end when it is known whether the error is below.
    pub error: Option<f64>,
    /// Whether every group is to meet it.
    pub each_group: bool,
    /// Paths over all points, for all measurements together.
    pub paths: Option<u64>,
    /// The same where the measured error, or its standard error, is above the target.
    pub paths_in_doubt: Option<u64>,
}

impl<'a> Verifier<'a> {
    /// For solutions of `scene`, which has its sides resolved ([`Scene::resolve_sides`]). There are
    /// no points before the first [`measure`](Verifier::measure).
    ///
    /// # Errors
    /// - [`Setting`](crate::ErrorKind::Setting) for a setting out of range.
    /// - [`Scene`](crate::ErrorKind::Scene) when sides are not resolved, nothing in the scene
    ///   reflects or nothing emits.
    pub fn new(scene: &'a Scene, settings: &Settings) -> Result<Verifier<'a>, Error> {
        settings.check()?;
        if !is_resolved(scene) {
            let remedy = "measure in the scene that `Scene::resolve_sides` gives";
            return Err(Error::new(ErrorKind::Scene, "sides", "not resolved", remedy));
        }
        Verifier::starting_with(scene, settings.clone(), 512, FIRST_PATHS)
    }

    /// With `points` in the first round, or more if there are many vertices, and `paths` at each.
    pub(crate) fn starting_with(
        scene: &'a Scene,
        settings: Settings,
        points: usize,
        paths: usize,
    ) -> Result<Verifier<'a>, Error> {
        let sampler = Sampler::new(scene, &settings)?;
        Ok(Verifier { sampler, settings, points, paths })
    }

    /// Measures `solution`, with as many more points and paths as it takes: see [`verify`].
    ///
    /// # Errors
    /// [`Scene`](crate::ErrorKind::Scene) as [`verify`] has it for a solution.
    pub fn measure(
        &mut self,
        solution: &VertexMesh,
        mut progress: impl FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Verification, Error> {
        let solution = SolutionLookup::new(solution, self.sampler.scene())?;
        self.measure_within(Limits::default(), &solution, &mut progress)
    }

    /// Measures `solution` at the points that there are, by the paths that were traced there: as
    /// exactly as these tell, and [`Stop::Rounds`].
    ///
    /// # Errors
    /// Those of [`Verifier::measure`].
    pub fn measure_at_same_points(&mut self, solution: &VertexMesh) -> Result<Verification, Error> {
        let solution = SolutionLookup::new(solution, self.sampler.scene())?;
        self.sampler.forget();
        self.sampler.look_up(&solution)?;
        Ok(Verification { stop: Stop::Rounds, ..self.sampler.verification().0 })
    }

    /// Measures `solution` in one round, by this many `paths` over all points.
    ///
    /// # Errors
    /// Those of [`Verifier::measure`].
    pub(crate) fn measure_once(
        &mut self,
        paths: usize,
        solution: &dyn Solution,
    ) -> Result<Verification, Error> {
        self.sampler.forget();
        self.sampler.add_points(self.points);
        self.sampler.look_up(solution)?;
        let of_point = (paths / self.sampler.drawn().max(1)).max(PARTS).next_multiple_of(PARTS);
        let _ = self.sampler.trace(of_point, |_, _| ControlFlow::Continue(()));
        Ok(Verification { stop: Stop::Rounds, ..self.sampler.verification().0 })
    }

    /// As [`Verifier::measure`], no further than `limits`.
    pub(crate) fn measure_within(
        &mut self,
        limits: Limits,
        solution: &dyn Solution,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Verification, Error> {
        let (sampler, settings) = (&mut self.sampler, &self.settings);
        let start = now();
        // A point per 64 vertices: the finer a mesh, the rarer what it misses. Of 26 901 points of
        // a room of half a million vertices, two had 30 % of the squared error.
        self.points = self.points.max(solution.vertices() / 64);
        sampler.forget();
        let (mut verification, _) = sampler.verification();
        verification.stop = loop {
            sampler.add_points(self.points);
            sampler.look_up(solution)?;
            let round = |done, of| progress(&Progress { done, of, error: verification.error });
            if sampler.trace(self.paths, round).is_break() {
                break Stop::Cancelled;
            }
            let all;
            (verification, all) = sampler.verification();
            let error = all.root();
            // What a biased mean square adds to its root.
            let biased = all.bias > settings.precision * all.value;
            if error.value + 2.0 * error.standard_error <= 1e-4 {
                break Stop::Negligible;
            }
            let is_precise = error.standard_error <= settings.precision * error.value;
            let enough = self.paths >= FIRST_PATHS;
            let traced = (sampler.drawn() * self.paths) as u64;
            let stop = if enough && !biased && (is_precise || limits.decided_by(&error)) {
                Stop::Precise
            } else if settings.time.is_some_and(|time| 2 * (now() - start) > time) {
                // Another round doubles all that was done so far.
                break Stop::Time;
            } else if limits.end_at(traced, &error)
                || self.points >= 1 << 22
                || self.paths >= 1 << 30
            {
                Stop::Rounds
            } else {
                match 2.0 * all.noise > all.variance || biased {
                    true => self.paths *= 2,
                    false => self.points *= 2,
                }
                continue;
            };
            // The whole is known well enough; groups may not be.
            let is_open = |group: &Estimate| limits.leaves_open(group, settings.precision);
            let more = (sampler.double(is_open) * self.paths) as u64;
            if more == 0 || limits.paths.is_some_and(|most| traced + more > most) {
                break stop;
            }
        };
        Ok(verification)
    }
}

impl Limits {
    /// Whether `error` is above or below the target by two standard errors, and known to a quarter.
    fn decided_by(&self, error: &Estimate) -> bool {
        let off = error.standard_error;
        let is_far = |limit: f64| (error.value - limit).abs() > 2.0 * off;
        self.error.is_some_and(is_far) && off <= 0.25 * error.value
    }

    /// Whether a `group` is within one standard error of the target, and not yet known to
    /// `precision`.
    fn leaves_open(&self, group: &Estimate, precision: f64) -> bool {
        let off = group.standard_error;
        let is_near = |limit: f64| (group.value - limit).abs() <= off;
        self.each_group && self.error.is_some_and(is_near) && off > precision * group.value
    }

    /// Whether there is no other round after `traced` paths, of twice as many: the limit is
    /// reached, or further rounds would be in vain. They are if all paths up to the limit would not
    /// distinguish the target, or the lower bound of the error, from 0, even with noise ∝ 1/paths.
    fn end_at(&self, traced: u64, error: &Estimate) -> bool {
        let is_in_doubt = self.error.is_some_and(|e| error.value.max(error.standard_error) > e);
        let Some(most) = (if is_in_doubt { self.paths_in_doubt } else { self.paths }) else {
            return false;
        };
        let lower_bound = error.value - 2.0 * error.standard_error;
        let off = error.standard_error / (most / traced).max(1) as f64;
        let in_vain = self.error.is_some_and(|limit| 2.0 * off > limit.max(lower_bound));
        2 * traced > most || in_vain
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Rgb, Triangle};
    use glam::DVec3;

    #[test]
    fn what_is_in_doubt_has_more_paths() {
        let paths = 1 << 18;
        let in_doubt = 8 * paths;
        let limits = Limits {
            error: Some(0.1),
            each_group: false,
            paths: Some(paths),
            paths_in_doubt: Some(in_doubt),
        };
        let ends = |traced: u64, value: f64, standard_error: f64| {
            limits.end_at(traced, &Estimate { value, standard_error })
        };
        assert!(!ends(paths / 2, 0.07, 0.03) && ends(paths, 0.07, 0.03), "surely below, or open");
        assert!(!ends(paths, 0.2, 0.06) && ends(in_doubt, 0.2, 0.06), "perhaps above");
        assert!(!ends(paths, 0.08, 0.17) && ends(in_doubt, 0.08, 0.17), "nothing known");
        assert!(ends(paths, 0.08, 0.5), "eight times the paths would know nothing either");
        let unasked = Limits { error: None, ..limits };
        assert!(unasked.end_at(paths, &Estimate { value: 0.2, standard_error: 0.06 }));
    }

    #[test]
    fn a_group_near_the_limit_has_more_points() {
        // Two regular tetrahedra seen from within, the second a hundred times smaller. One that
        // reflects ρ of an exitance of 1 has the radiosity 1/(1 − ρ).
        let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        let positions = [(100.0, 0.0), (1.0, 200.0)].into_iter().flat_map(|(size, at)| {
            corners.map(|corner| size * DVec3::from_array(corner) + DVec3::X * at)
        });
        let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        let triangles = (0..2).flat_map(|group| {
            faces.map(|face| Triangle {
                corners: face.map(|k| k + 4 * group),
                group,
                ..Default::default()
            })
        });
        let bright = Material { exitance: Rgb::ONE, ..Material::grey("bright", 0.5) };
        let names = vec!["large".into(), "small".into()];
        let scene =
            Scene::new(positions.collect(), triangles.collect(), names, vec![bright]).unwrap();
        // All of the large one is off by 0.2. One face of the small one is, so that all of it is by
        // 0.1: of 64 points 16 ± 3.5 find that, and by these it is 0.1 ± 0.011.
        let mut vertices = VertexMesh::default();
        for t in 0..8 {
            let first = vertices.positions.len() as u32;
            vertices.positions.extend(scene.corners(t));
            vertices.normals.extend([scene.normal(t); 3]);
            vertices.radiosity.extend([Rgb::splat(if t < 5 { 2.2 } else { 2.0 }); 3]);
            vertices.faces.push([first, first + 1, first + 2]);
        }
        let points = |limit: f64, each_group: bool, paths: u64| {
            let settings = Settings {
                precision: 0.05,
                points_per_group: 64,
                time: None,
                ..Default::default()
            };
            let mut verifier = Verifier::starting_with(&scene, settings, 64, 2048).unwrap();
            let paths = Some(paths);
            let limits = Limits { error: Some(limit), each_group, paths, paths_in_doubt: paths };
            let solution = SolutionLookup::new(&vertices, &scene).unwrap();
            let go = &mut |_: &Progress| ControlFlow::Continue(());
            let found = verifier.measure_within(limits, &solution, go);
            found.unwrap().groups.iter().map(|group| group.points).collect::<Vec<_>>()
        };
        let most = 1 << 22;
        assert_eq!(points(0.1, false, most), [64, 64], "only the whole is to meet it");
        assert_eq!(points(0.5, true, most), [64, 64], "far from the limit");
        let [large, small] = points(0.1, true, most)[..] else { panic!("two groups") };
        assert!(large == 64 && small >= 128, "{small}");
        assert_eq!(points(0.1, true, 2048 * 130), [64, 64], "no more paths than there may be");
    }
}
