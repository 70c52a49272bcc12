//! Evidence for the up axis from geometry.
//!
//! | evidence | for |
//! |---|---|
//! | nearly all area is level or upright about the axis | buildings that are turned about it |
//! | the lowest slice is wider than the highest one | standing objects: houses, furniture, cities |
//! | more area faces up than down | ground and roofs without undersides |
//! | lamps shine down | rooms without other evidence |
//!
//! The first alone would take the ridge of a roof for the vertical; the second says nothing about
//! rooms.

use glam::DVec3;

use super::Evidence;
use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

/// Log-odds for each unit of difference, and the maximum: on scenes whose axis is known, 33 of 34
/// differences above 0.1 were for the right one (`docs/data/up_axis.tsv`), and ln 33 is 3.5; 3,
/// since some of them are scenes of one maker.
const SLOPE: f64 = 12.0;
const MAXIMUM: f64 = 3.0;

/// Of level and upright area, footing, and which way surfaces and lamps face.
pub(super) fn evidence(scene: &Scene) -> Evidence {
    let [y, z] = [DVec3::Y, DVec3::Z].map(|axis| of_axis(scene, axis));
    let differences: [f64; 4] = std::array::from_fn(|k| z[k] - y[k]);
    let sum: f64 = differences.iter().sum();
    let reasons = [
        "level and upright area",
        "its being wider below than above",
        "area that faces up",
        "lamps that face down",
    ];
    let strongest = (0..4).max_by(|&a, &b| {
        let support = |k: usize| differences[k] * sum.signum();
        support(a).total_cmp(&support(b))
    });
    Evidence {
        log_odds: (SLOPE * sum).clamp(-MAXIMUM, MAXIMUM),
        reason: reasons[strongest.unwrap_or(0)].into(),
    }
}

/// Evidence for `axis` of each kind, at most 1, 0.5, 0.3 and 0.08.
fn of_axis(scene: &Scene, axis: DVec3) -> [f64; 4] {
    let (mut area, mut aligned, mut upward) = (0.0, 0.0, 0.0);
    let (mut emitted, mut downward) = (0.0, 0.0);
    // Level and upright within 5 degrees. Plain choice.
    let sine = 0.087;
    for t in 0..scene.triangles().len() {
        let (size, cosine) = (scene.area(t), scene.normal(t).dot(axis));
        let exitance = scene.material(t).exitance.element_sum();
        emitted += size * exitance;
        downward -= size * exitance * cosine;
        if !scene.material(t).scatters() {
            continue;
        }
        area += size;
        let level = cosine.abs() > 1.0 - sine * sine / 2.0;
        if level || cosine.abs() < sine {
            aligned += size;
        }
        if level {
            upward += size * cosine;
        }
    }
    let share = |part: f64, whole: f64| if whole > 0.0 { (part / whole).max(0.0) } else { 0.0 };
    // Weights chosen on scenes of both kinds. The footing distinguishes a house from one on its
    // gable, where 0.3 of the area, its roof, is out of line; a room that lacks a wall, 0.2 of its
    // area, keeps its axis; a lamp decides otherwise equal cases.
    [
        share(aligned, area),
        0.5 * footing(scene, axis),
        0.3 * share(upward, area),
        0.08 * share(downward, emitted),
    ]
}

/// Size of the lowest slice less that of the highest one, as a fraction of the whole: size across
/// `axis` of the box around the reflecting triangles in the slice.
fn footing(scene: &Scene, axis: DVec3) -> f64 {
    let bounds = scene.reflecting_bounds();
    let (low, height) = (bounds.low.dot(axis), bounds.size().dot(axis));
    // As a fraction of the height. Plain choice.
    let slice = 0.03;
    let (mut lowest, mut highest) = (Aabb::EMPTY, Aabb::EMPTY);
    let reflecting = (0..scene.triangles().len()).filter(|&t| scene.material(t).scatters());
    for corner in reflecting.flat_map(|t| scene.corners(t)) {
        let level = corner.dot(axis) - low;
        if level <= slice * height {
            lowest.include(corner);
        }
        if level >= (1.0 - slice) * height {
            highest.include(corner);
        }
    }
    let share = |slice: Aabb| {
        let size = (slice.size() / bounds.size()).map(|x| if x.is_finite() { x } else { 1.0 });
        if slice == Aabb::EMPTY {
            0.0
        } else {
            DVec3::select(axis.cmpeq(DVec3::ONE), DVec3::ONE, size).element_product()
        }
    };
    share(lowest) - share(highest)
}
