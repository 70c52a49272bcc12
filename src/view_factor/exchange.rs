//! Flux between two convex pieces: nothing, in closed form, or past others by cubature.

use glam::DVec3;

use super::Estimate;
use super::convex_polygons::ConvexPolygon;
use super::cubature::{Cell, OccludedPair};
use super::far_field::{FAR_ERROR, far_exchange};
use super::point_visibility::PointVisibility;
use super::shaft::{CONTACT, ONE, Shaft, Tree, covers};
use super::visual_events::{creases, parts_between, standing_on};
use crate::form_factor::closed_form::polygon_to_polygon;
use crate::geometry::polygon::{clip, fan, merge_close_corners, polygon_area};
use crate::sampling::hash::split_mix64;

/// What the closed form errs by at most, as a share of the flux from the smaller piece into the
/// whole hemisphere (see [`polygon_to_polygon`]).
const CLOSED_FORM_ERROR: f64 = 1e-13;

/// Pieces are unlike in length if the ratio is below this.
const UNLIKE: f64 = 0.25;

/// What is known of the flux between two pieces before any refinement.
pub(super) enum PairVisibility {
    /// Neither sees the other.
    Nothing,
    /// All of each sees all of the other: in closed form.
    Whole(Estimate),
    /// Others stand between.
    OccludedPair(Box<OccludedPair>),
}

/// Links two pieces; `seed` makes cuts differ from pair to pair. The piece on which fewer blockers
/// stand is gathered over, for from there less changes at once, else the smaller; and always one
/// that is much shorter: all it could receive may come from a spot of the other that no cell finds.
pub(super) fn link(
    s: &ConvexPolygon,
    t: &ConvexPolygon,
    blockers: &Tree,
    eye: &mut PointVisibility,
    seed: u64,
) -> PairVisibility {
    let (Some(&at_s), Some(&at_t)) = (s.corners.first(), t.corners.first()) else {
        return PairVisibility::Nothing;
    };
    let faces = |from: &ConvexPolygon, at: DVec3, to: &ConvexPolygon| {
        to.corners.iter().any(|&p| from.normal.dot(p - at) > CONTACT)
    };
    if !faces(s, at_s, t) || !faces(t, at_t, s) {
        return PairVisibility::Nothing;
    }
    let mut a = clip(&s.corners, at_t, t.normal);
    let mut b = clip(&t.corners, at_s, s.normal);
    merge_close_corners(&mut a, ONE);
    merge_close_corners(&mut b, ONE);
    if a.len() < 3 || b.len() < 3 {
        return PairVisibility::Nothing;
    }
    let between = blockers.within(&Shaft::new(&a, s.normal, &b, t.normal));
    if between.is_empty() {
        return PairVisibility::Whole(unblocked(&a, s.normal, &b, t.normal));
    }
    if between.iter().any(|blocker| covers(blocker, &a, &b)) {
        return PairVisibility::Nothing;
    }
    let on_a = standing_on(&a, s.normal, &between);
    let on_b = standing_on(&b, t.normal, &between);
    let (long_a, long_b) = (length(&a), length(&b));
    let a_first = if long_a.min(long_b) < UNLIKE * long_a.max(long_b) {
        long_a <= long_b
    } else {
        (on_a.len(), polygon_area(&a)) <= (on_b.len(), polygon_area(&b))
    };
    let (a, b) = ((a, s.normal, on_a), (b, t.normal, on_b));
    let (domain, target) = if a_first { (a, b) } else { (b, a) };
    let mut partial = OccludedPair {
        area: polygon_area(&domain.0),
        normal: domain.1,
        creases: creases(&target.0, &between, &domain.0),
        target: target.0,
        target_normal: target.1,
        cells: Vec::new(),
    };
    let parts = parts_between(domain.0, &domain.2);
    for (corners, k) in parts.iter().flat_map(|part| fan(part)).zip(0..) {
        let cell = Cell::new(&partial, corners, &between, split_mix64(seed.wrapping_add(k)), eye);
        partial.cells.push(cell);
    }
    PairVisibility::OccludedPair(Box::new(partial))
}

/// Distance of the farthest corner from the first: the extent, or half of it at least.
fn length(polygon: &[DVec3]) -> f64 {
    polygon.iter().map(|p| p.distance(polygon[0])).fold(0.0, f64::max)
}

/// Flux between two pieces with nothing between, all before one another.
pub(super) fn unblocked(a: &[DVec3], a_normal: DVec3, b: &[DVec3], b_normal: DVec3) -> Estimate {
    if let Some(value) = far_exchange(a, a_normal, b, b_normal) {
        return Estimate { value, error: FAR_ERROR * value };
    }
    let area = polygon_area(a);
    let error = CLOSED_FORM_ERROR * area.min(polygon_area(b));
    Estimate { value: polygon_to_polygon(a, b) * area, error }
}
