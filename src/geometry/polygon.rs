//! Convex plane polygons in space, as slices of corners.
//!
//! A polygon is planar, convex and runs counter-clockwise seen from its front; the last corner
//! joins the first. Cutting by a plane is one walk around the corners (I. E. Sutherland, G. W.
//! Hodgman, "Reentrant polygon clipping", CACM 17, 1974): every corner is above the plane, below it
//! or on it, and an edge whose ends are on different sides gets a corner where it crosses.
//!
//! ```text
//!        1───────0          above: 0 1 c₁₂ c₃₀
//!        │       │
//!  ─────c₁₂─────c₃₀─────    a corner on the plane belongs to both sides
//!        │       │
//!        2───────3          below: c₁₂ 2 3 c₃₀
//! ```
//!
//! "On" needs a tolerance, for corners carry rounding. It is given by the caller: as a length, or
//! as [`PLANE_TOLERANCE`] times the extent of the polygon.

use glam::DVec3;

/// Distance of a corner from a plane up to which it is on the plane, as a fraction of the distance
/// between a point of the plane and the farthest corner. Dimensionless.
///
/// Coordinates carry rounding of about 1e-16 of their magnitude, and a few operations multiply it;
/// 1e-13 is well above that. The neglected part changes a form factor by about 1e-13.
pub(crate) const PLANE_TOLERANCE: f64 = 1e-13;

/// Half the sum of cross products: normal to the polygon, towards its front, its length the area.
pub(crate) fn area_vector(polygon: &[DVec3]) -> DVec3 {
    fan(polygon).map(|[a, b, c]| 0.5 * (b - a).cross(c - a)).sum()
}

/// Area of a planar polygon, in squares of its unit of length.
///
/// Rounding only: relative error about 1e-16 times the ratio of length to width.
pub fn polygon_area(polygon: &[DVec3]) -> f64 {
    area_vector(polygon).length()
}

/// Distance from `origin` to the farthest corner; 0 if there is none.
pub(crate) fn max_distance(polygon: &[DVec3], origin: DVec3) -> f64 {
    polygon.iter().map(|corner| corner.distance(origin)).fold(0.0, f64::max)
}

/// The triangles of a fan from the first corner; none of fewer than three corners.
pub(crate) fn fan(polygon: &[DVec3]) -> impl Iterator<Item = [DVec3; 3]> {
    let others = polygon.get(1..).unwrap_or(&[]);
    others.windows(2).map(|edge| [polygon[0], edge[0], edge[1]])
}

/// The part of a convex polygon above the plane through `origin` with unit `normal`.
///
/// Corners within [`PLANE_TOLERANCE`] of the plane are not moved. A polygon without a corner above
/// the plane beyond the tolerance gives an empty part. Corners keep their order, and the first one
/// that stays is the first.
pub(crate) fn clip(polygon: &[DVec3], origin: DVec3, normal: DVec3) -> Vec<DVec3> {
    let (Some(&first), Some(&last)) = (polygon.first(), polygon.last()) else { return Vec::new() };
    let tolerance = PLANE_TOLERANCE * max_distance(polygon, origin);
    let height = |corner: DVec3| snapped(normal.dot(corner - origin), tolerance);
    let mut above = Vec::with_capacity(polygon.len() + 1);
    let mut highest = 0.0_f64;
    walk(polygon, height, |point, height| {
        highest = highest.max(height);
        if height >= 0.0 {
            above.push(point);
        }
    });
    if highest <= 0.0 {
        return Vec::new();
    }
    if height(last) * height(first) < 0.0 {
        // The crossing of the closing edge came first: it belongs behind the last corner.
        above.rotate_left(1);
    }
    above
}

/// Splits a convex polygon by the plane through the coordinate origin with unit `normal`, appending
/// the corners of either part to `above` and `below`.
///
/// Corners at most `tolerance` (a length) off the plane belong to both parts. A part of fewer than
/// three corners has no area.
pub(crate) fn split_through_origin(
    polygon: &[DVec3],
    normal: DVec3,
    tolerance: f64,
    above: &mut Vec<DVec3>,
    below: &mut Vec<DVec3>,
) {
    let height = |corner: DVec3| snapped(normal.dot(corner), tolerance);
    walk(polygon, height, |point, height| {
        if height >= 0.0 {
            above.push(point);
        }
        if height <= 0.0 {
            below.push(point);
        }
    });
}

/// A height over a plane, 0 where it is within `tolerance`.
fn snapped(height: f64, tolerance: f64) -> f64 {
    if height.abs() <= tolerance { 0.0 } else { height }
}

/// Goes around `polygon`, beginning with its closing edge, and visits every corner with its height
/// over a plane, and, with height 0, every point where an edge crosses the plane.
fn walk(polygon: &[DVec3], height: impl Fn(DVec3) -> f64, mut visit: impl FnMut(DVec3, f64)) {
    let Some(&last) = polygon.last() else { return };
    let mut a = last;
    let mut height_a = height(last);
    for &b in polygon {
        let height_b = height(b);
        if height_a * height_b < 0.0 {
            visit(a + (b - a) * (height_a / (height_a - height_b)), 0.0);
        }
        visit(b, height_b);
        a = b;
        height_a = height_b;
    }
}

/// The part of a convex polygon outside the convex polygon `cover` in the same plane, as convex
/// polygons. `cover_normal` is the unit normal of the cover.
///
/// Each edge of the cover in turn cuts off the part outside of it. Without overlap, the polygon
/// itself is the only part.
pub(crate) fn polygon_difference(
    polygon: &[DVec3],
    cover: &[DVec3],
    cover_normal: DVec3,
) -> Vec<Vec<DVec3>> {
    let mut outside_parts = Vec::new();
    let mut inside = polygon.to_vec();
    for (k, &a) in cover.iter().enumerate() {
        let b = cover[(k + 1) % cover.len()];
        let outwards = (b - a).cross(cover_normal).normalize_or_zero();
        let outside = clip(&inside, a, outwards);
        if outside.len() > 2 {
            outside_parts.push(outside);
        }
        inside = clip(&inside, a, -outwards);
    }
    if inside.len() > 2 { outside_parts } else { vec![polygon.to_vec()] }
}

/// Merges consecutive corners that are closer than `tolerance` times the largest distance of any
/// corner from the first. The earlier one stays.
pub(crate) fn merge_close_corners(polygon: &mut Vec<DVec3>, tolerance: f64) {
    let Some(&first) = polygon.first() else { return };
    let near = tolerance * max_distance(polygon, first);
    polygon.dedup_by(|a, b| a.distance(*b) <= near);
    while polygon.len() > 1 && polygon[polygon.len() - 1].distance(first) <= near {
        polygon.pop();
    }
}

/// Length of a triangle's longest edge.
pub(crate) fn longest_edge([a, b, c]: [DVec3; 3]) -> f64 {
    (b - a).length().max((c - b).length()).max((a - c).length())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: [f64; 2], y: [f64; 2]) -> Vec<DVec3> {
        let corners = [(x[0], y[0]), (x[1], y[0]), (x[1], y[1]), (x[0], y[1])];
        corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec()
    }

    #[test]
    fn clip_and_split_give_the_same_part() {
        let square = rectangle([-1.0, 1.0], [-1.0, 1.0]);
        for k in 0..64 {
            let angle = f64::from(k) * std::f64::consts::TAU / 64.0;
            let normal = DVec3::new(angle.cos(), angle.sin(), 0.0);
            let clipped = clip(&square, DVec3::ZERO, normal);
            let (mut above, mut below) = (Vec::new(), Vec::new());
            let tolerance = PLANE_TOLERANCE * 2.0_f64.sqrt();
            split_through_origin(&square, normal, tolerance, &mut above, &mut below);
            assert_eq!(clipped.len(), above.len());
            let shift = above.iter().position(|p| *p == clipped[0]).unwrap();
            above.rotate_left(shift);
            assert_eq!(clipped, above, "one cycle of corners");
            // Half of the square each; four products of lengths below 2, rounded.
            assert!((polygon_area(&clipped) - 2.0).abs() < 1e-14);
            assert!((polygon_area(&below) - 2.0).abs() < 1e-14);
        }
    }

    #[test]
    fn clip_drops_what_only_touches() {
        let square = rectangle([0.0, 1.0], [0.0, 1.0]);
        assert_eq!(clip(&square, DVec3::ZERO, DVec3::X), square);
        assert!(clip(&square, DVec3::ZERO, DVec3::NEG_X).is_empty());
        assert!(clip(&square, DVec3::ZERO, DVec3::Z).is_empty());
        // Within the tolerance a corner is on the plane and is not moved.
        let near = DVec3::new(1e-14, 0.0, 0.0);
        assert_eq!(clip(&square, near, DVec3::X), square);
        let half = clip(&square, DVec3::new(0.5, 0.0, 0.0), DVec3::NEG_X);
        assert_eq!(half, rectangle([0.0, 0.5], [0.0, 1.0]));
    }

    #[test]
    fn difference_and_overlap_add_up_to_the_polygon() {
        let square = rectangle([0.0, 4.0], [0.0, 4.0]);
        let inner = rectangle([1.0, 3.0], [1.0, 2.0]);
        let parts = polygon_difference(&square, &inner, DVec3::Z);
        let outside: f64 = parts.iter().map(|part| polygon_area(part)).sum();
        assert!((outside - 14.0).abs() < 1e-14, "{outside}");
        let beside = rectangle([4.0, 5.0], [0.0, 4.0]);
        assert_eq!(polygon_difference(&square, &beside, DVec3::Z), [square]);
    }

    #[test]
    fn close_corners_merge_across_closing_edge() {
        let square = rectangle([0.0, 1.0], [0.0, 1.0]);
        let mut doubled: Vec<DVec3> = Vec::new();
        for &corner in &square {
            doubled.push(corner);
            doubled.push(corner + DVec3::splat(1e-11));
        }
        doubled.push(square[0] - DVec3::splat(1e-11));
        merge_close_corners(&mut doubled, 1e-9);
        assert_eq!(doubled, square);
    }
}
