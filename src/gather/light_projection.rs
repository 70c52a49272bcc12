//! The view that fits a light: how one that is looked at apart fills a tile of pixels.

use glam::{DVec2, DVec3};

use super::GatherPoint;
use crate::geometry::polygon::clip;
use crate::hemicube::Face;

/// A view from a place that a light fills.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightProjection {
    /// The view: `right` and `up` are neither of unit length nor perpendicular, so that the part
    /// of the image plane around the light fills the image.
    pub face: Face,
    /// Directions at axial distance 1: to the middle of the image, and from there to the middle of
    /// its right and of its upper edge.
    pub middle: DVec3,
    pub right: DVec3,
    pub up: DVec3,
}

/// How far off the view's axis a light reaches at most, as a cosine: 60 degrees.
const OFF_AXIS: f64 = 0.5;

/// Slope of the image's lines against the light's longest edge, in units of its box. Edges of
/// shadows are often parallel to it; √5 − 2 is badly approximated by fractions, so that the pixels
/// such an edge runs through are cut at evenly spread places (J. G. van der Corput, 1935).
const SLOPE: f64 = 0.236_067_977_499_789_7;

/// Width of a light's box in units of its length, at least: what 32 bits still tell apart.
const THIN: f64 = 1e-3;

impl LightProjection {
    /// The view from `place` at the light with these triangles, or `None` when there is no light
    /// above the horizon or it reaches too far around for a view.
    pub fn new(
        place: &GatherPoint,
        triangles: impl Iterator<Item = [DVec3; 3]>,
    ) -> Option<LightProjection> {
        let mut directions = vec![];
        let mut edges = vec![];
        for corners in triangles {
            let [a, b, c] = corners.map(|p| p - place.position);
            if (b - a).cross(c - a).dot(a) >= 0.0 {
                continue;
            }
            let above = clip(&[a, b, c], DVec3::ZERO, place.normal);
            edges.extend((0..above.len()).map(|k| [above[k], above[(k + 1) % above.len()]]));
            directions.extend(above);
        }
        let forward = directions.iter().map(|d| d.normalize_or_zero()).sum::<DVec3>();
        let forward = forward.try_normalize()?;
        if directions.iter().any(|d| d.dot(forward) <= OFF_AXIS * d.length()) {
            return None;
        }
        let (x, y) = forward.any_orthonormal_pair();
        let flat = |d: DVec3| DVec2::new(d.dot(x), d.dot(y)) / d.dot(forward);
        let edges = edges.iter().map(|&[a, b]| flat(b) - flat(a));
        let longest = edges.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
        let along = longest.try_normalize()?;
        let right = x * along.x + y * along.y;
        let up = right.cross(forward);
        let in_box = |d: &DVec3| DVec2::new(d.dot(right), d.dot(up)) / d.dot(forward);
        let nothing = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let corners = directions.iter().map(in_box);
        let (low, high) = corners.fold(nothing, |(l, h), p| (l.min(p), h.max(p)));
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let half = half.max(DVec2::splat(THIN * half.max_element()));
        Some(LightProjection::of_box(forward, [right, up], middle, half))
    }

    /// The view along unit `forward` that shows the box around `middle` in the plane at distance 1
    /// with the given axes.
    fn of_box(forward: DVec3, [x, y]: [DVec3; 2], middle: DVec2, half: DVec2) -> LightProjection {
        // From the box to [-1, 1]², turned by the slope and shrunk to stay inside.
        let shrink = 1.0 / (1.0 + SLOPE);
        let (px, py) = ((x - forward * middle.x) / half.x, (y - forward * middle.y) / half.y);
        let face = Face {
            right: (px + py * SLOPE) * shrink,
            up: (py - px * SLOPE) * shrink,
            forward,
            bottom: -1.0,
        };
        let grow = 1.0 / (shrink * (1.0 + SLOPE * SLOPE));
        let (x, y, middle) = (x * half.x, y * half.y, forward + x * middle.x + y * middle.y);
        LightProjection { face, middle, right: (x + y * SLOPE) * grow, up: (y - x * SLOPE) * grow }
    }
}
