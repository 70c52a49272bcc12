//! What a point sees of a polygon past others: exact, by clipping.

use glam::DVec3;

use super::shaft::Blocker;
use crate::form_factor::analytic::lambert;

/// Corners off a plane through the eye by less than this share of the reach are in it.
const CONTACT: f64 = 1e-13;

/// Convex polygons, their corners in one row.
#[derive(Default)]
struct Polygons {
    corners: Vec<DVec3>,
    ends: Vec<usize>,
}

impl Polygons {
    fn clear(&mut self) {
        self.corners.clear();
        self.ends.clear();
    }

    fn push(&mut self, polygon: impl IntoIterator<Item = DVec3>) {
        self.corners.extend(polygon);
        self.ends.push(self.corners.len());
    }

    fn iter(&self) -> impl Iterator<Item = &[DVec3]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.corners[start..end])
    }
}

/// An eye on a surface, and room to work in.
#[derive(Default)]
pub(super) struct Eye {
    seen: Polygons,
    left: Polygons,
    /// Planes through the eye along a blocker's edges, unit normals inwards.
    cone: Vec<DVec3>,
    inside: Vec<DVec3>,
    rest: Vec<DVec3>,
}

/// Form factors from one point to a polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// To its visible part.
    pub visible: f64,
    /// To all of it, as if nothing stood between.
    pub whole: f64,
}

impl Eye {
    /// Form factors from the surface element at `point` with unit `normal` to `target`, past
    /// `blockers`, all of them convex, before the element's plane, and between it and the target's
    /// plane.
    ///
    /// A blocker's shadow is what of the target lies within the cone from the point over the
    /// blocker. Shadows are cut off the convex parts seen so far, one blocker after another; what
    /// is left is summed by Lambert's formula: exact but for rounding.
    pub fn look(
        &mut self,
        point: DVec3,
        normal: DVec3,
        target: &[DVec3],
        blockers: &[Blocker],
    ) -> Seen {
        self.seen.clear();
        self.seen.push(target.iter().map(|corner| corner - point));
        let see = |part: &[DVec3]| lambert(DVec3::ZERO, normal, part);
        let whole = see(&self.seen.corners);
        let reach = self.seen.corners.iter().map(|v| v.length_squared()).fold(0.0, f64::max);
        let contact = CONTACT * reach.sqrt();
        let mut touched = false;
        for blocker in blockers {
            if self.set_cone(point, blocker) {
                touched |= self.cut(contact);
                if self.seen.ends.is_empty() {
                    return Seen { visible: 0.0, whole };
                }
            }
        }
        let visible = if touched { self.seen.iter().map(see).sum() } else { whole };
        Seen { visible, whole }
    }

    /// The cone from `point` over `blocker`; false if that is seen edge on.
    fn set_cone(&mut self, point: DVec3, blocker: &Blocker) -> bool {
        self.cone.clear();
        let Blocker { corners, normal } = blocker;
        let Some(&corner) = corners.first() else { return false };
        let facing = normal.dot(corner - point);
        let sign = if facing > 0.0 { 1.0 } else { -1.0 };
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let (a, b) = (a - point, b - point);
            let across = a.cross(b);
            let length = across.length();
            if length > CONTACT * a.length() * b.length() {
                self.cone.push(across * (sign / length));
            }
        }
        facing != 0.0 && self.cone.len() > 2
    }

    /// Cuts the cone off all parts seen; false if none is touched.
    fn cut(&mut self, contact: f64) -> bool {
        let mut touched = false;
        self.left.clear();
        for part in self.seen.iter() {
            let beyond = |n: &DVec3| part.iter().all(|v| n.dot(*v) <= contact);
            if self.cone.iter().any(beyond) {
                self.left.push(part.iter().copied());
                continue;
            }
            touched = true;
            self.inside.clear();
            self.inside.extend_from_slice(part);
            for &n in &self.cone {
                if self.inside.iter().all(|v| n.dot(*v) >= -contact) {
                    continue;
                }
                self.rest.clear();
                let start = self.left.corners.len();
                split(&self.inside, n, contact, &mut self.rest, &mut self.left.corners);
                if self.left.corners.len() > start + 2 {
                    self.left.ends.push(self.left.corners.len());
                } else {
                    self.left.corners.truncate(start);
                }
                std::mem::swap(&mut self.inside, &mut self.rest);
                if self.inside.len() < 3 {
                    break;
                }
            }
        }
        std::mem::swap(&mut self.seen, &mut self.left);
        touched
    }
}

/// Splits a convex polygon by the plane through the origin with unit normal `n`.
fn split(
    polygon: &[DVec3],
    n: DVec3,
    contact: f64,
    above: &mut Vec<DVec3>,
    below: &mut Vec<DVec3>,
) {
    let height = |v: DVec3| {
        let height = n.dot(v);
        if height.abs() <= contact { 0.0 } else { height }
    };
    let Some(&last) = polygon.last() else { return };
    let (mut a, mut ha) = (last, height(last));
    for &b in polygon {
        let hb = height(b);
        if ha * hb < 0.0 {
            let crossing = a + (b - a) * (ha / (ha - hb));
            above.push(crossing);
            below.push(crossing);
        }
        if hb >= 0.0 {
            above.push(b);
        }
        if hb <= 0.0 {
            below.push(b);
        }
        (a, ha) = (b, hb);
    }
}
