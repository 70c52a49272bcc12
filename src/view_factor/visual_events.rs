//! Where on a polygon what it sees past others changes its manner.

use glam::DVec3;

use super::shaft::Blocker;
use crate::geometry::plane::Plane;
use crate::geometry::polygon::{clip, fan};

/// A blocker whose foot is lower than this share of its top stands on the plane below.
const FOOT: f64 = 1e-2;

/// Most planes that a polygon is cut by before it is cut into cells, and blockers asked for them.
const MOST_CUTS: usize = 12;

/// Most creases kept of a pair.
const MOST_CREASES: usize = 64;

/// A crease that leaves less than this share of a cell's height on one side is left alone.
const EVEN: f64 = 1e-3;

/// Squared sine of directions that are the same, and distance of places, in units of the scene.
const SAME: (f64, f64) = (1e-18, 1e-9);

/// Planes through two parallel edges, one of a blocker, one of the target or of another blocker,
/// that pass through `domain`. Where a point of the domain crosses one, a whole edge of a shadow
/// crosses a whole edge at once, and the gradient of what it sees jumps; at all other events only
/// its second derivatives do.
pub(super) fn creases(target: &[DVec3], blockers: &[Blocker], domain: &[DVec3]) -> Vec<Plane> {
    let edges = |polygon: &[DVec3]| -> Vec<(DVec3, DVec3)> {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(&a, &b)| (a, (b - a).normalize_or_zero())).collect()
    };
    let mut known: Vec<(DVec3, DVec3)> = edges(target);
    let mut creases: Vec<Plane> = Vec::new();
    for blocker in blockers.iter().take(MOST_CUTS) {
        let own = edges(&blocker.corners);
        for &(a, along) in &own {
            for &(b, other) in &known {
                let parallel = along.cross(other).length_squared() < SAME.0;
                let normal = (b - a).cross(along).try_normalize();
                let (true, Some(normal)) = (parallel, normal) else { continue };
                let crease = Plane::through(a, normal);
                let (low, high) = crease.signed_distance_range(domain);
                let through = low < -SAME.1 && high > SAME.1;
                if through
                    && creases.len() < MOST_CREASES
                    && !creases.iter().any(|c| is_same_plane(c, &crease))
                {
                    creases.push(crease);
                }
            }
        }
        known.extend(own);
    }
    creases
}

/// Whether both are one plane, whichever way its normal points.
fn is_same_plane(a: &Plane, b: &Plane) -> bool {
    let sign = a.normal.dot(b.normal).signum();
    (a.normal * sign - b.normal).length_squared() <= SAME.0
        && (a.offset * sign - b.offset).abs() <= SAME.1
}

/// Both sides of a triangle cut by a plane, in triangles.
pub(super) fn split_triangle(corners: &[DVec3; 3], plane: &Plane) -> Vec<[DVec3; 3]> {
    let origin = plane.nearest_to_origin();
    let sides = [1.0, -1.0].map(|sign| clip(corners, origin, sign * plane.normal));
    sides.iter().flat_map(|side| fan(side)).collect()
}

/// The crease that divides a triangle most evenly, and how evenly: at most 1/2.
pub(super) fn most_even<'a>(
    creases: &'a [Plane],
    corners: &[DVec3; 3],
) -> Option<(f64, &'a Plane)> {
    let evenness = |crease: &'a Plane| {
        let (low, high) = crease.signed_distance_range(corners);
        ((-low).min(high) / (high - low), crease)
    };
    let sorted = creases.iter().map(evenness).filter(|(even, _)| *even > EVEN);
    sorted.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The blockers that stand on the plane of a polygon, or nearly so: at their foot, what is seen
/// from the polygon changes at once.
pub(super) fn standing_on(polygon: &[DVec3], normal: DVec3, blockers: &[Blocker]) -> Vec<Blocker> {
    let stands = |blocker: &&Blocker| {
        let Some(&origin) = polygon.first() else { return false };
        let heights = blocker.corners.iter().map(|p| normal.dot(p - origin));
        let top = heights.clone().fold(0.0, f64::max);
        heights.filter(|h| *h <= FOOT * top).count() > 1
    };
    blockers.iter().filter(stands).take(MOST_CUTS).cloned().collect()
}

/// Parts of a polygon between the planes of blockers.
pub(super) fn parts_between(polygon: Vec<DVec3>, blockers: &[Blocker]) -> Vec<Vec<DVec3>> {
    let mut parts = vec![polygon];
    for blocker in blockers {
        let Some(&origin) = blocker.corners.first() else { continue };
        parts = parts
            .iter()
            .flat_map(|part| [1.0, -1.0].map(|side| clip(part, origin, side * blocker.normal)))
            .filter(|part| part.len() > 2)
            .collect();
    }
    parts
}
