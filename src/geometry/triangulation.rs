//! Polygons in space, convex or not, cut into triangles.
//!
//! A convex outline is halved recursively, so that a disc of a thousand corners does not become a
//! thousand slivers at one corner, and a few triangles cover most of it. A fan from the first
//! corner covers some outlines that are not convex. If neither does, ears are clipped off one by
//! one in the polygon's own plane (D. Eberly, "Triangulation by Ear Clipping", 2002; the `earcut`
//! crate). Either way the areas of the triangles must sum to that of the outline (Newell's
//! formula); an outline that crosses itself fails this, and [`triangulate_anyhow`] cuts it as far
//! as possible.

use earcut::{Earcut, utils3d::project3d_to_2d};
use glam::DVec3;

/// Height of a triangle up to which it is flat but for the rounding of its corners: a few
/// operations on coordinates. In units of the polygon's extent or of its largest coordinate,
/// whichever is larger.
const FLAT_HEIGHT: f64 = 8.0 * f64::EPSILON;

/// Triangles that cover the polygon with these corners, as indices into them, in its orientation.
///
/// By halves where these cover it, else by a fan from the first corner, else by ear clipping. A
/// polygon with fewer than three corners, or all on a line, gives one triangle without area. `None`
/// when the areas of the triangles do not sum to that of the outline, as where it crosses itself.
pub(crate) fn triangulate(corners: &[DVec3]) -> Option<Vec<[usize; 3]>> {
    let (n, &origin) = (corners.len(), corners.first()?);
    if n == 3 {
        return Some(vec![[0, 1, 2]]);
    }
    // Around the first corner and in units of the largest extent, so that neither rounds away.
    let extent = corners.iter().map(|&p| (p - origin).abs().max_element()).fold(0.0, f64::max);
    let points: Vec<DVec3> = corners.iter().map(|&p| (p - origin) / extent).collect();
    // Rounding is a step of the coordinates, whatever the polygon's position.
    let reach = corners.iter().map(|p| p.abs().max_element()).fold(extent, f64::max) / extent;
    let flat_height = FLAT_HEIGHT * reach;
    if extent == 0.0 || on_a_line(&points, flat_height) {
        return Some(vec![[0, 0, 0]]);
    }
    // Newell's normal: its length is twice the area of a flat polygon.
    let newell: DVec3 = (1..n).map(|i| points[i - 1].cross(points[i])).sum();
    let doubled_area = newell.length();
    // Each of the n products is off by a few ε. The rest may have no front, or not be finite.
    let rounding = 16.0 * f64::EPSILON * reach * n as f64;
    if doubled_area.is_nan() || doubled_area <= rounding {
        return None;
    }
    let up = newell / doubled_area;
    let covers = |triangles: &[[usize; 3]]| {
        triangles.iter().all(|t| turns(t.map(|i| points[i]), up, flat_height))
    };
    if let Some(triangles) = [halves(n), fan(n)].into_iter().find(|cut| covers(cut)) {
        return Some(triangles);
    }
    let (triangles, covered) = ear_clip(&points, up, flat_height)?;
    ((covered - doubled_area).abs() <= rounding).then_some(triangles)
}

/// Triangles for the polygon with these corners where [`triangulate`] gives none: the ears that can
/// be clipped off an outline that crosses itself, else a fan from the first corner.
pub(crate) fn triangulate_anyhow(corners: &[DVec3]) -> Vec<[usize; 3]> {
    let origin = corners.first().copied().unwrap_or_default();
    let extent = corners.iter().map(|&p| (p - origin).abs().max_element()).fold(0.0, f64::max);
    let points: Vec<DVec3> = corners.iter().map(|&p| (p - origin) / extent).collect();
    let newell: DVec3 = points.windows(2).map(|edge| edge[0].cross(edge[1])).sum();
    let ears = newell.try_normalize().and_then(|up| ear_clip(&points, up, FLAT_HEIGHT));
    match ears {
        Some((triangles, covered)) if covered > 0.0 => triangles,
        _ => fan(corners.len()),
    }
}

/// Whether all corners lie on the line through the first and the one farthest from it.
fn on_a_line(points: &[DVec3], flat_height: f64) -> bool {
    let farther = |a: DVec3, b: DVec3| if b.length() > a.length() { b } else { a };
    let far = points.iter().copied().fold(DVec3::ZERO, farther);
    points.iter().all(|p| far.cross(*p).length() <= flat_height)
}

/// Triangles between the first corner, the last and the middle one of `n`, and recursively of both
/// sides: a corner is in at most two of each size.
fn halves(n: usize) -> Vec<[usize; 3]> {
    let mut triangles = Vec::with_capacity(n.saturating_sub(2));
    let mut left = vec![(0, n - 1)];
    while let Some((first, last)) = left.pop() {
        if last - first < 2 {
            continue;
        }
        let middle = (first + last).div_ceil(2);
        triangles.push([first, middle, last]);
        left.extend([(first, middle), (middle, last)]);
    }
    triangles.sort_unstable();
    triangles
}

/// Triangles between the first of `n` corners and each edge opposite to it.
fn fan(n: usize) -> Vec<[usize; 3]> {
    (2..n).map(|i| [0, i - 1, i]).collect()
}

/// Whether a triangle turns about `up` and is higher than `flat_height`.
fn turns([a, b, c]: [DVec3; 3], up: DVec3, flat_height: f64) -> bool {
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    (b - a).cross(c - a).dot(up) > flat_height * longest
}

/// Ear clipping in the plane across `up`: triangles, and twice the area that they cover there.
fn ear_clip(points: &[DVec3], up: DVec3, flat_height: f64) -> Option<(Vec<[usize; 3]>, f64)> {
    // The time is quadratic in the number of corners at worst.
    if points.len() > 10_000 {
        return None;
    }
    let points: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
    let mut flat = Vec::new();
    if !project3d_to_2d(&points, points.len(), &mut flat) {
        return None;
    }
    let mut indices: Vec<u32> = Vec::new();
    Earcut::new().earcut_slice(&flat, &[], &mut indices);
    let mut covered = 0.0;
    let mut triangles = Vec::with_capacity(indices.len() / 3);
    for corners in indices.chunks_exact(3) {
        let mut triangle = [corners[0], corners[1], corners[2]].map(|i| i as usize);
        let [a, b, c] = triangle.map(|i| DVec3::from_array(points[i]));
        let turn = (b - a).cross(c - a).dot(up);
        covered += turn.abs();
        if turn < 0.0 {
            triangle.swap(1, 2);
        }
        // Ears can be flat where corners lie within an edge.
        if turns(triangle.map(|i| DVec3::from_array(points[i])), up, flat_height) {
            triangles.push(triangle);
        }
    }
    if triangles.is_empty() {
        triangles.push([0, 0, 0]);
    }
    Some((triangles, covered))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat3;

    /// Twice the area that `outline` bounds, counter-clockwise positive, by the shoelace formula.
    fn shoelace(outline: &[[f64; 2]]) -> f64 {
        let next = outline.iter().cycle().skip(1);
        outline.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum()
    }

    /// Cuts `outline`, laid into several planes, from every first corner and in both directions;
    /// the triangles must sum to its area and all turn as it does.
    fn covers(outline: &[[f64; 2]]) {
        let mut outline = outline.to_vec();
        let tilted = DMat3::from_axis_angle(DVec3::new(1., 2., 3.).normalize(), 1.0);
        let swapped = DMat3::from_cols(DVec3::Y, DVec3::X, -DVec3::Z);
        for turn in 0..2 * outline.len() {
            outline.rotate_left(1);
            if turn == outline.len() {
                outline.reverse();
            }
            let doubled = shoelace(&outline);
            for frame in [DMat3::IDENTITY, swapped, tilted, tilted * 1e-9, tilted * 1e9] {
                let put = |p: &[f64; 2]| frame * DVec3::new(p[0], p[1], 4.0);
                let corners: Vec<DVec3> = outline.iter().map(put).collect();
                let up = frame.z_axis.normalize() * doubled.signum();
                let scale = frame.z_axis.length_squared();
                let triangles = triangulate(&corners).unwrap();
                let mut sum = 0.0;
                for t in triangles {
                    let [a, b, c] = t.map(|i| corners[i]);
                    let cross = (b - a).cross(c - a) / scale;
                    // Coordinates below 10 and rotations round by some 10 ε = 2e-15 each.
                    assert!(cross.dot(up) > 1e-13, "{t:?} of {outline:?}");
                    sum += cross.dot(up);
                }
                assert!((sum - doubled.abs()).abs() < 1e-12, "{sum} of {doubled}: {outline:?}");
            }
        }
    }

    #[test]
    fn concave_outlines_keep_area_and_winding() {
        let l = [[0., 0.], [2., 0.], [2., 1.], [1., 1.], [1., 2.], [0., 2.]];
        let arrow = [[0., 0.], [2., -1.], [1., 0.], [2., 1.]];
        let u = [[0., 0.], [3., 0.], [3., 3.], [2., 3.], [2., 1.], [1., 1.], [1., 3.], [0., 3.]];
        let star: Vec<_> = (0..10)
            .map(|i| (i as f64 * 0.2 * std::f64::consts::PI, [2.0, 0.5][i % 2]))
            .map(|(angle, r): (f64, f64)| [r * angle.cos(), r * angle.sin()])
            .collect();
        for outline in [&l[..], &arrow, &u, &star] {
            covers(outline);
        }
    }

    #[test]
    fn corners_within_an_edge_give_no_flat_triangle() {
        covers(&[[0., 0.], [1., 0.], [2., 0.], [2., 2.], [0., 2.]]);
        covers(&[[0., 0.], [1., 0.], [2., 0.], [2., 1.], [2., 2.], [1., 2.], [0., 2.], [0., 1.]]);
    }

    #[test]
    fn convex_outline_is_halved() {
        let round = |n: usize| {
            let angle = |i: usize| 2.0 * std::f64::consts::PI * i as f64 / n as f64;
            (0..n).map(|i| [angle(i).cos(), angle(i).sin()]).collect::<Vec<_>>()
        };
        for n in [3, 4, 5, 6, 7, 12] {
            covers(&round(n));
        }
        let corners: Vec<DVec3> = round(1000).iter().map(|p| DVec3::new(p[0], 0.0, p[1])).collect();
        let triangles = triangulate(&corners).unwrap();
        assert_eq!(triangles.len(), 998);
        // 2 × 500, 2 × 250, ... until an edge: at most two of each of log₂ 1000 < 10 sizes.
        let at = |corner: usize| triangles.iter().filter(|t| t.contains(&corner)).count();
        assert!((0..1000).all(|corner| at(corner) <= 20));
        // A quad that is a little bent has the diagonal of its first corner.
        let mut bent = [DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
        bent[2].z = 0.1;
        assert_eq!(triangulate(&bent), Some(vec![[0, 1, 2], [0, 2, 3]]));
    }

    #[test]
    fn outline_seen_from_its_first_corner_becomes_a_fan() {
        // A notch before the last corner: the half on its two edges turns the other way.
        let notched = [[0., 0.], [2., 0.], [2., 2.], [0.5, 0.6], [0., 2.]];
        let corners = notched.map(|[x, y]| DVec3::new(x, y, 0.0));
        assert_eq!(triangulate(&corners), Some(fan(5)));
    }

    #[test]
    fn outlines_that_cross_themselves_are_refused() {
        let flat = |outline: &[[f64; 2]]| {
            triangulate(&outline.iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect::<Vec<_>>())
        };
        assert_eq!(flat(&[[0., 0.], [1., 1.], [1., 0.], [0., 1.]]), None);
        for turn in 0..100 {
            // Two equal lobes: the normal is determined by rounding alone.
            let frame = DMat3::from_axis_angle(DVec3::new(1., 2., 3.).normalize(), turn as f64);
            let bow = [[0., 0.], [1., 1.], [1., 0.], [0., 1.]].map(|[x, y]| DVec3::new(x, y, 3.0));
            assert_eq!(triangulate(&bow.map(|p| frame * p)), None);
        }
        assert_eq!(flat(&[[0., 0.], [3., 3.], [3., 0.], [0., 1.]]), None);
        let point = |i: usize| [(1.6 * i as f64).cos(), (1.6 * i as f64).sin()];
        let round_thrice: Vec<_> = (0..11).map(point).collect();
        assert_eq!(flat(&round_thrice), None);
        let pentagram = [0., 2., 4., 1., 3.].map(|i: f64| [(1.2566 * i).cos(), (1.2566 * i).sin()]);
        assert_eq!(flat(&pentagram), None);
        // All on a line, or too few: without area, rather than wrong.
        for few in [&[[1., 2.]][..], &[[0., 0.], [1., 1.]], &[[1., 2.]; 4]] {
            assert_eq!(flat(few), Some(vec![[0, 0, 0]]));
        }
        assert_eq!(flat(&[]), None);
        // Too far apart to measure.
        assert_eq!(flat(&[[-1e308, 0.], [1e308, 0.], [1e308, 1e308], [0., 1e308]]), None);
        assert_eq!(flat(&[[0., 0.], [1., 1.], [3., 3.], [2., 2.]]), Some(vec![[0, 0, 0]]));
    }
}
