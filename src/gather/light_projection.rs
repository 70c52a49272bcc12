//! The projection that makes a light fill a tile of pixels.
//!
//! A light is sampled with a view of its own: an image plane perpendicular to the mean direction to
//! it, and on that plane the box around its part above the horizon, along its longest edge. The
//! image is that box, turned a little and shrunk to stay inside:
//!
//! ```text
//!    image plane, seen from the gather point
//!   ┌──────────────────────┐  half width and height of the box -> 1
//!   │   ╱‾‾‾‾‾‾‾‾‾‾‾‾‾╲    │  pixel rows cross the longest edge at SLOPE, not along it
//!   │  ╱  light         ╲  │
//!   │ ╱___________________╲│  box: along the longest edge
//!   └──────────────────────┘
//! ```

use glam::{DVec2, DVec3};

use super::GatherPoint;
use crate::geometry::polygon::clip;
use crate::hemicube::Face;

/// A view from a gather point that a light fills.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightProjection {
    /// The view as a face of a hemicube. `right` and `up` are neither unit nor perpendicular, so
    /// that the box around the light fills the image.
    pub face: Face,
    /// Direction to the middle of the image, at distance 1 along the view's axis.
    pub middle: DVec3,
    /// From `middle` to the middle of the image's right edge.
    pub right: DVec3,
    /// From `middle` to the middle of the image's upper edge.
    pub up: DVec3,
}

/// Cosine of the largest angle between the view's axis and a direction to the light: 60 degrees.
/// Lights that reach further around have no projection. Chosen by hand: on the image plane a
/// direction at 60° is √3 from the middle, and pixels there are 8 times smaller in solid angle.
const MIN_AXIS_COSINE: f64 = 0.5;

/// Slope of the image's rows against the light's longest edge, in units of its box. Edges of
/// shadows are often parallel to that edge, and would cover or miss a whole row at once. √5 − 2 is
/// [0; 4, 4, 4, …] as a continued fraction; such multiples are evenly spread modulo 1 (A.
/// Ostrowski, Abh. Math. Sem. Hamburg 1, 1922), and so are the places at which pixels are cut.
const SLOPE: f64 = 0.236_067_977_499_789_7;

/// Width of a light's box in units of its length, at least: a light seen edge-on still has pixels
/// that 32-bit floats tell apart. Chosen by hand.
const MIN_ASPECT: f64 = 1e-3;

impl LightProjection {
    /// The view from `point` of the light with these triangles; `None` when none of it is above the
    /// horizon, or when it reaches too far around for a view.
    pub fn new(
        point: &GatherPoint,
        triangles: impl Iterator<Item = [DVec3; 3]>,
    ) -> Option<LightProjection> {
        let mut directions = vec![];
        let mut edges = vec![];
        for corners in triangles {
            let [a, b, c] = corners.map(|p| p - point.position);
            if (b - a).cross(c - a).dot(a) >= 0.0 {
                continue;
            }
            let above = clip(&[a, b, c], DVec3::ZERO, point.normal);
            edges.extend((0..above.len()).map(|k| [above[k], above[(k + 1) % above.len()]]));
            directions.extend(above);
        }
        let forward = directions.iter().map(|d| d.normalize_or_zero()).sum::<DVec3>();
        let forward = forward.try_normalize()?;
        if directions.iter().any(|d| d.dot(forward) <= MIN_AXIS_COSINE * d.length()) {
            return None;
        }
        let (x, y) = forward.any_orthonormal_pair();
        let on_plane = |d: DVec3| DVec2::new(d.dot(x), d.dot(y)) / d.dot(forward);
        let edges = edges.iter().map(|&[a, b]| on_plane(b) - on_plane(a));
        let longest = edges.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
        let along = longest.try_normalize()?;
        let right = x * along.x + y * along.y;
        let up = right.cross(forward);
        let in_box = |d: &DVec3| DVec2::new(d.dot(right), d.dot(up)) / d.dot(forward);
        let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let corners = directions.iter().map(in_box);
        let (low, high) = corners.fold(empty, |(l, h), p| (l.min(p), h.max(p)));
        let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0);
        let half = half.max(DVec2::splat(MIN_ASPECT * half.max_element()));
        Some(LightProjection::of_box(forward, [right, up], middle, half))
    }

    /// The view of a disc that is far away in unit direction `forward`, from the tangent of its
    /// angular radius.
    pub fn of_disc(forward: DVec3, tangent: f64) -> LightProjection {
        let x = forward.any_orthonormal_vector();
        LightProjection::of_box(forward, [x, x.cross(forward)], DVec2::ZERO, DVec2::splat(tangent))
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
