//! Form factor from a point to the visible part of a polygon: exact, by subtracting shadows.
//!
//! ```text
//!      ┌──────┬╌╌╌╌┬───┐   target: convex regions that are visible so far
//!      │      ╎////╎   │
//!      └──────┴╌╌╌╌┴───┘
//!              ╲▬▬╱        blocker; the cone from the point over its edges cuts out its shadow
//!               •          point
//! ```
//!
//! A region that a shadow overlaps is split by the planes of the cone, one after another: the part
//! outside a plane stays visible, the part inside all of them is dropped. Lambert's formula over
//! the remaining regions is exact up to rounding.

use std::ops::Range;

use glam::DVec3;

use super::shaft::Blocker;
use crate::form_factor::closed_form::lambert;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::aabb::Aabb;
use crate::geometry::polygon::{PLANE_TOLERANCE, split_through_origin};

/// A convex region of the target that is visible so far.
struct Region {
    /// Range of [`PointVisibility::corners`].
    corners: Range<usize>,
    /// Box around the corners.
    bounds: Aabb,
}

/// Computes the visible part of a polygon from single points; reuses its memory from point to
/// point.
#[derive(Default)]
pub(super) struct PointVisibility {
    /// Corners of regions relative to the point, also of removed regions.
    corners: Vec<DVec3>,
    visible_regions: Vec<Region>,
    /// Planes through the point along a blocker's edges: unit normals inwards.
    shadow_cone: Vec<DVec3>,
    /// The part of a region within the planes of the cone applied so far.
    inside: Vec<DVec3>,
    /// The part of `inside` within the next plane.
    still_inside: Vec<DVec3>,
}

/// Form factors from one point to a polygon, in [0, 1].
#[derive(Clone, Copy, Debug)]
pub(super) struct PointFactors {
    /// To its visible part.
    pub visible: f64,
    /// To all of it, without blockers.
    pub unoccluded: f64,
}

impl PointVisibility {
    /// Form factors from the surface element at `point` with unit `normal` to `target`, whose unit
    /// normal is `facing`, behind `blockers`, all of them convex, in front of the element's plane,
    /// and between it and the target's plane.
    pub fn factors(
        &mut self,
        point: DVec3,
        normal: DVec3,
        target: &[DVec3],
        facing: DVec3,
        blockers: &[Blocker],
    ) -> PointFactors {
        self.corners.clear();
        self.visible_regions.clear();
        self.corners.extend(target.iter().map(|corner| corner - point));
        self.keep_region(0);
        let factor_to = |region: &[DVec3]| lambert(DVec3::ZERO, normal, region);
        let unoccluded = factor_to(&self.corners);
        let reach = self.corners.iter().map(|v| v.length_squared()).fold(0.0, f64::max).sqrt();
        let depth = self.corners.first().map_or(0.0, |v| -facing.dot(*v));
        for blocker in blockers {
            let shadow =
                shadow_bounds(point, blocker, facing, depth, COINCIDENCE_TOLERANCE * reach);
            let mut regions = self.visible_regions.iter();
            let reaches_any = regions.any(|region| region.bounds.overlaps(&shadow));
            if reaches_any && self.set_shadow_cone(point, blocker) {
                self.subtract_shadow(&shadow, PLANE_TOLERANCE * reach);
                if self.visible_regions.is_empty() {
                    return PointFactors { visible: 0.0, unoccluded };
                }
            }
        }
        let regions = self.visible_regions.iter();
        let visible = regions.map(|region| factor_to(&self.corners[region.corners.clone()])).sum();
        PointFactors { visible, unoccluded }
    }

    /// Makes a region of all corners from `start`; fewer than three are dropped.
    fn keep_region(&mut self, start: usize) {
        if self.corners.len() < start + 3 {
            self.corners.truncate(start);
            return;
        }
        let bounds = Aabb::from_points(self.corners[start..].iter().copied());
        self.visible_regions.push(Region { corners: start..self.corners.len(), bounds });
    }

    /// The cone from `point` over `blocker`; false if that is seen edge on.
    fn set_shadow_cone(&mut self, point: DVec3, blocker: &Blocker) -> bool {
        self.shadow_cone.clear();
        let Blocker { corners, normal } = blocker;
        let Some(&corner) = corners.first() else { return false };
        let facing = normal.dot(corner - point);
        let sign = if facing > 0.0 { 1.0 } else { -1.0 };
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let (a, b) = (a - point, b - point);
            let across = a.cross(b);
            let length = across.length();
            if length > PLANE_TOLERANCE * a.length() * b.length() {
                self.shadow_cone.push(across * (sign / length));
            }
        }
        facing != 0.0 && self.shadow_cone.len() > 2
    }

    /// Subtracts the cone, whose shadow is within the box `shadow`, from all visible regions.
    /// Corners at most `tolerance` (a length) off a plane of the cone are on it.
    fn subtract_shadow(&mut self, shadow: &Aabb, tolerance: f64) {
        // From the last: a region swapped into a removed one's slot has been processed already.
        for k in (0..self.visible_regions.len()).rev() {
            if !self.visible_regions[k].bounds.overlaps(shadow) {
                continue;
            }
            let region = &self.corners[self.visible_regions[k].corners.clone()];
            let is_outside = |n: &DVec3| region.iter().all(|v| n.dot(*v) <= tolerance);
            if self.shadow_cone.iter().any(is_outside) {
                continue;
            }
            self.inside.clear();
            self.inside.extend_from_slice(region);
            self.visible_regions.swap_remove(k);
            for plane in 0..self.shadow_cone.len() {
                let n = self.shadow_cone[plane];
                if self.inside.iter().all(|v| n.dot(*v) >= -tolerance) {
                    continue;
                }
                self.still_inside.clear();
                let start = self.corners.len();
                let (above, below) = (&mut self.still_inside, &mut self.corners);
                split_through_origin(&self.inside, n, tolerance, above, below);
                self.keep_region(start);
                std::mem::swap(&mut self.inside, &mut self.still_inside);
                if self.inside.len() < 3 {
                    break;
                }
            }
        }
    }
}

/// A box around the part of a plane that `blocker` hides from `point`, expanded by `margin`; the
/// plane is at `depth` in front of the point and faces `facing`. Unbounded where all of the blocker
/// is beside the point or behind it.
fn shadow_bounds(point: DVec3, blocker: &Blocker, facing: DVec3, depth: f64, margin: f64) -> Aabb {
    let least = COINCIDENCE_TOLERANCE * depth;
    let mut bounds = Aabb::EMPTY;
    let Some(&last) = blocker.corners.last() else { return bounds };
    let mut before = last - point;
    let mut height_before = -facing.dot(before);
    let mut is_any_before = false;
    for corner in &blocker.corners {
        let v = corner - point;
        let height = -facing.dot(v);
        if (height > least) != (height_before > least) {
            // Where the edge gets beside the point, its shadow goes to infinity.
            let crossing = before.lerp(v, (least - height_before) / (height - height_before));
            bounds.include(crossing * (depth / least));
        }
        if height > least {
            is_any_before = true;
            bounds.include(v * (depth / height));
        }
        (before, height_before) = (v, height);
    }
    if is_any_before { bounds.expanded(margin) } else { Aabb::EVERYTHING }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: [f64; 2], y: [f64; 2], z: f64) -> Vec<DVec3> {
        [(0, 0), (0, 1), (1, 1), (1, 0)].map(|(i, j)| DVec3::new(x[i], y[j], z)).to_vec()
    }

    #[test]
    fn visible_factor_matches_a_sum_over_rays() {
        // Two overlapping shadows, seen obliquely; the target in 400 × 400 squares.
        let eye = DVec3::new(0.1, -0.2, 0.0);
        let target = rectangle([-1.0, 1.0], [-1.0, 1.0], 2.0);
        let sides = [([-0.3, 0.2], [-0.4, 0.1], 0.7), ([0.0, 0.5], [-0.1, 0.6], 1.1)];
        let blockers =
            sides.map(|(x, y, z)| Blocker { corners: rectangle(x, y, z), normal: DVec3::NEG_Z });
        let n = 400;
        let mut sum = 0.0;
        for k in 0..n * n {
            let at = |k: i32| (f64::from(k) + 0.5) * 2.0 / f64::from(n) - 1.0;
            let ray = DVec3::new(at(k % n), at(k / n), 2.0) - eye;
            let hidden = sides.iter().any(|(x, y, z)| {
                let p = eye + ray * (z / ray.z);
                x[0] < p.x && p.x < x[1] && y[0] < p.y && p.y < y[1]
            });
            if !hidden {
                let area = (2.0 / f64::from(n)).powi(2);
                sum += area * ray.z * ray.z / (std::f64::consts::PI * ray.length_squared().powi(2));
            }
        }
        let factors =
            PointVisibility::default().factors(eye, DVec3::Z, &target, DVec3::NEG_Z, &blockers);
        // The outlines of the shadows, shorter than 10, pass through squares of side 1/200 with a
        // kernel below 0.08: if all were off by half a square the same way, the error would be
        // 0.002; they are not.
        assert!((factors.visible - sum).abs() < 5e-4, "{} {sum}", factors.visible);
        assert!(factors.visible < 0.9 * factors.unoccluded && factors.visible > 0.0);
    }
}
