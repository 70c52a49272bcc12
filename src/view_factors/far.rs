//! Flux between polygons far from one another, by cubature over both.

use std::f64::consts::PI;

use glam::DVec3;

/// Gauss–Legendre rules of two and three points on [0, 1].
const TWO: [(f64, f64); 2] = [(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)];
const THREE: [(f64, f64); 3] = [
    (0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    (0.5, 0.444_444_444_444_444_4),
    (0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];

/// What the rules err by at most, as a share of the flux.
pub(super) const FAR_ERROR: f64 = 6e-8;

/// Radii of gap beyond which three points a direction suffice, and two.
const FAR: f64 = 8.0;
const VERY_FAR: f64 = 32.0;

/// Flux A₁F₁₂ between two convex polygons, unit normals given, that are all before one another, if
/// they are far enough apart: nothing if the gap is below 8 radii of the larger.
///
/// Gauss product rules over both on cos θ cos θ′ / (π r²). With singularities z radii off, n
/// points a direction err by about ρ^(−2n) of the flux, ρ = z + √(z² + 1): 16^(−6) and 64^(−4),
/// [`FAR_ERROR`] both.
pub(super) fn far_exchange(
    a: &[DVec3],
    a_normal: DVec3,
    b: &[DVec3],
    b_normal: DVec3,
) -> Option<f64> {
    let ((p, r), (q, s)) = (ball(a), ball(b));
    let gap = p.distance(q) - r - s;
    let radius = r.max(s);
    if gap < FAR * radius {
        return None;
    }
    let rule: &[(f64, f64)] = if gap < VERY_FAR * radius { &THREE } else { &TWO };
    let (mut here, mut there) = (Vec::new(), Vec::new());
    nodes(a, rule, &mut here);
    nodes(b, rule, &mut there);
    let mut sum = 0.0;
    for &(x, weight) in &here {
        let mut part = 0.0;
        for &(y, other) in &there {
            let ray = y - x;
            let square = ray.length_squared();
            part -= other * a_normal.dot(ray) * b_normal.dot(ray) / (square * square);
        }
        sum += weight * part;
    }
    Some(sum / PI)
}

/// Centre and radius of a ball around a polygon.
fn ball(polygon: &[DVec3]) -> (DVec3, f64) {
    let centre = polygon.iter().sum::<DVec3>() / polygon.len() as f64;
    let square = polygon.iter().map(|p| p.distance_squared(centre)).fold(0.0, f64::max);
    (centre, square.sqrt())
}

/// Points and weights over a polygon, weights adding up to its area.
fn nodes(polygon: &[DVec3], rule: &[(f64, f64)], into: &mut Vec<(DVec3, f64)>) {
    if let [a, b, c, d] = *polygon
        && (a + c - b - d).abs().max_element() <= 1e-12 * (c - a).abs().max_element()
    {
        let area = (b - a).cross(d - a).length();
        for &(u, along) in rule {
            let across =
                |&(v, weight): &(f64, f64)| (a + u * (b - a) + v * (d - a), area * along * weight);
            into.extend(rule.iter().map(across));
        }
        return;
    }
    let Some((&a, rest)) = polygon.split_first() else { return };
    for pair in rest.windows(2) {
        let (b, c) = (pair[0], pair[1]);
        let double = (b - a).cross(c - a).length();
        for &(u, along) in rule {
            let across = |&(v, weight): &(f64, f64)| {
                (a + u * ((b - a) + v * (c - b)), double * along * weight * u)
            };
            into.extend(rule.iter().map(across));
        }
    }
}
