//! Shafts: the space between two polygons that blockers can be in.
//!
//! ```text
//!        b                The shaft of a and b is the convex hull of both: all segments from one
//!     ───────             to the other. Its faces are the two polygons and, along each of their
//!    ╱       ╲            edges, a supporting plane that leans on a corner of the other.
//!   ╱  ▬▬     ╲
//!  ╱           ╲          Of a blocker only the part strictly within matters: clipped by all
//!  ─────────────          planes, and dropped if nothing but contact is left.
//!        a
//! ```
//!
//! (E. A. Haines, J. R. Wallace, "Shaft Culling for Efficient Ray-Cast Radiosity", 1991, for shafts
//! between boxes; between convex polygons the hull itself has few enough faces.)

use glam::DVec3;

use super::tolerances::CONTACT_HEIGHT;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::aabb::Aabb;
use crate::geometry::plane::Plane;
use crate::geometry::polygon::{clip, max_distance, merge_close_corners, polygon_area};

/// The convex hull of two convex polygons that face one another entirely.
pub(super) struct Shaft {
    /// Planes with the hull on the positive side.
    planes: Vec<Plane>,
    bounds: Aabb,
}

impl Shaft {
    /// The shaft between `a` and `b`, unit normals given.
    pub fn new(a: &[DVec3], a_normal: DVec3, b: &[DVec3], b_normal: DVec3) -> Shaft {
        let bounds = Aabb::from_points(a.iter().chain(b).copied());
        let mut planes = Vec::with_capacity(a.len() + b.len() + 2);
        planes.extend(a.first().map(|&p| Plane::through(p, a_normal)));
        planes.extend(b.first().map(|&p| Plane::through(p, b_normal)));
        add_supporting_planes(a, a_normal, b, &mut planes);
        add_supporting_planes(b, b_normal, a, &mut planes);
        Shaft { planes, bounds }
    }

    /// The part of `polygon` strictly within the shaft; `None` if that has no area.
    pub fn clip(&self, polygon: &[DVec3]) -> Option<Vec<DVec3>> {
        for plane in &self.planes {
            if polygon.iter().all(|&p| plane.signed_distance(p) <= CONTACT_HEIGHT) {
                return None;
            }
        }
        let mut kept = polygon.to_vec();
        for plane in &self.planes {
            if kept.iter().any(|&p| plane.signed_distance(p) < -CONTACT_HEIGHT) {
                kept = clip(&kept, plane.nearest_to_origin(), plane.normal);
            }
            if kept.len() < 3 || kept.iter().all(|&p| plane.signed_distance(p) <= CONTACT_HEIGHT) {
                return None;
            }
        }
        merge_close_corners(&mut kept, COINCIDENCE_TOLERANCE);
        let extent = max_distance(&kept, kept[0]);
        (polygon_area(&kept) > 4.0 * CONTACT_HEIGHT * extent).then_some(kept)
    }

    /// Whether a part of a box may be strictly within the shaft; conservative.
    pub fn intersects(&self, bounds: &Aabb) -> bool {
        let is_reached = |plane: &Plane| plane.max_signed_distance(bounds) > CONTACT_HEIGHT;
        self.bounds.overlaps(bounds) && self.planes.iter().all(is_reached)
    }
}

/// Adds the planes along the edges of `a`, with `b` in front of it, that have both on their
/// positive side. An edge with a corner of `b` beside it in the plane of `a` gets none: there the
/// plane of `a` bounds the hull.
fn add_supporting_planes(a: &[DVec3], normal: DVec3, b: &[DVec3], planes: &mut Vec<Plane>) {
    let Some(&origin) = a.first() else { return };
    let size = a.iter().chain(b).map(|p| p.distance(origin)).fold(0.0, f64::max);
    let (flat, raised): (Vec<DVec3>, Vec<DVec3>) =
        b.iter().partition(|p| normal.dot(**p - origin) <= CONTACT_HEIGHT);
    for (k, &start) in a.iter().enumerate() {
        let edge = a[(k + 1) % a.len()] - start;
        if edge.length() < 1e-4 * size {
            continue;
        }
        let along = edge.normalize_or_zero();
        let outwards = along.cross(normal);
        if flat.iter().any(|p| outwards.dot(p - start) > CONTACT_HEIGHT) {
            continue;
        }
        if let Some(normal) = supporting_normal(start, along, &raised) {
            planes.push(Plane::through(start, normal));
        }
    }
}

/// Normal of the plane through the line from `start` along the unit vector `along` and one of
/// `points` that has all of them on its positive side or on it; `None` if all are on the line.
fn supporting_normal(start: DVec3, along: DVec3, points: &[DVec3]) -> Option<DVec3> {
    // Perpendicular to the line first: an angular error over the line's length would be far above
    // contact.
    let perpendicular = |p: DVec3| {
        let n = (p - start).cross(along).normalize_or_zero();
        n.reject_from_normalized(along).normalize_or_zero()
    };
    let mut normal = DVec3::ZERO;
    for &p in points {
        if normal == DVec3::ZERO || normal.dot(p - start) < 0.0 {
            normal = perpendicular(p);
        }
    }
    (normal != DVec3::ZERO).then_some(normal)
}

/// A convex polygon that may block light, and its unit normal.
#[derive(Clone, Debug)]
pub(super) struct Blocker {
    pub corners: Vec<DVec3>,
    pub normal: DVec3,
}

/// Whether every segment between `a` and `b` crosses `blocker`: true if those between corners do.
pub(super) fn fully_occludes(blocker: &Blocker, a: &[DVec3], b: &[DVec3]) -> bool {
    let Blocker { corners: blocker, normal } = blocker;
    let Some(&origin) = blocker.first() else { return false };
    let reach = a.iter().chain(b).map(|v| v.distance(origin)).fold(0.0, f64::max);
    let contact = CONTACT_HEIGHT * reach;
    let is_above = |v: &DVec3| normal.dot(*v - origin) >= -contact;
    let is_below = |v: &DVec3| normal.dot(*v - origin) <= contact;
    let (front, rear) = if a.iter().all(is_above) && b.iter().all(is_below) {
        (a, b)
    } else if a.iter().all(is_below) && b.iter().all(is_above) {
        (b, a)
    } else {
        return false;
    };
    front.iter().all(|&eye| {
        (0..blocker.len()).all(|k| {
            let (u, v) = (blocker[k] - eye, blocker[(k + 1) % blocker.len()] - eye);
            // Seen from its front the blocker runs counter-clockwise: inwards is v × u.
            let inwards = v.cross(u);
            let least = -CONTACT_HEIGHT * inwards.length() * reach;
            rear.iter().all(|&w| inwards.dot(w - eye) >= least)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// G. Marsaglia's xorshift64, in (-1, 1).
    fn random(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn triangle(height: f64, spread: f64, up: bool, state: &mut u64) -> ([DVec3; 3], DVec3) {
        let tilt = spread * random(state);
        let mut corner = || DVec3::new(random(state), random(state), 0.0);
        let mut corners =
            [corner(), corner(), corner()].map(|p| p + (height + tilt * p.x) * DVec3::Z);
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        if (normal.z > 0.0) != up {
            corners.swap(1, 2);
        }
        (corners, (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize())
    }

    /// A point of a triangle, its corners included.
    fn within(t: &[DVec3; 3], state: &mut u64) -> DVec3 {
        let (u, v) = (random(state).abs(), random(state).abs());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0])
    }

    #[test]
    fn shaft_contains_every_segment_and_clip_keeps_what_segments_meet() {
        let mut state = 88_172_645_463_325_252;
        let mut met = 0;
        for _ in 0..300 {
            // Tilts of 0.3 over 2 across never reach the other's plane, 2 above.
            let (a, up) = triangle(-1.0, 0.3, true, &mut state);
            let (b, down) = triangle(1.0, 0.3, false, &mut state);
            let (c, n) = triangle(0.0, 0.9, true, &mut state);
            let shaft = Shaft::new(&a, up, &b, down);
            let kept = shaft.clip(&c);
            for _ in 0..50 {
                let (p, q) = (within(&a, &mut state), within(&b, &mut state));
                let middle = p.lerp(q, random(&mut state).abs());
                // Rounding of a few operations on lengths below 4.
                assert!(shaft.planes.iter().all(|plane| plane.signed_distance(middle) > -1e-14));
                let hit = p + (q - p) * (n.dot(c[0] - p) / n.dot(q - p));
                let inside = |t: &[DVec3], least: f64| {
                    let side = |k: usize| n.cross(t[(k + 1) % t.len()] - t[k]).dot(hit - t[k]);
                    (0..t.len()).all(|k| side(k) >= least)
                };
                if inside(&c, 1e-9) {
                    met += 1;
                    assert!(kept.as_ref().is_some_and(|kept| inside(kept, -1e-11)));
                }
            }
        }
        assert!(met > 500, "{met}");
    }

    #[test]
    fn full_occluder_is_crossed_by_every_segment() {
        let mut state = 88_172_645_463_325_252;
        let mut occluding = 0;
        for _ in 0..2000 {
            let (mut a, _) = triangle(-1.0, 0.3, true, &mut state);
            let (mut b, _) = triangle(1.0, 0.3, false, &mut state);
            for p in a.iter_mut().chain(&mut b) {
                *p *= DVec3::new(0.3, 0.3, 1.0);
            }
            let (corners, normal) = triangle(0.0, 0.5, true, &mut state);
            let blocker = Blocker { corners: corners.to_vec(), normal };
            if !fully_occludes(&blocker, &a, &b) {
                continue;
            }
            occluding += 1;
            for _ in 0..50 {
                let (p, q) = (within(&a, &mut state), within(&b, &mut state));
                let hit = p + (q - p) * (normal.dot(corners[0] - p) / normal.dot(q - p));
                for k in 0..3 {
                    let edge = corners[(k + 1) % 3] - corners[k];
                    assert!(normal.cross(edge).dot(hit - corners[k]) > -1e-11);
                }
            }
        }
        assert!(occluding > 50, "{occluding}");
    }
}
