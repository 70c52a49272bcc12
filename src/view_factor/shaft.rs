//! Who can stand between two polygons.

use std::ops::ControlFlow;

use glam::DVec3;

use super::convex_polygons::ConvexPolygon;
use crate::geometry::aabb::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::plane::Plane;
use crate::geometry::polygon::{clip, merge_close_corners, polygon_area, polygon_difference};

/// Heights over a plane below this, in units of the scene's size, are contact: well above rounding,
/// and above what pieces may be off their own planes ([`super::convex_polygons::PLANAR`]).
pub(super) const CONTACT: f64 = 1e-12;

/// An edge shorter than this share of the shaft has a direction too uncertain to lean on: rounding of
/// its ends, 1e-16, moves the plane by up to [`CONTACT`] at the far end.
const SHORT: f64 = 1e-4;

/// What is left of a piece within a shaft is only contact if its area is less than its length times
/// this: its edges may be out of order.
const SLIVER: f64 = 4.0 * CONTACT;

/// Corners closer than this share of a polygon's extent are one: the line through both is too
/// uncertain to cut by.
pub(super) const ONE: f64 = 1e-9;

/// Pieces in one leaf of the tree, at most. Chosen by hand; no measurement was kept.
const LEAF_SIZE: usize = 4;

/// The convex hull of two polygons that are all before one another: every segment between them.
pub(super) struct Shaft {
    planes: Vec<Plane>,
    bounds: Aabb,
}

impl Shaft {
    /// Of the hull's faces, the two polygons themselves and the one beside each of their edges,
    /// which leans on a corner of the other polygon. These are all.
    pub fn new(a: &[DVec3], a_normal: DVec3, b: &[DVec3], b_normal: DVec3) -> Shaft {
        let bounds = Aabb::from_points(a.iter().chain(b).copied());
        let mut planes = Vec::with_capacity(a.len() + b.len() + 2);
        planes.extend(a.first().map(|&p| Plane::through(p, a_normal)));
        planes.extend(b.first().map(|&p| Plane::through(p, b_normal)));
        lean(a, a_normal, b, &mut planes);
        lean(b, b_normal, a, &mut planes);
        Shaft { planes, bounds }
    }

    /// What of `polygon` is strictly within the shaft; nothing if that has no area.
    pub fn clip(&self, polygon: &[DVec3]) -> Option<Vec<DVec3>> {
        for plane in &self.planes {
            if polygon.iter().all(|&p| plane.signed_distance(p) <= CONTACT) {
                return None;
            }
        }
        let mut kept = polygon.to_vec();
        for plane in &self.planes {
            if kept.iter().any(|&p| plane.signed_distance(p) < -CONTACT) {
                kept = clip(&kept, plane.nearest_to_origin(), plane.normal);
            }
            if kept.len() < 3 || kept.iter().all(|&p| plane.signed_distance(p) <= CONTACT) {
                return None;
            }
        }
        merge_close_corners(&mut kept, ONE);
        let size = kept.iter().map(|p| p.distance(kept[0])).fold(0.0, f64::max);
        (polygon_area(&kept) > SLIVER * size).then_some(kept)
    }

    fn meets(&self, bounds: &Aabb) -> bool {
        self.bounds.overlaps(bounds)
            && self.planes.iter().all(|plane| plane.max_signed_distance(bounds) > CONTACT)
    }
}

/// The planes along the edges of `a`, `b` before it, that have both on their upper side. None along
/// an edge that has a corner of `b` beside it in the plane of `a`: there that plane is the hull's.
fn lean(a: &[DVec3], normal: DVec3, b: &[DVec3], planes: &mut Vec<Plane>) {
    let Some(&origin) = a.first() else { return };
    let size = a.iter().chain(b).map(|p| p.distance(origin)).fold(0.0, f64::max);
    let (flat, raised): (Vec<DVec3>, Vec<DVec3>) =
        b.iter().partition(|p| normal.dot(**p - origin) <= CONTACT);
    for (k, &start) in a.iter().enumerate() {
        let edge = a[(k + 1) % a.len()] - start;
        if edge.length() < SHORT * size {
            continue;
        }
        let along = edge.normalize_or_zero();
        let outwards = along.cross(normal);
        if flat.iter().any(|p| outwards.dot(p - start) > CONTACT) {
            continue;
        }
        // Upright to the edge first: its length times an error of angle is far above contact.
        let upright = |p: DVec3| {
            let n = (p - start).cross(along).normalize_or_zero();
            n.reject_from_normalized(along).normalize_or_zero()
        };
        let mut n = DVec3::ZERO;
        for &p in &raised {
            if n == DVec3::ZERO || n.dot(p - start) < 0.0 {
                n = upright(p);
            }
        }
        if n != DVec3::ZERO {
            planes.push(Plane::through(start, n));
        }
    }
}

/// A convex polygon that stands in the way, and its unit normal.
#[derive(Clone, Debug)]
pub(super) struct Blocker {
    pub corners: Vec<DVec3>,
    pub normal: DVec3,
}

/// Whether every segment between `a` and `b` crosses `blocker`: those between corners tell.
pub(super) fn covers(blocker: &Blocker, a: &[DVec3], b: &[DVec3]) -> bool {
    let Blocker { corners: blocker, normal } = blocker;
    let Some(&p) = blocker.first() else { return false };
    let reach = a.iter().chain(b).map(|v| v.distance(p)).fold(0.0, f64::max);
    let contact = CONTACT * reach;
    let above = |v: &DVec3| normal.dot(*v - p) >= -contact;
    let below = |v: &DVec3| normal.dot(*v - p) <= contact;
    let (front, rear) = if a.iter().all(above) && b.iter().all(below) {
        (a, b)
    } else if a.iter().all(below) && b.iter().all(above) {
        (b, a)
    } else {
        return false;
    };
    front.iter().all(|&eye| {
        (0..blocker.len()).all(|k| {
            let (u, v) = (blocker[k] - eye, blocker[(k + 1) % blocker.len()] - eye);
            // Seen from its front the blocker runs counter-clockwise: inwards is v × u.
            let across = v.cross(u);
            let least = -CONTACT * across.length() * reach;
            rear.iter().all(|&w| across.dot(w - eye) >= least)
        })
    })
}

/// Whether two pieces face the same way in the same plane.
fn lies_on(piece: &ConvexPolygon, other: &ConvexPolygon) -> bool {
    let Some(&origin) = other.corners.first() else { return false };
    let size = piece.corners.iter().map(|p| p.distance(origin)).fold(0.0, f64::max);
    let flat = |p: &DVec3| other.normal.dot(*p - origin).abs() <= 1e-9 * size;
    piece.normal.dot(other.normal) > 0.0 && piece.corners.iter().all(flat)
}

/// Pieces in a tree of boxes.
pub(super) struct Tree {
    pieces: Vec<ConvexPolygon>,
    bvh: Bvh,
}

impl Tree {
    /// Halves pieces at the median along the longest side of their box.
    pub fn new(pieces: Vec<ConvexPolygon>) -> Tree {
        let boxes: Vec<Aabb> = pieces.iter().map(ConvexPolygon::bounds).collect();
        let bvh = Bvh::new(&boxes, LEAF_SIZE, |part, bounds| {
            let axis = bounds.longest_axis();
            let twice_centre = |&k: &u32| (boxes[k as usize].low + boxes[k as usize].high)[axis];
            part.sort_by(|a, b| twice_centre(a).total_cmp(&twice_centre(b)));
        });
        Tree { pieces, bvh }
    }

    /// The backs of all pieces, less what is hidden right there by a piece of `fronts` that lies on
    /// it: such a plate has two fronts.
    pub fn backs(&self, fronts: &Tree) -> Vec<ConvexPolygon> {
        let mut backs = Vec::new();
        for piece in self.bvh.order().iter().map(|&k| &self.pieces[k as usize]) {
            let back = piece.reversed();
            let mut parts = vec![back.corners.clone()];
            for front in fronts.nearby(&piece.bounds()) {
                if lies_on(front, &back) {
                    parts = parts
                        .iter()
                        .flat_map(|part| polygon_difference(part, &front.corners, front.normal))
                        .collect();
                }
            }
            backs
                .extend(parts.into_iter().filter_map(|part| ConvexPolygon::new(part, piece.group)));
        }
        backs
    }

    /// The pieces in leaves of the tree that meet `bounds`: all that overlap, and perhaps others.
    fn nearby(&self, bounds: &Aabb) -> Vec<&ConvexPolygon> {
        let mut found = Vec::new();
        self.bvh.visit(
            |node| node.overlaps(bounds),
            |k| {
                found.push(&self.pieces[k as usize]);
                ControlFlow::Continue(())
            },
        );
        found
    }

    /// What of the pieces is strictly within `shaft`.
    pub fn within(&self, shaft: &Shaft) -> Vec<Blocker> {
        let mut found = Vec::new();
        self.bvh.visit(
            |node| shaft.meets(node),
            |k| {
                let piece = &self.pieces[k as usize];
                let clipped = shaft.clip(&piece.corners);
                found.extend(clipped.map(|corners| Blocker { corners, normal: piece.normal }));
                ControlFlow::Continue(())
            },
        );
        found
    }
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
    fn every_segment_is_in_the_shaft_and_clipping_keeps_what_it_meets() {
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
    fn what_covers_is_crossed_by_every_segment() {
        let mut state = 88_172_645_463_325_252;
        let mut covered = 0;
        for _ in 0..2000 {
            let (mut a, _) = triangle(-1.0, 0.3, true, &mut state);
            let (mut b, _) = triangle(1.0, 0.3, false, &mut state);
            for p in a.iter_mut().chain(&mut b) {
                *p *= DVec3::new(0.3, 0.3, 1.0);
            }
            let (corners, normal) = triangle(0.0, 0.5, true, &mut state);
            let blocker = Blocker { corners: corners.to_vec(), normal };
            if !covers(&blocker, &a, &b) {
                continue;
            }
            covered += 1;
            for _ in 0..50 {
                let (p, q) = (within(&a, &mut state), within(&b, &mut state));
                let hit = p + (q - p) * (normal.dot(corners[0] - p) / normal.dot(q - p));
                for k in 0..3 {
                    let edge = corners[(k + 1) % 3] - corners[k];
                    assert!(normal.cross(edge).dot(hit - corners[k]) > -1e-11);
                }
            }
        }
        assert!(covered > 50, "{covered}");
    }
}
