//! Texels that a triangle covers, and the points at which they gather.
//!
//! A point is interpolated from the four texels around it, those whose centres are less than one
//! texel away along both axes. So a triangle covers each texel around whose centre a square of two
//! texels reaches into it. Row by row:
//!
//! ```text
//!             ╱╲            the part of the triangle between the centres of the rows above and
//!   ─────────╱  ╲────────   below has an extent from left to right; centres less than a texel
//!     ·   · ╱ ·  ╲·   ·     beyond its ends are covered
//!   ───────╱──────╲──────
//! ```
//!
//! These are all texels that a triangle touches, and some around it (conservative rasterisation).

use glam::DVec2;

/// Triangle index of texels that no triangle covers.
pub(super) const NO_TRIANGLE: u32 = u32::MAX;

/// Largest difference of coordinates, in texels, that may be equal: the precision of 32-bit numbers
/// across 8192 texels.
pub(super) const ROUNDING: f64 = 1e-3;

/// For each texel of a map of this `size` the index of the triangle, out of `triangles` by corners
/// in units of texels, on which it gathers: of those that cover it the one nearest to its centre,
/// the first of several.
pub(super) fn triangles_of_texels(
    size: [u32; 2],
    triangles: impl Iterator<Item = [DVec2; 3]>,
) -> Vec<u32> {
    let texels = size[0] as usize * size[1] as usize;
    let mut owners = vec![NO_TRIANGLE; texels];
    let mut distances = vec![f32::INFINITY; texels];
    for (t, corners) in (0..).zip(triangles) {
        for_each_texel_around(corners, 1.0 - ROUNDING, size, |texel, centre| {
            let distance = nearest_point(corners, centre).1 as f32;
            if distance < distances[texel] {
                (owners[texel], distances[texel]) = (t, distance);
            }
            true
        });
    }
    owners
}

/// Calls `visit` with the number and the centre of each texel whose centre is less than `reach`
/// texels away from some point of a triangle along both axes, until it returns false.
pub(super) fn for_each_texel_around(
    corners: [DVec2; 3],
    reach: f64,
    [width, height]: [u32; 2],
    mut visit: impl FnMut(usize, DVec2) -> bool,
) {
    let [low, high] = [DVec2::min, DVec2::max].map(|f| f(f(corners[0], corners[1]), corners[2]));
    // Casts saturate: texels outside the map are cut off.
    let range = |low: f64, high: f64, count: u32| {
        let end = ((high + reach).floor() + 1.0).max(0.0) as u32;
        (low - reach).ceil().max(0.0) as u32..end.min(count)
    };
    for row in range(low.y, high.y, height) {
        let y = f64::from(row);
        let Some((left, right)) = extent_between(corners, y - reach, y + reach) else { continue };
        for column in range(left, right, width) {
            let texel = row as usize * width as usize + column as usize;
            if !visit(texel, DVec2::new(column.into(), y)) {
                return;
            }
        }
    }
}

/// The extent from left to right of the part of a triangle between two heights.
fn extent_between(corners: [DVec2; 3], low: f64, high: f64) -> Option<(f64, f64)> {
    let mut extent: Option<(f64, f64)> = None;
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (from, to) = if a.y <= b.y { (a, b) } else { (b, a) };
        if from.y > high || to.y < low {
            continue;
        }
        let rise = to.y - from.y;
        let along = |y: f64, flat: f64| {
            if rise > 0.0 { ((y - from.y) / rise).clamp(0.0, 1.0) } else { flat }
        };
        for share in [along(low, 0.0), along(high, 1.0)] {
            let x = from.x + (to.x - from.x) * share;
            let (left, right) = extent.unwrap_or((x, x));
            extent = Some((left.min(x), right.max(x)));
        }
    }
    extent
}

/// The point of a triangle that is nearest to `point`, by the weights of the second and third
/// corner, and the square of its distance.
pub(super) fn nearest_point([a, b, c]: [DVec2; 3], point: DVec2) -> ([f64; 2], f64) {
    let double_area = (b - a).perp_dot(c - a);
    let (u, v) = ((point - a).perp_dot(c - a), (b - a).perp_dot(point - a));
    let [u, v] = [u, v].map(|x| x / double_area);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
        return ([u, v], 0.0);
    }
    let on_side = |from: DVec2, to: DVec2, weights: fn(f64) -> [f64; 2]| {
        let along = to - from;
        let share = (point - from).dot(along) / along.length_squared();
        // A side without length is a point.
        let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
        (weights(share), (from + along * share).distance_squared(point))
    };
    let sides = [
        on_side(a, b, |s| [s, 0.0]),
        on_side(b, c, |s| [1.0 - s, s]),
        on_side(c, a, |s| [0.0, 1.0 - s]),
    ];
    sides.into_iter().fold(([0.0; 2], f64::INFINITY), |x, y| if y.1 < x.1 { y } else { x })
}

/// Distance of `point` inside a triangle from its nearest side; negative outside.
pub(super) fn depth_inside([a, b, c]: [DVec2; 3], point: DVec2) -> f64 {
    let turn = (b - a).perp_dot(c - a).signum();
    let side =
        |from: DVec2, to: DVec2| turn * (to - from).perp_dot(point - from) / (to - from).length();
    side(a, b).min(side(b, c)).min(side(c, a))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether a triangle has a point less than `reach` from `centre` along both axes, by testing
    /// many points.
    fn reaches([a, b, c]: [DVec2; 3], centre: DVec2, reach: f64) -> bool {
        let steps = 400;
        let at = |i: u32, j: u32| {
            let [u, v] = [i, j].map(|k| f64::from(k) / f64::from(steps));
            a * (1.0 - u - v) + b * u + c * v
        };
        (0..=steps)
            .any(|i| (0..=steps - i).any(|j| (at(i, j) - centre).abs().max_element() < reach))
    }

    #[test]
    fn all_texels_that_a_triangle_is_shown_with_are_covered() {
        let triangles = [
            [[2.0, 1.0], [7.3, 2.4], [3.1, 6.6]],
            // A sliver between two rows of centres, and one along a diagonal.
            [[1.2, 3.4], [8.1, 3.5], [4.0, 3.6]],
            [[0.3, 0.1], [7.9, 7.5], [7.6, 7.7]],
            // Half outside of the map.
            [[-3.0, 4.2], [2.1, 2.2], [2.2, 11.0]],
        ];
        for corners in triangles.map(|t| t.map(DVec2::from)) {
            let mut covered = vec![false; 81];
            for_each_texel_around(corners, 1.0, [9, 9], |texel, centre| {
                assert_eq!(centre, DVec2::new((texel % 9) as f64, (texel / 9) as f64));
                covered[texel] = true;
                true
            });
            for (texel, covered) in covered.into_iter().enumerate() {
                let centre = DVec2::new((texel % 9) as f64, (texel / 9) as f64);
                // Points of the grid are 0.02 texels apart at most, and 0.014 from any other.
                assert!(covered || !reaches(corners, centre, 1.0), "{corners:?} {centre}");
                assert!(!covered || reaches(corners, centre, 1.02), "{corners:?} {centre}");
            }
        }
    }

    #[test]
    fn nearest_point_of_a_triangle() {
        let corners = [[0.0, 0.0], [4.0, 0.0], [0.0, 2.0]].map(DVec2::from);
        for (point, weights, square) in [
            ([1.0, 0.5], [0.25, 0.25], 0.0),
            ([1.0, -3.0], [0.25, 0.0], 9.0),
            ([-1.0, 0.5], [0.0, 0.25], 1.0),
            ([6.0, -1.0], [1.0, 0.0], 5.0),
            // One along the normal (1, 2) from the middle of the long side.
            ([3.0, 3.0], [0.5, 0.5], 5.0),
        ] {
            let (nearest, distance) = nearest_point(corners, point.into());
            assert_eq!((nearest, distance), (weights, square), "{point:?}");
        }
        // A triangle without area is its longest side.
        let flat = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]].map(DVec2::from);
        assert_eq!(nearest_point(flat, DVec2::new(3.0, 1.0)).1, 2.0);
        assert_eq!(nearest_point([DVec2::ONE; 3], DVec2::ZERO).1, 2.0);
    }

    #[test]
    fn depth_inside_is_the_same_for_either_winding() {
        let [a, b, c] = [[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]].map(DVec2::from);
        for corners in [[a, b, c], [a, c, b]] {
            assert_eq!(depth_inside(corners, DVec2::new(1.0, 1.0)), 1.0);
            assert_eq!(depth_inside(corners, DVec2::new(1.0, 0.25)), 0.25);
            assert_eq!(depth_inside(corners, DVec2::new(1.0, -2.0)), -2.0);
        }
    }
}
