//! The smallest rectangle around points of a plane.
//!
//! One of its sides lies along a side of the points' convex hull (H. Freeman and R. Shapira 1975,
//! "Determining the minimum-area encasing rectangle for an arbitrary closed curve"), so each of
//! these is tried.

use glam::DVec2;

/// A rectangle in a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rectangle {
    pub corner: DVec2,
    /// Unit direction of the first pair of sides; the second is perpendicular, to its left.
    pub axis: DVec2,
    /// Lengths of the sides along and across `axis`.
    pub size: DVec2,
}

impl Rectangle {
    /// The smallest by area around `points`; none where they are all on one line.
    pub fn around(points: &[DVec2]) -> Option<Rectangle> {
        let hull = convex_hull(points);
        let sides = (0..hull.len()).map(|k| hull[(k + 1) % hull.len()] - hull[k]);
        let rectangles =
            sides.filter_map(|side| Some(Rectangle::along(side.try_normalize()?, &hull)));
        let area = |r: &Rectangle| r.size.x * r.size.y;
        rectangles.filter(|r| area(r) > 0.0).min_by(|a, b| area(a).total_cmp(&area(b)))
    }

    /// That around `points` with sides along and across unit `axis`.
    fn along(axis: DVec2, points: &[DVec2]) -> Rectangle {
        let local = |p: &DVec2| DVec2::new(p.dot(axis), p.dot(axis.perp()));
        let low = points.iter().map(local).fold(DVec2::INFINITY, DVec2::min);
        let high = points.iter().map(local).fold(DVec2::NEG_INFINITY, DVec2::max);
        let corner = axis * low.x + axis.perp() * low.y;
        Rectangle { corner, axis, size: high - low }
    }
}

/// Corners of the convex hull of `points`, counter-clockwise, by monotone chains (A. M. Andrew
/// 1979).
fn convex_hull(points: &[DVec2]) -> Vec<DVec2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    let chain = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = vec![];
        for &p in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(p - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        // The next chain begins with it.
        chain.pop();
        chain
    };
    let mut hull = chain(&mut sorted.iter());
    hull.extend(chain(&mut sorted.iter().rev()));
    hull
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turned_rectangle_is_found_from_points_in_it() {
        let axis = DVec2::new(0.8, 0.6);
        let at = |x: f64, y: f64| DVec2::new(3.0, -1.0) + axis * x + axis.perp() * y;
        let mut points: Vec<DVec2> =
            [(0., 0.), (5., 0.), (5., 2.), (0., 2.)].map(|(x, y)| at(x, y)).into();
        points.extend((0..50).map(|k| at(0.1 * f64::from(k), 0.03 * f64::from(k))));
        let rectangle = Rectangle::around(&points).unwrap();
        let [long, short] = [rectangle.size.max_element(), rectangle.size.min_element()];
        // A few roundings of sums of products below 10.
        assert!((long - 5.0).abs() < 1e-14 && (short - 2.0).abs() < 1e-14, "{rectangle:?}");
        let middle = rectangle.corner
            + rectangle.axis * rectangle.size.x / 2.0
            + rectangle.axis.perp() * rectangle.size.y / 2.0;
        assert!(middle.distance(at(2.5, 1.0)) < 1e-14);
    }

    #[test]
    fn points_of_a_line_have_none() {
        let line: Vec<DVec2> = (0..9).map(|k| DVec2::new(f64::from(k), 2.0)).collect();
        for points in [&line[..], &line[..1], &[], &[DVec2::ONE; 4]] {
            assert_eq!(Rectangle::around(points), None);
        }
    }
}
