//! The model of error and cost that a bake is steered by: one table of its numbers.
//!
//! The error of a bake is that of [`ErrorEstimate`](crate::ErrorEstimate). It has six parts,
//! independent enough that their squares add up, and each follows one setting:
//!
//! | part | follows | as | cost of it |
//! |---|---|---|---|
//! | mesh | predicted error t of elements | t | vertices: 1/t to 1/t² |
//! | sampling | rays n a vertex | n^−[`RQMC_EXPONENT`] | rays: n |
//! | truncation | one more gather by few rays | nothing is left | a quarter of the gathers |
//! | unshot | share u of the flux not yet shot | u | shots: ln 1/u; after that, gather passes |
//! | sources | the same as the mesh | t | vertices |
//!
//! The model is used four times:
//!
//! 1. *Before:* [`BakeSettings::for_error`](crate::BakeSettings::for_error) turns an error into
//!    settings by the laws below, setting = scale · error^exponent, scaled by the diagonal of where
//!    the light is.
//! 2. *After a pilot:* a few points that gather twice say how many rays it takes in this scene.
//! 3. *After every estimate:* the parts that are too large are lowered to `water_filling_cap`,
//!    each by its own law in one step of bounded size.
//! 4. *Within a time:* cost = constant · error^−p, p at most [`COST_EXPONENT`], says which error
//!    still fits in.
//!
//! Where nothing else is said, a number was chosen by hand, so that three rooms come out at or
//! below the errors asked for at little cost: `scenes/cornell_box.obj`, a room lit from the next
//! room and one with many small boxes. No record of the single trials was kept.
//!
//! `RADIOSITY_BENCH=full cargo bench --bench error_model [-- SCENE.obj …]` measures the laws. Of
//! `scenes/cornell_box.obj` with rays on the CPU, around an error of 5 %, it printed:
//!
//! | law | fitted exponent | the model's |
//! |---|---|---|
//! | mesh part, by both tolerances and shortest edge | 0.48 | 1 |
//! | sampling part, by rays | −0.74 | −0.75 |
//! | unshot part, by unshot share | 0.86 | 1 |
//! | truncation part, factor a gather pass | 0.81 | 0.59 |
//! | seconds, by error (on a busy machine) | −1.4 to −2.0 | −1.5 |
//! | error against a finer bake, by shooting edge | 0.03 | 2.5 |
//!
//! The tail factor came out at 1.1 and 1.2 (the model's: 1.8), against a finer bake and not against
//! the truth. The fit of the mesh part is rough: with half the rays it was 0.24. Laws are off by
//! that much in single scenes; the rounds of refinement after an estimate make up for it.

use std::ops::RangeInclusive;

use crate::gather::RefinementSettings;
use crate::mesh::Mesh;

/// A setting as a power of the error it is for: setting = scale · error^exponent.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct PowerLaw {
    /// The setting for an error of 1: of lengths, as a share of the scene's diagonal.
    pub scale: f64,
    /// How steeply the setting follows the error; the error follows the setting with one over this.
    pub exponent: f64,
}

impl PowerLaw {
    const fn new(scale: f64, exponent: f64) -> PowerLaw {
        PowerLaw { scale, exponent }
    }

    /// The same for lengths in the scene's unit, given the scene's `diagonal`.
    pub(super) fn times(self, diagonal: f64) -> PowerLaw {
        PowerLaw { scale: self.scale * diagonal, ..self }
    }

    /// The setting for `error`, relative root mean square.
    pub fn setting(self, error: f64) -> f64 {
        self.scale * error.powf(self.exponent)
    }
}

// ---- 1. Settings for an error ------------------------------------------------------------------

/// Errors that the laws below are for; those outside get the settings of the nearest of these.
pub const ERRORS: RangeInclusive<f64> = 1e-4..=0.3;

/// Longest edge of the elements that light is shot on, share of the diagonal: error ∝ edge^2.5.
pub const SHOOTING_EDGE: PowerLaw = PowerLaw::new(0.105, 0.4);

/// The same for errors at which it is the larger of the two.
pub const COARSE_SHOOTING_EDGE: PowerLaw = PowerLaw::new(0.6, 1.0);

/// Levels that a triangle is split at most for elements that light is shot on: where sizes grow
/// with the distance, a huge triangle may reach into the region of the light, and a device keeps
/// four to the power of this for each.
pub(super) const MAX_SHOOTING_DEPTH: u32 = 8;

/// Elements that light is shot on, contacts not counted: more are made larger. Chosen by hand, as
/// many as there may be of those that gather.
pub const MAX_SHOOTING_ELEMENTS: usize = 1 << 19;

/// Longest edge of the elements whose corners gather first, share of the diagonal. It follows
/// the error slowly, since elements are split where light is not linear.
pub const GATHER_EDGE: PowerLaw = PowerLaw::new(0.3, 0.3);

/// Length that light seldom changes below, share of the diagonal: gathering elements are split down
/// to an eighth of it.
pub const MIN_EDGE: PowerLaw = PowerLaw::new(0.1, 0.85);

/// Root mean square of the predicted relative error of elements that are not split. Fitted by
/// `docs/data/mesh_error.tsv`: at 10 % thirteen scenes meet the error at their first estimate with
/// 0.08 too, and take 0.7 of the time that 0.05 does; at 5 and 2 % two of four need further rounds
/// with 0.8 times the error, and none with 0.6 and 0.5 times.
pub const MESH_ERROR: PowerLaw = PowerLaw::new(1.25, 1.25);

/// Share of the radiosity that the quadratic interpolant of an element may be off from the exported
/// triangles.
pub const INTERPOLATION_TOLERANCE: PowerLaw = PowerLaw::new(0.5, 1.0);

/// The error asked for over the share of flux left unshot: shooting is to be a small part of the
/// error, since it is not repeated.
pub const ERROR_OVER_UNSHOT: f64 = 40.0;

/// The solver's patch tolerance: the error itself, or [`PATCH_TOLERANCE_BASE`] plus this share of
/// it where that is less.
pub const PATCH_TOLERANCE_SHARE: f64 = 0.4;

/// See [`PATCH_TOLERANCE_SHARE`].
pub const PATCH_TOLERANCE_BASE: f64 = 0.02;

/// Rays a vertex times the error, before a pilot says more.
pub const RAYS_TIMES_ERROR: f64 = 20.0;

/// Hemicube resolution by error: the first whose bound the error is above; the last for all others.
/// Halving the error about doubles the pixels of an edge, in powers of two.
pub const HEMICUBE_RESOLUTIONS: [(f64, u32); 4] =
    [(0.03, 32), (0.006, 64), (0.003, 128), (0.0, 256)];

/// Elements that gather there may be for each triangle of a scene, where that is more than
/// [`RefinementSettings::DEFAULT_MAX_ELEMENTS`]: asked for 10 %, a city of 200 000 triangles that
/// was given 4 of them stayed at 19 %, and with 20 reached 8.5 %, as one of 20 000 does.
const MAX_ELEMENTS_PER_TRIANGLE: usize = 20;

/// Elements that there may be at most: each takes 0.7 kB, and that city 2.9 GB in all.
const MAX_ELEMENTS: usize = 1 << 22;

/// Elements that there may be for each triangle in any case.
const MIN_ELEMENTS_PER_TRIANGLE: usize = 4;

/// Elements that gather there may be at most in a scene of so many `triangles`.
pub(super) fn max_elements(triangles: usize) -> usize {
    let most = (MAX_ELEMENTS_PER_TRIANGLE * triangles)
        .clamp(RefinementSettings::DEFAULT_MAX_ELEMENTS, MAX_ELEMENTS);
    most.max(MIN_ELEMENTS_PER_TRIANGLE * triangles)
}

/// Levels by which elements at contacts are split.
pub const CONTACT_LEVELS: u32 = 2;

/// Below this error they are split once more.
pub const FINE_CONTACTS_BELOW: f64 = 0.009;

/// Above this error gathering elements at contacts are split once only.
pub const COARSE_CONTACTS_ABOVE: f64 = 0.07;

/// Up to this error vertices gather twice, since the first time they see what was shot on elements.
pub const TWO_PASSES_UP_TO: f64 = 0.03;

/// Triangles of which no smoothing group is known share vertices where their normals differ by up
/// to so many times the error, radians. A shared vertex has the light of the mean normal, which is
/// half of the angle δ from either; the irradiance from one direction at an angle θ is off by
/// tan θ · δ/2 then, and between three vertices half of such squares are left: 0.35 δ at 45°, half
/// of the error.
pub const CREASE_TIMES_ERROR: f64 = 1.3;

/// Receivers within this many patch diameters get closed-form factors, whatever the error.
pub const NEAR_REACH: f64 = 1.0;

/// The angle up to which triangles of no known smoothing group share vertices for `error`, degrees.
pub(super) fn crease_degrees(error: f64) -> f64 {
    let degrees = (CREASE_TIMES_ERROR * error).to_degrees();
    degrees.clamp(Mesh::COPLANAR_DEGREES, Mesh::CREASE_DEGREES)
}

/// The solver's patch tolerance for `error`.
pub(super) fn patch_tolerance(error: f64) -> f64 {
    error.min(PATCH_TOLERANCE_BASE + PATCH_TOLERANCE_SHARE * error)
}

/// Rays with which an element gathers the light that is not shot: its noise is averaged by those
/// that gather next, and the more elements there are the better. Chosen by hand.
const RECEIVED_RAYS: RangeInclusive<f64> = 32.0..=128.0;

/// Rays of all elements together at which each begins to cast fewer. Chosen by hand.
const RECEIVED_RAYS_OF_ALL: usize = 1 << 22;

/// Rays with which each of so many `points` gathers the light that is not shot.
pub(super) fn received_rays(points: usize) -> u32 {
    clamped(RECEIVED_RAYS_OF_ALL as f64 / points.max(1) as f64, RECEIVED_RAYS) as u32
}

/// Pixels along an edge of a hemicube's top face for `error`.
pub(super) fn hemicube_resolution(error: f64) -> u32 {
    let [.., (_, finest)] = HEMICUBE_RESOLUTIONS;
    let step = HEMICUBE_RESOLUTIONS.into_iter().find(|&(bound, _)| error > bound);
    step.map_or(finest, |(_, resolution)| resolution)
}

/// Levels by which elements whose corners gather are split at contacts, for `error`.
pub(super) fn gathering_contact_levels(error: f64) -> u32 {
    if error > COARSE_CONTACTS_ABOVE {
        1
    } else if error < FINE_CONTACTS_BELOW {
        CONTACT_LEVELS + 1
    } else {
        CONTACT_LEVELS
    }
}

/// Times that all vertices gather, for `error`.
pub(super) fn gather_passes(error: f64) -> u32 {
    if error > TWO_PASSES_UP_TO { 1 } else { 2 }
}

// ---- 2. The pilot ------------------------------------------------------------------------------

/// Points that gather twice, to choose the number of rays by.
pub const PILOT_POINTS: usize = 256;

/// What sampling may take of the allowed error, beforehand: a quarter of its square.
pub const SAMPLING_SHARE: f64 = 0.5;

/// Rays a vertex that the pilot may choose.
pub const RAYS: RangeInclusive<f64> = 128.0..=65536.0;

/// Error of n rays ∝ n^−this: between Monte Carlo (0.5) and (0,2)-nets of smooth integrands (1).
pub const RQMC_EXPONENT: f64 = 0.75;

/// A vertex whose rays disagree by so many times the error allowed for sampling gets more of them.
pub const OUTLIER_FACTOR: f64 = 3.0;

/// Passes that only light the last one take so many times fewer rays: their noise is averaged over
/// all that a vertex sees.
pub const COARSE_RAY_DIVISOR: u32 = 4;

/// Places that a vertex sees and exchanges light with, over all vertices: 1 GiB of them.
const MAX_SEEN_PLACES: usize = 1 << 26;

/// Rays by which each of so many `vertices` finds what it exchanges further bounces with, where it
/// gathers with `rays`.
pub(super) fn rays_of_rows(rays: u32, vertices: usize) -> u32 {
    let most = (MAX_SEEN_PLACES / vertices.max(1)).max(1);
    rays.div_ceil(COARSE_RAY_DIVISOR).min(u32::try_from(most).unwrap_or(u32::MAX))
}

// ---- 3. Rounds of refinement -------------------------------------------------------------------

/// Paths by which a point finds what bounces after the next one would add: noise is averaged over
/// all points.
pub const LATER_PATHS: u32 = 16;

/// The estimate has to be below this share of the error asked for, which leaves room for what it
/// does not see: five rooms to 10, 5 and 2 % were off by 0.4 to 1.0 of what was asked for, at 64 to
/// 240 points of each; five scenes that others had made, to 10 %, by 0.78 to 0.87 of it, and a
/// sixth by 1.3 ± 0.3, two thirds of which were three of 15 000 points.
pub const SAFETY: f64 = 0.85;

/// Share of [`SAFETY`] that a round aims at, since errors follow the laws only roughly.
pub const TARGET_FRACTION: f64 = 0.9;

/// Rounds of refinement after the first estimate.
pub const MAX_ROUNDS: u32 = 12;

/// A round is idle after which not so many times the gathers were made as before it.
pub const MIN_PROGRESS: f64 = 1.01;

/// So many idle rounds one after the other are the last.
pub const MAX_IDLE_ROUNDS: u32 = 2;

/// A setting is changed by this factor at least: less is not worth a round.
pub const MIN_STEP: f64 = 1.25;

/// Rays grow by this factor a round at most.
pub const MAX_RAY_STEP: f64 = 8.0;

/// The noise tolerance falls to this share a round at the lowest.
pub const MIN_NOISE_STEP: f64 = 0.25;

/// Both tolerances of the mesh and the shortest edge fall to this share a round at the lowest:
/// elements that were split are not merged again.
pub const MIN_MESH_STEP: f64 = 0.5;

/// Vertices ∝ 1/tolerance^this, between edges of light (1) and areas (2): tolerances that fell to
/// 0.6 multiplied them by 2.2 to 2.4 in a room with many small boxes.
pub const VERTEX_EXPONENT: f64 = 1.6;

/// What all further bounces cost, over what the gathers of all vertices do: they take a quarter of
/// the rays.
pub const BOUNCE_COST: f64 = 1.0 / COARSE_RAY_DIVISOR as f64;

/// Share of the allowed squared error that is left to the parts that can be lowered, however large
/// the one that cannot (unshot light).
pub const MIN_BUDGET: f64 = 0.1;

/// Nearest of `range` to `value`.
pub(super) fn clamped(value: f64, range: RangeInclusive<f64>) -> f64 {
    value.clamp(*range.start(), *range.end())
}

/// The error that a round aims at, for `target`.
pub(super) fn allowed_error(target: f64) -> f64 {
    TARGET_FRACTION * SAFETY * target
}

/// The highest that a part may be after refinement: the parts above it are lowered to it, the
/// others stay, and all and the `fixed` part then add up, squared, to `allowed` squared. Infinite
/// where they are below that already.
///
/// This solves min Σ ln(part_i / new_i) under Σ new_i² = allowed² − fixed² and new_i ≤ part_i: the
/// least product of refinement factors. Its Lagrange condition, new_i equal for all that are
/// lowered, is that of reverse water-filling (Cover and Thomas 2006, section 10.3.3).
pub(super) fn water_filling_cap<const N: usize>(
    mut parts: [f64; N],
    fixed: f64,
    allowed: f64,
) -> f64 {
    parts.sort_by(f64::total_cmp);
    let mut budget = (allowed * allowed - fixed * fixed).max(MIN_BUDGET * allowed * allowed);
    for (k, part) in parts.iter().enumerate() {
        let cap = (budget / (parts.len() - k) as f64).sqrt();
        if *part >= cap {
            return cap;
        }
        budget -= part * part;
    }
    f64::INFINITY
}

/// Whether a `fixed` part of the error leaves the others their least share of `allowed`.
pub(super) fn leaves_budget(fixed: f64, allowed: f64) -> bool {
    fixed * fixed <= (1.0 - MIN_BUDGET) * allowed * allowed
}

/// By how much the vertices are multiplied for the error of the mesh to fall from `error` to `cap`.
pub(super) fn vertex_growth(error: f64, cap: f64) -> f64 {
    (error / cap).max(1.0).powf(VERTEX_EXPONENT)
}

/// By how much the rays have to be multiplied for sampling to fall from `error` to `allowed`.
pub(super) fn ray_factor(error: f64, allowed: f64) -> f64 {
    (error / allowed).powf(1.0 / RQMC_EXPONENT)
}

/// By how much the rays are multiplied in a round for sampling to fall from `error` to `cap`.
pub(super) fn ray_step(error: f64, cap: f64) -> f64 {
    ray_factor(error, cap).clamp(MIN_STEP, MAX_RAY_STEP)
}

/// By how much the noise tolerance is multiplied in a round for the same.
pub(super) fn noise_step(error: f64, cap: f64) -> f64 {
    (cap / error).clamp(MIN_NOISE_STEP, 1.0 / MIN_STEP)
}

/// By how much both tolerances of the mesh and the shortest edge are multiplied in a round for the
/// error of the mesh to fall from `error` to `cap`: it is taken as proportional to them.
pub(super) fn mesh_step(error: f64, cap: f64) -> f64 {
    (cap / error).clamp(MIN_MESH_STEP, 1.0 / MIN_STEP)
}

// ---- 4. Bakes within a time --------------------------------------------------------------------

/// The first error that is tried, which takes little.
pub const INITIAL_ERROR: f64 = 0.2;

/// Seconds ∝ error^−this, at the most: vertices times the rays of each. Two bakes tell more of it.
pub const COST_EXPONENT: f64 = VERTEX_EXPONENT + 1.0 / RQMC_EXPONENT;

/// The same at the least, since there is more than rows of light, and seconds vary.
pub const MIN_COST_EXPONENT: f64 = 1.0;

/// Share of the remaining time that the next error is chosen for: what it takes is a guess. With
/// 0.5, four scenes in 60 s were told 6.9, 11.9, 6.5 and 9.8 %, with 0.8 7.2, 7.9, 5.4 and 8.5 %.
pub const TIME_FRACTION: f64 = 0.8;

/// Share of the time that is kept for the estimate of what was reached, should a bake be stopped.
pub const TIME_FOR_ESTIMATE: f64 = 0.1;

/// A further bake has to be of an error smaller by this factor, as each starts from nothing.
pub const MIN_IMPROVEMENT: f64 = 1.3;

/// The exponent by which an error `smaller` so many times takes so many times `longer`.
pub(super) fn cost_exponent(smaller: f64, longer: f64) -> f64 {
    (longer.ln() / smaller.ln()).clamp(MIN_COST_EXPONENT, COST_EXPONENT)
}

/// How many times smaller the next error may be that takes about [`TIME_FRACTION`] of `remaining`
/// seconds, where this one took `taken` and seconds grow by this `exponent`.
pub(super) fn affordable_improvement(remaining: f64, taken: f64, exponent: f64) -> f64 {
    (TIME_FRACTION * remaining / taken).powf(1.0 / exponent)
}

// ---- Estimation of the error -------------------------------------------------------------------

/// Random points that the estimate takes: at least, and at most.
pub const SAMPLES: RangeInclusive<usize> = 192..=1 << 14;

/// The estimate takes one point for so many that vertices gathered at; each gathers three times, so
/// that it costs about a sixteenth of them.
pub const GATHERS_PER_SAMPLE: usize = 48;

/// Random points for an estimate after `gathers` at vertices.
pub(super) fn sample_count(gathers: u64) -> usize {
    (gathers as usize / GATHERS_PER_SAMPLE).clamp(*SAMPLES.start(), *SAMPLES.end())
}

/// Rays a point where the elements' own light is estimated, which no vertex gathered.
pub const ELEMENT_RAYS: u32 = 1024;

/// Two gathers averaged have half the variance of one. Between three vertices of independent error,
/// at random places in a triangle, half of one's variance is left too (∫ Σ λ_i² = 1/2).
pub const HALF: f64 = 0.5;

/// Share of the measured squared difference that is error, at least, however large the noise that
/// is subtracted from it is estimated: a variance found by subtraction may come out negative.
pub const MIN_ERROR_SHARE: f64 = 0.1;

/// Share of the squared error that is called sampling, at most; the rest is called the mesh's,
/// whose own error noise hides.
pub const MAX_SAMPLING_SHARE: f64 = 0.7;

/// The standard errors of vertices are multiplied by this, so that 95 % of them are off by no more
/// than twice as much: errors have heavier tails than a normal distribution. It was 1.8 for
/// estimates over all of the area. Those of vertices are in proportion to an estimate that leaves
/// out the tail, but vertices may be in it: with it the error of the Cornell box at 5 % is 3.53 %,
/// without 3.14 %, 1.12 times less.
pub const TAIL_FACTOR: f64 = 2.0;

/// Points on each group, at least: enough to see an error that is everywhere.
pub const SAMPLES_PER_GROUP: usize = 8;

/// The same where every group is asked for an error.
pub const SAMPLES_PER_JUDGED_GROUP: usize = 48;

/// Points on each group, at most, that it takes to decide whether its error is met.
pub const MAX_SAMPLES_PER_GROUP: usize = 768;

/// Points over all for one on each group: where the whole is undecided, it takes up to this many
/// times [`MAX_SAMPLES_PER_GROUP`]. A round that splits elements costs far more: of a furnished
/// room, a castle and a village to 10 %, the first estimates, by 3 700 to 8 400 points, were 0.075
/// to 0.089, and by twice as many below the 0.075 that is to be met. With 4 in place of 16, which
/// asked no more of them, their bakes took 42, 40 and 80 s; with 16 they take 28, 27 and 38.
pub const SAMPLES_RATIO: usize = 16;

/// Seed of the points at which paths measure a result: others than those of a later measurement.
pub const JUDGE_SEED: u64 = 0x7261_6469_6f73;

/// The standard error down to which an error is measured that is close to what was asked for, as a
/// share of itself.
pub const JUDGE_PRECISION: f64 = 0.1;

/// Points at which paths measure a result, at least: rare errors take many points, of few paths.
pub const JUDGE_POINTS: usize = 1024;

/// Paths at each of them, to begin with: few show whether more of them are worth their time.
pub const JUDGE_FIRST_PATHS: usize = 16;

/// Points on each group at which paths measure a result, at least.
pub const JUDGE_POINTS_PER_GROUP: usize = 2;

/// The same where every group is asked for an error.
pub const JUDGED_POINTS_PER_GROUP: usize = 64;

/// Paths that a result is measured by, at most: so many,
pub const JUDGE_PATHS: u64 = 1 << 18;

/// or one for so many rays of the vertices, if that is more.
pub const RAYS_PER_PATH: u64 = 32;

/// Paths that there may be, at least, where it is in doubt whether the error is met: they take a
/// second or two. Chosen by hand: in a gap of a centimetre above a lamp a small box had told 7 %,
/// and was off by 17.5 ± 2.1 %, which 128 paths at each of 1024 points leave open, and 1024 do not.
pub const PATHS_IN_DOUBT: u64 = 1 << 21;

/// Paths by which a result is measured, at most, for which vertices gathered so many times with so
/// many rays; and where it is in doubt whether it is as it should.
pub(super) fn judge_paths(gathers: u64, rays: u32) -> [u64; 2] {
    let paths = (gathers * u64::from(rays) / RAYS_PER_PATH).max(JUDGE_PATHS);
    [paths, paths.max(PATHS_IN_DOUBT)]
}

/// Groups that get points of their own: the largest. All others are judged together.
pub const MAX_GROUPS: usize = 64;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn water_filling_meets_the_budget() {
        let square = |parts: [f64; 3]| parts.iter().map(|p| p * p).sum::<f64>();
        let cases =
            [([3.0, 4.0, 5.0], 0.0, 5.0), ([0.1, 4.0, 5.0], 1.0, 2.0), ([0.1, 0.2, 5.0], 0.1, 1.0)];
        for (parts, fixed, allowed) in cases {
            let cap = water_filling_cap(parts, fixed, allowed);
            let lowered = parts.map(|p| p.min(cap));
            let sum = square(lowered) + fixed * fixed;
            assert!((sum - allowed * allowed).abs() < 1e-12, "{parts:?}: {cap}");
            // Any other way to meet the budget lowers the parts by more in all: a share moved from
            // one lowered part to another one.
            let factors = |new: [f64; 3]| (0..3).map(|k| (parts[k] / new[k]).ln()).sum::<f64>();
            for (from, to) in [(0, 1), (1, 2), (2, 1), (2, 0), (1, 0)] {
                for share in [0.01, 0.3] {
                    let mut other = lowered.map(|p| p * p);
                    let moved = share * other[from];
                    other[from] -= moved;
                    other[to] += moved;
                    let other = other.map(f64::sqrt);
                    if other[to] <= parts[to] {
                        assert!(factors(other) > factors(lowered), "{parts:?} {from} {to}");
                    }
                }
            }
        }
        assert_eq!(water_filling_cap([1.0, 1.0, 1.0], 0.0, 2.0), f64::INFINITY);
        // What cannot be lowered leaves a tenth of the budget to the others.
        let cap = water_filling_cap([1.0, 1.0, 1.0], 9.0, 1.0);
        assert!((cap - (MIN_BUDGET / 3.0).sqrt()).abs() < 1e-15);
    }

    #[test]
    fn elements_grow_with_triangles_within_bounds() {
        let few = RefinementSettings::DEFAULT_MAX_ELEMENTS;
        let cases = [(0, few), (26_000, few), (100_000, 2_000_000), (1_000_000, MAX_ELEMENTS)];
        assert_eq!(cases.map(|(triangles, _)| max_elements(triangles)), cases.map(|c| c.1));
        assert_eq!(max_elements(2_000_000), 8_000_000);
    }

    #[test]
    fn laws_and_factors_invert_one_another() {
        let law = MIN_EDGE.times(7.0);
        let finer = law.setting(0.01) / law.setting(0.04);
        assert!((finer - 4f64.powf(-MIN_EDGE.exponent)).abs() < 1e-15);
        let factor = ray_factor(0.04, 0.01);
        assert!((0.04 * factor.powf(-RQMC_EXPONENT) - 0.01).abs() < 1e-15);
        let improvement = affordable_improvement(20.0, 1.0, 2.0);
        assert!((improvement.powi(2) - TIME_FRACTION * 20.0).abs() < 1e-12);
        assert!((cost_exponent(improvement, TIME_FRACTION * 20.0) - 2.0).abs() < 1e-12);
        // Whatever the clock says.
        assert_eq!(cost_exponent(2.0, 0.5), MIN_COST_EXPONENT);
        assert_eq!(cost_exponent(2.0, 1e3), COST_EXPONENT);
    }
}
