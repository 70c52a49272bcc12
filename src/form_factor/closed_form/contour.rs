//! The double contour integral A₁F₁₂ = 1/(2π) ∮∮ ln r dx·dx′, a sum over pairs of edges.
//!
//! The integral over a pair of edges with directions d, d′ is d·d′ ∫∫ ln r dt dt′:
//!
//! - perpendicular edges add nothing;
//! - parallel edges have an elementary twofold antiderivative, taken at the four pairs of ends;
//! - for others, the inner integral is elementary, the outer is computed by tanh–sinh quadrature
//!   between the points where the inner one is singular or nearly so.

use std::f64::consts::TAU;

use glam::DVec3;

use super::edge::{Edge, edges};
use super::face::Face;
use crate::geometry::quadrature::tanh_sinh;

/// Maximum deviation of an angle from 0 or 90 degrees (radians) at which edges count as parallel or
/// perpendicular: directions carry rounding of a few 1e-16, and the error is 1e-14 of a term.
const ANGLE_TOLERANCE: f64 = 1e-14;

/// A₁F₁₂ as a double contour integral, in units of the size of the pair: a constant added to ln r
/// adds nothing to the total, and in these units the logarithms are small.
pub(super) fn contour_integral(p: &Face, q: &Face) -> f64 {
    let unit = p.radius + q.radius + p.centre.distance(q.centre);
    let outline = |face: &Face| -> Vec<DVec3> {
        face.corners.iter().map(|corner| (corner - p.centre) / unit).collect()
    };
    let (p, q) = (outline(p), outline(q));
    let pairs = edges(&p).flat_map(|a| edges(&q).map(move |b| edge_pair(a, b)));
    unit * unit * pairs.sum::<f64>() / TAU
}

/// ∫∫ (1 + ln r) dx·dx′ over two edges. The 1 cancels in the total and shortens the terms.
fn edge_pair(a: Edge, b: Edge) -> f64 {
    let cosine = a.direction.dot(b.direction);
    let sine = a.direction.cross(b.direction).length();
    if cosine.abs() <= ANGLE_TOLERANCE {
        0.0
    } else if sine <= ANGLE_TOLERANCE {
        parallel_edges(a, b)
    } else if a.length <= b.length {
        cosine * skew_edges(a, b)
    } else {
        cosine * skew_edges(b, a)
    }
}

/// [`edge_pair`] for parallel edges: second differences of the twofold antiderivative of 1 + ln r.
fn parallel_edges(a: Edge, b: Edge) -> f64 {
    let distance = (b.start - a.start).cross(a.direction).length();
    let antiderivative = |from: DVec3, to: DVec3| {
        let along = (to - from).dot(a.direction);
        let (t, h) = (along * along, distance * distance);
        if t + h == 0.0 {
            return 0.0;
        }
        0.25 * ((t - h) * libm::log(t + h) - t) + distance * along * libm::atan2(along, distance)
    };
    antiderivative(a.start, b.end) - antiderivative(a.end, b.end) - antiderivative(a.start, b.start)
        + antiderivative(a.end, b.start)
}

/// ∫∫ (1 + ln r) dt dt′ over two edges that are not parallel: along `b` in closed form, along `a`
/// by quadrature, cut where the integrand is singular or nearly so: beside the ends of `b`, and
/// where the lines come closest. Such a point is off the edge by some imaginary length, and used
/// for a cut only if that is less than the edge's length; it is then at the end of intervals, where
/// tanh–sinh quadrature tolerates singularities.
fn skew_edges(a: Edge, b: Edge) -> f64 {
    let beside = |end: DVec3| {
        let ray = end - a.start;
        (ray.dot(a.direction), ray.cross(a.direction).length())
    };
    let across = a.direction.cross(b.direction);
    let ray = b.start - a.start;
    let sine_square = across.length_squared();
    let nearest =
        (ray.cross(b.direction).dot(across) / sine_square, ray.dot(across).abs() / sine_square);
    let mut cuts = vec![0.0, a.length];
    for (along, imaginary) in [beside(b.start), beside(b.end), nearest] {
        if 0.0 < along && along < a.length && imaginary < a.length {
            cuts.push(along);
        }
    }
    cuts.sort_by(f64::total_cmp);
    let inner = |t: f64| log_integral(a.start + t * a.direction, b);
    cuts.windows(2).map(|cut| tanh_sinh(cut[0], cut[1], inner)).sum()
}

/// ∫ (1 + ln r) dt′ over the edge, r the distance from `point`.
fn log_integral(point: DVec3, edge: Edge) -> f64 {
    let (a, b) = (point - edge.start, point - edge.end);
    let distance = a.cross(edge.direction).length();
    let part = |t: f64, square: f64| if square > 0.0 { 0.5 * t * libm::log(square) } else { 0.0 };
    part(a.dot(edge.direction), a.length_squared())
        - part(b.dot(edge.direction), b.length_squared())
        + distance * libm::atan2(distance * edge.length, a.dot(b))
}
