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

/// The same with weight u: along a triangle from its tip.
const CONE_TWO: [(f64, f64); 2] = [
    (0.355_051_025_721_682_2, 0.181_958_618_256_022_83),
    (0.844_948_974_278_317_8, 0.318_041_381_743_977_17),
];
const CONE_THREE: [(f64, f64); 3] = [
    (0.212_340_538_239_152_94, 0.069_826_979_901_454_12),
    (0.590_533_135_559_265_3, 0.229_241_106_359_586_24),
    (0.911_412_040_487_296_1, 0.200_931_913_738_959_63),
];

/// What the rules err by at most, as a share of the flux.
pub(super) const FAR_ERROR: f64 = 6e-8;

/// Radii of gap beyond which three points a direction suffice, and two.
const FAR: f64 = 8.0;
const VERY_FAR: f64 = 40.0;

/// Flux A₁F₁₂ between two convex polygons, unit normals given, that are all before one another, if
/// they are far enough apart: nothing if the gap is below 8 radii of the larger.
///
/// Gauss product rules over both on cos θ cos θ′ / (π r²). With singularities z radii off, n
/// points a direction err by about ρ^(−2n) of the flux, ρ = z + √(z² + 1): 16^(−6), which is
/// [`FAR_ERROR`], and 80^(−4), half of it.
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
    let cone: &[(f64, f64)] = if rule.len() == 2 { &CONE_TWO } else { &CONE_THREE };
    let Some((&a, rest)) = polygon.split_first() else { return };
    for pair in rest.windows(2) {
        let (b, c) = (pair[0], pair[1]);
        let double = (b - a).cross(c - a).length();
        for &(u, along) in cone {
            let across = |&(v, weight): &(f64, f64)| {
                (a + u * ((b - a) + v * (c - b)), double * along * weight)
            };
            into.extend(rule.iter().map(across));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factor::closed_form::{area_vector, polygon_area, polygon_to_polygon};

    #[test]
    fn far_pairs_err_no_more_than_is_told() {
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
