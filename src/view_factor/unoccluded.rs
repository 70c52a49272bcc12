//! Unoccluded exchange of two polygons: closed form, or cubature where they are far apart.
//!
//! Most pairs of a scene are far apart. There a Gauss product rule over both polygons with 3⁴ or 2⁴
//! points has an error of 6e-8 of a small factor and is much cheaper than the contour integral.

use std::f64::consts::PI;

use glam::DVec3;

use super::matrix::Estimate;
use crate::form_factor::closed_form::polygon_to_polygon;
use crate::geometry::polygon::{fan, polygon_area};
use crate::geometry::quadrature::{
    GAUSS_JACOBI_2, GAUSS_JACOBI_3, GAUSS_LEGENDRE_2, GAUSS_LEGENDRE_3, Node, THREE_POINT_MIN_GAP,
    TWO_POINT_MIN_GAP, collapsed_point,
};

/// Maximum relative error of [`far_exchange`]: 16^(−6), from the table in
/// [`quadrature`](crate::geometry::quadrature), and checked below.
const FAR_ERROR: f64 = 6e-8;

/// A₁F₁₂ and its error for two convex polygons, unit normals given, that face one another entirely
/// with nothing between them, in squares of the unit of length.
pub(super) fn unoccluded_exchange(
    a: &[DVec3],
    a_normal: DVec3,
    b: &[DVec3],
    b_normal: DVec3,
) -> Estimate {
    if let Some(value) = far_exchange(a, a_normal, b, b_normal) {
        return Estimate { value, error: FAR_ERROR * value };
    }
    let area = polygon_area(a);
    // See `polygon_to_polygon`.
    let error = 1e-13 * area.min(polygon_area(b));
    Estimate { value: polygon_to_polygon(a, b) * area, error }
}

/// A₁F₁₂ of two convex polygons, unit normals given, that face one another entirely, in squares of
/// the unit of length; `None` if the gap between them is below 8 radii of the larger.
///
/// Gauss product rules over both on cos θ cos θ′ / (π r²), three points per direction, or two
/// beyond 40 radii; relative error at most [`FAR_ERROR`].
fn far_exchange(a: &[DVec3], a_normal: DVec3, b: &[DVec3], b_normal: DVec3) -> Option<f64> {
    let (centre_a, radius_a) = bounding_sphere(a);
    let (centre_b, radius_b) = bounding_sphere(b);
    let gap = centre_a.distance(centre_b) - radius_a - radius_b;
    let radius = radius_a.max(radius_b);
    if gap < THREE_POINT_MIN_GAP * radius {
        return None;
    }
    let rules = if gap < TWO_POINT_MIN_GAP * radius {
        Rules { straight: &GAUSS_LEGENDRE_3, from_tip: &GAUSS_JACOBI_3 }
    } else {
        Rules { straight: &GAUSS_LEGENDRE_2, from_tip: &GAUSS_JACOBI_2 }
    };
    let nodes_a = nodes(a, rules);
    let nodes_b = nodes(b, rules);
    let mut sum = 0.0;
    for &(x, weight_x) in &nodes_a {
        let mut seen_from_x = 0.0;
        for &(y, weight_y) in &nodes_b {
            let ray = y - x;
            let square = ray.length_squared();
            seen_from_x -= weight_y * a_normal.dot(ray) * b_normal.dot(ray) / (square * square);
        }
        sum += weight_x * seen_from_x;
    }
    Some(sum / PI)
}

/// Centre and radius of a sphere around a polygon: the mean of its corners, and the distance of the
/// farthest.
fn bounding_sphere(polygon: &[DVec3]) -> (DVec3, f64) {
    let centre = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let square = polygon.iter().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
    (centre, square.sqrt())
}

/// Rules with the same number of points.
#[derive(Clone, Copy)]
struct Rules {
    /// Gauss–Legendre: along the sides of a parallelogram, across a triangle.
    straight: &'static [Node],
    /// Gauss–Jacobi with weight u: from the tip of a triangle.
    from_tip: &'static [Node],
}

/// Points and weights over a polygon, weights adding up to its area: a product rule over a
/// parallelogram, else one over each triangle of a fan.
fn nodes(polygon: &[DVec3], rules: Rules) -> Vec<(DVec3, f64)> {
    let mut nodes = Vec::new();
    // Rounding.
    if let [a, b, c, d] = *polygon
        && (a + c - b - d).abs().max_element() <= 1e-12 * (c - a).abs().max_element()
    {
        let area = (b - a).cross(d - a).length();
        for u in rules.straight {
            for v in rules.straight {
                nodes.push((a + u.x * (b - a) + v.x * (d - a), area * u.weight * v.weight));
            }
        }
        return nodes;
    }
    for triangle in fan(polygon) {
        let [a, b, c] = triangle;
        let double_area = (b - a).cross(c - a).length();
        for u in rules.from_tip {
            for v in rules.straight {
                let weight = double_area * u.weight * v.weight;
                nodes.push((collapsed_point(triangle, u.x, v.x), weight));
            }
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::polygon::area_vector;

    #[test]
    fn far_exchange_errs_no_more_than_it_claims() {
        let a =
            [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
        let mut known = 0;
        for k in 0..60 {
            let gap = 1.2_f64.powi(k);
            // A tilted triangle, its front towards the square.
            let b = [(0.0, 0.0, 0.0), (0.2, 0.9, 0.3), (0.8, 0.1, -0.4)]
                .map(|(x, y, z)| DVec3::new(x + 0.4 * gap, y - 0.2 * gap, z + gap));
            let normal = area_vector(&b).normalize();
            let Some(flux) = far_exchange(&a, DVec3::Z, &b, normal) else { continue };
            let exact = polygon_to_polygon(&a, &b) * polygon_area(&a);
            assert!((flux / exact - 1.0).abs() < FAR_ERROR, "{gap}: {flux} for {exact}");
            known += 1;
        }
        assert!(known > 30, "{known}");
    }
}
