//! Lambert's formula: form factor from a surface element to a polygon, as a sum over edges.

use std::f64::consts::TAU;

use glam::DVec3;

use super::edge::{Edge, edges};

/// Lambert's formula for a polygon entirely above the horizon of the surface element at `point`
/// with unit `normal`; negative if the element is behind the polygon.
pub(crate) fn lambert(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let along_normal = |edge: Edge| {
        let (a, b) = (edge.start - point, edge.end - point);
        let across = a.cross(b - a);
        let sine = across.length();
        if sine > 0.0 { libm::atan2(sine, a.dot(b)) * normal.dot(across) / sine } else { 0.0 }
    };
    -edges(corners).map(along_normal).sum::<f64>() / TAU
}
