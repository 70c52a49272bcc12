//! The model of error and cost that controls a bake.
//!
//! The error of a bake is that of [`ErrorEstimate`](crate::bake::ErrorEstimate). Its parts are
//! treated as independent: their squares add up. Each follows one setting:
//!
//! | part | follows | as | cost |
//! |---|---|---|---|
//! | mesh | predicted error t of elements | t | vertices: t^−[`VERTEX_EXPONENT`] |
//! | sampling | rays n per vertex | n^−[`RQMC_EXPONENT`] | rays: n |
//! | truncation | exchange of all further bounces | 0 | a quarter of the gathers |
//! | unshot | share u of the flux not yet shot | u | shots: ln 1/u; after that, gather passes |
//! | sources | the same as the mesh | t | vertices |
//!
//! The model is used three times:
//!
//! 1. *Before:* [`BakeSettings::for_error`](crate::BakeSettings::for_error) computes settings from
//!    an error by power laws.
//! 2. *After a pilot:* a few points that gather twice give the number of rays.
//! 3. *After every estimate:* parts above `water_filling_cap` are lowered to it, each by its own
//!    law in one step of bounded size.
//!
//! Constants without another source were chosen on three scenes (`scenes/cornell_box.obj`, a room
//! lit from the next room, a room with many small boxes) so that measured errors are at or below
//! those asked for. Results depend on them by cost and by the number of rounds; the estimate
//! decides when a bake ends.
//!
//! `RADIOSITY_BENCH=full cargo bench --bench error_model [-- SCENE.obj …]` measures the laws. For
//! `scenes/cornell_box.obj` with rays on the CPU, around an error of 5 %, it printed:
//!
//! | law | fitted exponent | model |
//! |---|---|---|
//! | mesh part, by both tolerances and shortest edge | 0.48 | 1 |
//! | sampling part, by rays | −0.74 | −0.75 |
//! | unshot part, by unshot share | 0.86 | 1 |
//! | seconds, by error (on a busy machine) | −1.4 to −2.0 | −1 to −2.9 |
//! | error against a finer bake, by shooting edge | 0.03 | 2.5 |
//!
//! With half the rays the fit of the mesh part was 0.24. Rounds of refinement correct such
//! deviations.

use std::ops::RangeInclusive;

use crate::gather::RefinementSettings;
use crate::mesh::Mesh;

// ---- Settings for an error ---------------------------------------------------------------------

/// Maximum subdivision of a triangle that shoots: a device keeps 4^this elements for each, and
/// triangles that reach from far away into the region of the light would be split further.
pub(super) const MAX_SHOOTING_DEPTH: u32 = 8;

/// Maximum number of elements that gather in a scene of `triangles`: 20 per triangle (a city of
/// 200 000 triangles, asked for 10 %, reached 19 % with 4 per triangle and 8.5 % with 20), within
/// 2^19 to 2^22 (0.7 kB each), and at least 4 per triangle.
pub(super) fn max_elements(triangles: usize) -> usize {
    let per_triangle = (20 * triangles).clamp(RefinementSettings::DEFAULT_MAX_ELEMENTS, 1 << 22);
    per_triangle.max(4 * triangles)
}

/// Maximum number of elements where no vertex gathers, unless there are more triangles. By paths a
/// closed surface of 50 deep folds was 23 % off with 181 600 elements of a 32nd of its diagonal,
/// and 15 % with 63 100 in 0.6 of the time (hidden points counted): where surfaces fill space, rows
/// have too few rays for each element. 200 deeper folds: 74 and 78 % by estimate, in 62 and 27 s.
pub(super) const MAX_PREVIEW_ELEMENTS: usize = 1 << 16;

/// Angle up to which triangles without smoothing group share vertices for `error`, degrees: 1.3
/// times the error in radians. A shared vertex has the light of the mean normal, δ/2 from either;
/// irradiance from an angle θ is then off by tan θ · δ/2, and half of the squares remain between
/// three vertices: 0.35 δ at 45°, half of the error.
pub(super) fn crease_degrees(error: f64) -> f64 {
    (1.3 * error).to_degrees().clamp(Mesh::COPLANAR_DEGREES, Mesh::CREASE_DEGREES)
}

/// Rays per point by which `points` of elements gather the light that is not shot: 2^22 in total,
/// 32 to 128 each. Vertices that gather next average the noise.
pub(super) fn received_rays(points: usize) -> u32 {
    (f64::from(1 << 22) / points.max(1) as f64).clamp(32.0, 128.0) as u32
}

/// Pixels along an edge of a hemicube's top face for `error`: half the error takes about twice as
/// many, in powers of two.
pub(super) fn hemicube_resolution(error: f64) -> u32 {
    match error {
        e if e > 0.03 => 32,
        e if e > 0.006 => 64,
        e if e > 0.003 => 128,
        _ => 256,
    }
}

// ---- Rays --------------------------------------------------------------------------------------

/// Rays per vertex that the pilot and the rounds may choose.
pub(super) const RAYS: RangeInclusive<f64> = 64.0..=65536.0;

/// Minimum number of rays that a pilot chooses for each of the first `vertices`: 2^21 in total, as
/// many as a validation has paths, up to 512 each. Noise is seen before it counts: with 128, 512
/// and 2048 rays, pictures of the Cornell box baked to 10 % were off by 0.053, 0.041 and 0.040
/// (mean of FLIP, Andersson et al. 2020), of a room lit from the next one by 0.085, 0.062 and
/// 0.057. These bakes took 0.9, 0.9 and 1.6 s, and 2.3, 2.4 and 3.1 s.
pub(super) fn min_rays(vertices: usize) -> f64 {
    (f64::from(1 << 21) / vertices.max(1) as f64).clamp(*RAYS.start(), 512.0)
}

/// Rays of a vertex, and of its row, by which light is first known where time is limited, and up to
/// which it is known better before elements are split. Plain choice.
pub(super) const RAYS_OF_FIRST_LIGHT: [u32; 2] = [4, 16];

/// Rays of a vertex where elements are split before there is time for as many as its noise asks
/// for. Of three scenes in 2, 5 and 10 s, 16 and 32 led to the same errors, within 20 %.
pub(super) const RAYS_IN_HASTE: u32 = 32;

/// Minimum number of rays of a gather that only lights the next one. With 16 a city of 18 454
/// triangles was split into four times as many elements by their noise.
pub(super) const MIN_COARSE_RAYS: u32 = 32;

/// Error of n rays ∝ n^−this: between Monte Carlo (0.5) and (0,2)-nets of smooth integrands (1).
pub(super) const RQMC_EXPONENT: f64 = 0.75;

/// Gathers that only light the next gather cast this many times fewer rays: each vertex averages
/// their noise over all that it sees.
pub(super) const COARSE_RAY_DIVISOR: u32 = 4;

/// Rays of the rows by which `vertices` exchange further bounces, where each gathers with `rays`:
/// at most 2^26 entries in total, 1 GiB.
pub(super) fn rays_of_rows(rays: u32, vertices: usize) -> u32 {
    let most = ((1 << 26) / vertices.max(1)).max(1);
    rays.div_ceil(COARSE_RAY_DIVISOR).min(u32::try_from(most).unwrap_or(u32::MAX))
}

/// Error that sampling may have before the first estimate: a quarter of the squared error. Vertices
/// times rays are minimal at 0.45 of it, but elements are split for noise too: with that a floor
/// that a window lights had five times as many vertices.
pub(super) fn allowed_sampling(target: f64) -> f64 {
    0.5 * allowed_error(target)
}

// ---- Rounds of refinement ----------------------------------------------------------------------

/// The estimate has to be below this share of the target: five rooms baked to 10, 5 and 2 % had 0.4
/// to 1.0 of the target at 64 to 240 points each; five scenes of other authors, to 10 %, 0.78 to
/// 0.87, and a sixth 1.3 ± 0.3, two thirds of it at three of 15 000 points.
pub(super) const SAFETY: f64 = 0.85;

/// Share of [`SAFETY`] that a round aims at, since errors follow the laws only roughly.
pub(super) const TARGET_FRACTION: f64 = 0.9;

/// Minimum change of a setting in a round, a factor.
const MIN_STEP: f64 = 1.25;

/// Vertices ∝ 1/tolerance^this, between edges of light (1) and areas (2): tolerances multiplied by
/// 0.6 multiplied them by 2.2 to 2.4 in a room with many small boxes.
pub(super) const VERTEX_EXPONENT: f64 = 1.6;

/// Share of the allowed squared error that is left to the parts that can be lowered, however large
/// the fixed part is.
const MIN_BUDGET: f64 = 0.1;

/// The error that a round aims at, for `target`.
pub(super) fn allowed_error(target: f64) -> f64 {
    TARGET_FRACTION * SAFETY * target
}

/// Upper bound of every part after refinement: larger parts are lowered to it, and the squares of
/// all and of the `fixed` part then add up to `allowed` squared. Infinite where they are below that
/// already.
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

/// Whether a `fixed` part of the error leaves the others [`MIN_BUDGET`] of `allowed` squared.
pub(super) fn leaves_budget(fixed: f64, allowed: f64) -> bool {
    fixed * fixed <= (1.0 - MIN_BUDGET) * allowed * allowed
}

/// Factor of the number of vertices for the error of the mesh to fall from `error` to `cap`.
pub(super) fn vertex_growth(error: f64, cap: f64) -> f64 {
    libm::pow((error / cap).max(1.0), VERTEX_EXPONENT)
}

/// Factor of the rays for sampling to fall from `error` to `allowed`.
pub(super) fn ray_factor(error: f64, allowed: f64) -> f64 {
    libm::pow(error / allowed, 1.0 / RQMC_EXPONENT)
}

/// Factor of the rays in a round, for sampling to fall from `error` to `cap`: at most 8.
pub(super) fn ray_step(error: f64, cap: f64) -> f64 {
    ray_factor(error, cap).clamp(MIN_STEP, 8.0)
}

/// Factor of the noise tolerance in the same round: at least a quarter.
pub(super) fn noise_step(error: f64, cap: f64) -> f64 {
    (cap / error).clamp(0.25, 1.0 / MIN_STEP)
}

/// Factor of both tolerances of the mesh and of the shortest edge in a round, for the error of the
/// mesh to fall from `error` to `cap`, in proportion: at least a half, since elements are not
/// merged again.
pub(super) fn mesh_step(error: f64, cap: f64) -> f64 {
    (cap / error).clamp(0.5, 1.0 / MIN_STEP)
}

/// A bake within a time goes on to this share of the error that it has: about twice the vertices.
pub(super) const IMPROVEMENT_IN_TIME: f64 = 0.75;

// ---- Estimation of the error -------------------------------------------------------------------

/// Minimum number of random points of an estimate.
pub(super) const MIN_SAMPLES: usize = 192;

/// Random points for an estimate after `gathers` at vertices: one per 48 of these, which costs
/// about a sixteenth of them since each point gathers three times.
pub(super) fn sample_count(gathers: u64) -> usize {
    (gathers as usize / 48).clamp(MIN_SAMPLES, 1 << 14)
}

/// Minimum number of points on each group: enough for an error that is everywhere.
pub(super) const SAMPLES_PER_GROUP: usize = 8;

/// Rays per point where the elements' own light is estimated, which no vertex gathered.
pub(crate) const ELEMENT_RAYS: u32 = 1024;

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
        let cases = [(0, few), (26_000, few), (100_000, 2_000_000), (1_000_000, 1 << 22)];
        assert_eq!(cases.map(|(triangles, _)| max_elements(triangles)), cases.map(|c| c.1));
        assert_eq!(max_elements(2_000_000), 8_000_000);
    }

    #[test]
    fn rays_invert_their_law() {
        let factor = ray_factor(0.04, 0.01);
        assert!((0.04 * factor.powf(-RQMC_EXPONENT) - 0.01).abs() < 1e-15);
    }
}
