//! Where on a polygon what it sees past others changes its manner.

use glam::DVec3;

use super::shaft::Blocker;
use crate::form_factor::closed_form::clip;

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

/// The plane of all points with n·p = offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct EventPlane {
    normal: DVec3,
    offset: f64,
}

/// Planes through two parallel edges, one of a blocker, one of the target or of another blocker,
/// that pass through `domain`. Where a point of the domain crosses one, a whole edge of a shadow
/// crosses a whole edge at once, and the gradient of what it sees jumps; at all other events only
/// its second derivatives do.
pub(super) fn creases(target: &[DVec3], blockers: &[Blocker], domain: &[DVec3]) -> Vec<EventPlane> {
    let edges = |polygon: &[DVec3]| -> Vec<(DVec3, DVec3)> {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(&a, &b)| (a, (b - a).normalize_or_zero())).collect()
    };
    let mut known: Vec<(DVec3, DVec3)> = edges(target);
    let mut creases: Vec<EventPlane> = Vec::new();
    for blocker in blockers.iter().take(MOST_CUTS) {
        let own = edges(&blocker.corners);
        for &(a, along) in &own {
            for &(b, other) in &known {
                let parallel = along.cross(other).length_squared() < SAME.0;
                let normal = (b - a).cross(along).try_normalize();
                let (true, Some(normal)) = (parallel, normal) else { continue };
                let crease = EventPlane { normal, offset: normal.dot(a) };
                let (low, high) = crease.heights(domain);
                let through = low < -SAME.1 && high > SAME.1;
                if through && creases.len() < MOST_CREASES && !creases.iter().any(|c| c.is(&crease))
                {
                    creases.push(crease);
                }
            }
        }
        known.extend(own);
    }
    creases
}

impl EventPlane {
    /// Whether both are one plane.
    fn is(&self, other: &EventPlane) -> bool {
        let sign = self.normal.dot(other.normal).signum();
        (self.normal * sign - other.normal).length_squared() <= SAME.0
            && (self.offset * sign - other.offset).abs() <= SAME.1
    }

    /// Lowest and highest height of a polygon's corners over the plane.
    fn heights(&self, polygon: &[DVec3]) -> (f64, f64) {
        let heights = polygon.iter().map(|p| self.normal.dot(*p) - self.offset);
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)))
    }

    /// Both sides of a triangle, in triangles.
    pub fn cut(&self, corners: &[DVec3; 3]) -> Vec<[DVec3; 3]> {
        let origin = self.normal * self.offset;
        let sides = [1.0, -1.0].map(|side| clip(corners, origin, side * self.normal));
        sides.iter().flat_map(|side| fan(side)).collect()
    }
}

/// The crease that divides a triangle most evenly, and how evenly: at most 1/2.
pub(super) fn most_even<'a>(
    creases: &'a [EventPlane],
    corners: &[DVec3; 3],
) -> Option<(f64, &'a EventPlane)> {
    let evenness = |crease: &'a EventPlane| {
        let (low, high) = crease.heights(corners);
        ((-low).min(high) / (high - low), crease)
    };
    let sorted = creases.iter().map(evenness).filter(|(even, _)| *even > EVEN);
    sorted.max_by(|a, b| a.0.total_cmp(&b.0))
}

/// A convex polygon in triangles.
pub(super) fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> {
    let rest = polygon.get(1..).unwrap_or(&[]);
    rest.windows(2).map(|pair| [polygon[0], pair[0], pair[1]])
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
