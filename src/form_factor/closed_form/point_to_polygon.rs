//! From a surface element to a polygon: clipped by the horizon, then Lambert's formula.

use glam::DVec3;

use super::face::Face;
use crate::geometry::polygon::{PLANE_TOLERANCE, area_vector, clip, max_distance};

/// Form factor from a surface element at `point` with unit `normal` to the front of `polygon`: the
/// share of the light leaving the element that arrives there.
///
/// The part below the element's horizon is clipped off. The factor is 0 where the element is behind
/// the polygon's plane, and also in that plane (within 1e-13 of its distance to the farthest
/// corner), even on the polygon's own boundary: from there it is seen edge on.
///
/// Lambert's formula, F = 1/(2π) Σ Γᵢ·n, Γᵢ with the angle that edge i subtends as its length and
/// perpendicular to the plane of edge and point (J. H. Lambert, Photometria, 1760; D. R. Baum, H.
/// E. Rushmeier, J. M. Winget, "Improving radiosity solutions through the use of analytically
/// determined form-factors", SIGGRAPH 1989). Beyond 64 radii of the polygon, Gauss cubature of cos
/// θ cos θ′ / (π r²). Relative error below 1e-12 away from grazing angles, at any distance;
/// absolute below 1e-14 always.
pub fn point_to_polygon(point: DVec3, normal: DVec3, polygon: &[DVec3]) -> f64 {
    let facing = area_vector(polygon).normalize_or_zero();
    let Some(&corner) = polygon.first() else { return 0.0 };
    if facing.dot(point - corner) <= PLANE_TOLERANCE * max_distance(polygon, point) {
        return 0.0;
    }
    Face::new(clip(polygon, point, normal), facing)
        .map_or(0.0, |face| face.factor_from(point, normal).clamp(0.0, 1.0))
}
