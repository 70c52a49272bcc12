//! Visual events: the curves on a polygon where the visible share of another is not smooth.
//!
//! The visible part of a target past blockers is a smooth function of the point except where a
//! corner of one meets an edge of another, seen from the point. In general only the second
//! derivatives jump there. Two events are sharper, and worth cutting along:
//!
//! ```text
//!   ── target edge       The plane through two parallel edges: a whole edge of a shadow crosses a
//!       ╲                whole edge at once, and the gradient jumps. Cells are cut along such an
//!     ── ╲ blocker edge  event plane.
//!  ───────╳───── domain
//!
//!         │ blocker      A blocker that stands on the domain: visibility jumps at its foot. The
//!  ───────┴───── domain  domain is cut along the blocker's own plane before anything else.
//! ```
//!
//! (D. Lischinski, F. Tampieri, D. P. Greenberg, "Discontinuity Meshing for Accurate Radiosity",
//! IEEE Computer Graphics and Applications 12(6), 1992, for the positions and orders of
//! discontinuities.)

use glam::DVec3;

use super::shaft::Blocker;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::plane::Plane;
use crate::geometry::polygon::{clip, fan};

/// Maximum number of blockers of a pair that yield event planes, and that cut a domain before it is
/// cut into cells: limits time. Plain choice.
const MAX_EVENT_BLOCKERS: usize = 12;

/// The planes through two parallel edges, one of a blocker, one of the target or of another
/// blocker, that pass through `domain`.
pub(super) fn event_planes(target: &[DVec3], blockers: &[Blocker], domain: &[DVec3]) -> Vec<Plane> {
    let mut earlier_edges = directed_edges(target);
    let mut planes: Vec<Plane> = Vec::new();
    for blocker in blockers.iter().take(MAX_EVENT_BLOCKERS) {
        let blocker_edges = directed_edges(&blocker.corners);
        for &edge in &blocker_edges {
            for &earlier in &earlier_edges {
                let Some(plane) = plane_through_parallel(edge, earlier) else { continue };
                let (low, high) = plane.signed_distance_range(domain);
                let crosses = low < -COINCIDENCE_TOLERANCE && high > COINCIDENCE_TOLERANCE;
                let is_new = || !planes.iter().any(|known| is_same_plane(known, &plane));
                if crosses && planes.len() < 64 && is_new() {
                    planes.push(plane);
                }
            }
        }
        earlier_edges.extend(blocker_edges);
    }
    planes
}

/// The start of an edge, and its direction of unit length.
type DirectedEdge = (DVec3, DVec3);

/// The edges of a polygon in order.
fn directed_edges(polygon: &[DVec3]) -> Vec<DirectedEdge> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(&a, &b)| (a, (b - a).normalize_or_zero())).collect()
}

/// The plane through two edges, if they are parallel and not on one line.
fn plane_through_parallel((a, along): DirectedEdge, (b, other): DirectedEdge) -> Option<Plane> {
    if along.cross(other).length_squared() >= COINCIDENCE_TOLERANCE.powi(2) {
        return None;
    }
    let normal = (b - a).cross(along).try_normalize()?;
    Some(Plane::through(a, normal))
}

/// Whether both are the same plane, with either orientation.
fn is_same_plane(a: &Plane, b: &Plane) -> bool {
    let sign = a.normal.dot(b.normal).signum();
    (a.normal * sign - b.normal).length_squared() <= COINCIDENCE_TOLERANCE.powi(2)
        && (a.offset * sign - b.offset).abs() <= COINCIDENCE_TOLERANCE
}

/// Both sides of a triangle cut by a plane, as triangles.
pub(super) fn split_triangle(corners: &[DVec3; 3], plane: &Plane) -> Vec<[DVec3; 3]> {
    let origin = plane.nearest_to_origin();
    let sides = [1.0, -1.0].map(|sign| clip(corners, origin, sign * plane.normal));
    sides.iter().flat_map(|side| fan(side)).collect()
}

/// The event plane that divides a triangle most evenly, and the balance: the share of the
/// triangle's width across the plane on the narrower side, at most 1/2.
pub(super) fn most_balanced_split<'a>(
    event_planes: &'a [Plane],
    corners: &[DVec3; 3],
) -> Option<(f64, &'a Plane)> {
    let balance = |plane: &'a Plane| {
        let (low, high) = plane.signed_distance_range(corners);
        ((-low).min(high) / (high - low), plane)
    };
    let balanced = event_planes.iter().map(balance).filter(|(balance, _)| *balance > 1e-3);
    balanced.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// The blockers that stand on the plane of a polygon with unit normal `normal`, or nearly so.
pub(super) fn standing_on(polygon: &[DVec3], normal: DVec3, blockers: &[Blocker]) -> Vec<Blocker> {
    let Some(&origin) = polygon.first() else { return Vec::new() };
    let stands = |blocker: &&Blocker| {
        let heights = blocker.corners.iter().map(|p| normal.dot(p - origin));
        let top = heights.clone().fold(0.0, f64::max);
        heights.filter(|height| *height <= 1e-2 * top).count() > 1
    };
    blockers.iter().filter(stands).take(MAX_EVENT_BLOCKERS).cloned().collect()
}

/// Parts of a polygon between the planes of blockers.
pub(super) fn parts_between_planes(polygon: Vec<DVec3>, blockers: &[Blocker]) -> Vec<Vec<DVec3>> {
    let mut parts = vec![polygon];
    for blocker in blockers {
        let Some(&origin) = blocker.corners.first() else { continue };
        parts = parts
            .iter()
            .flat_map(|part| [1.0, -1.0].map(|sign| clip(part, origin, sign * blocker.normal)))
            .filter(|part| part.len() > 2)
            .collect();
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: [f64; 2], y: [f64; 2], z: f64) -> Vec<DVec3> {
        [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| DVec3::new(x[i], y[j], z)).to_vec()
    }

    #[test]
    fn event_planes_pass_through_parallel_edges_and_the_domain() {
        // Edges at x = 0.5 ± 0.1 halfway up, under edges at x = 0 and 1: planes meet the floor at
        // 1 ± 0.2 and 0 ± 0.2, of which two are within (0, 1); and the same in y.
        let target = rectangle([0.0, 1.0], [0.0, 1.0], 1.0);
        let domain = rectangle([0.0, 1.0], [0.0, 1.0], 0.0);
        let corners = rectangle([0.4, 0.6], [0.4, 0.6], 0.5);
        let blocker = Blocker { corners, normal: DVec3::Z };
        let planes = event_planes(&target, &[blocker], &domain);
        let mut places: Vec<f64> = planes
            .iter()
            .filter(|plane| plane.normal.y == 0.0)
            .map(|plane| plane.offset / plane.normal.x)
            .collect();
        places.sort_by(f64::total_cmp);
        assert_eq!((planes.len(), places.len()), (4, 2));
        assert!((places[0] - 0.2).abs() < 1e-15 && (places[1] - 0.8).abs() < 1e-15, "{places:?}");
    }

    #[test]
    fn most_balanced_split_prefers_the_middle() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let at = |x: f64| Plane::through(DVec3::new(x, 0.0, 0.0), DVec3::X);
        let planes = [at(0.1), at(0.45), at(0.8), at(1e-4), at(2.0)];
        let (balance, plane) = most_balanced_split(&planes, &corners).unwrap();
        assert!((balance - 0.45).abs() < 1e-15 && plane.offset == 0.45);
        assert!(most_balanced_split(&planes[3..], &corners).is_none());
        let parts = split_triangle(&corners, plane);
        let area = |t: &[DVec3; 3]| 0.5 * (t[1] - t[0]).cross(t[2] - t[0]).length();
        assert!((parts.iter().map(area).sum::<f64>() - 0.5).abs() < 1e-15);
    }
}
