//! Mutual visibility of two convex polygons: none, full, or partial behind blockers.
//!
//! ```text
//! one behind the other                       → hidden
//! clip each by the plane of the other
//! build a shaft around both, clip blockers   → no blocker left: unoccluded, in closed form
//! one blocker between every two points       → hidden
//! else choose the domain to integrate over,
//! cut it by blockers that stand on it        → occluded, for adaptive cubature
//! ```

use glam::DVec3;

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::cubature::{Cell, OccludedPair};
use super::matrix::Estimate;
use super::point_visibility::PointVisibility;
use super::shaft::{Blocker, Shaft, fully_occludes};
use super::tolerances::CONTACT_HEIGHT;
use super::unoccluded::unoccluded_exchange;
use super::visual_events::{event_planes, parts_between_planes, standing_on};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::polygon::{clip, fan, max_distance, merge_close_corners, polygon_area};
use crate::sampling::hash::split_mix64;

/// The exchange between two polygons before any refinement.
pub(super) enum PairVisibility {
    /// Neither sees the other.
    Hidden,
    /// Fully visible: A₁F₁₂ in closed form.
    Unoccluded(Estimate),
    /// Blockers are between them.
    Occluded(Box<OccludedPair>),
}

/// Two convex polygons that face one another: each clipped to the part in front of the other's
/// plane.
pub(super) struct FacingPair {
    pub a: Vec<DVec3>,
    /// Unit normal.
    pub a_normal: DVec3,
    pub b: Vec<DVec3>,
    /// Unit normal.
    pub b_normal: DVec3,
}

impl FacingPair {
    /// The pair of `s` and `t`; `None` where one is behind the other.
    pub fn new(s: &ConvexPolygon, t: &ConvexPolygon) -> Option<FacingPair> {
        let (&at_s, &at_t) = (s.corners.first()?, t.corners.first()?);
        if !reaches_before(t, s, at_s) || !reaches_before(s, t, at_t) {
            return None;
        }
        let mut a = clip(&s.corners, at_t, t.normal);
        let mut b = clip(&t.corners, at_s, s.normal);
        merge_close_corners(&mut a, COINCIDENCE_TOLERANCE);
        merge_close_corners(&mut b, COINCIDENCE_TOLERANCE);
        let both = a.len() > 2 && b.len() > 2;
        both.then_some(FacingPair { a, a_normal: s.normal, b, b_normal: t.normal })
    }

    /// The shaft between both.
    pub fn shaft(&self) -> Shaft {
        Shaft::new(&self.a, self.a_normal, &self.b, self.b_normal)
    }

    /// Unoccluded A₁F₁₂.
    pub fn unoccluded(&self) -> Estimate {
        unoccluded_exchange(&self.a, self.a_normal, &self.b, self.b_normal)
    }

    /// The same pair in the other order.
    pub fn swapped(self) -> FacingPair {
        let FacingPair { a, a_normal, b, b_normal } = self;
        FacingPair { a: b, a_normal: b_normal, b: a, b_normal: a_normal }
    }

    /// Whether to integrate over `a` rather than over `b` with the blockers `between`: the one that
    /// is much shorter; else the one on which fewer blockers stand, since visibility jumps less
    /// there; else the smaller one.
    pub fn is_better_from_a(&self, between: &[Blocker]) -> bool {
        let [extent_a, extent_b] =
            [&self.a, &self.b].map(|corners| max_distance(corners, corners[0]));
        // All that the shorter one receives may come from a spot of the longer that no cell of that
        // one samples. Plain choice.
        if extent_a.min(extent_b) < 0.25 * extent_a.max(extent_b) {
            return extent_a <= extent_b;
        }
        let rank = |corners: &[DVec3], normal: DVec3| {
            (standing_on(corners, normal, between).len(), polygon_area(corners))
        };
        rank(&self.a, self.a_normal) <= rank(&self.b, self.b_normal)
    }

    /// The pair with the domain `a` cut into cells: between the planes of the blockers that stand
    /// on it, then into triangles.
    fn occluded_from_a(
        self,
        between: &[Blocker],
        visibility: &mut PointVisibility,
        seed: u64,
    ) -> OccludedPair {
        let FacingPair { a: domain, a_normal: normal, b: target, b_normal: target_normal } = self;
        let mut pair = OccludedPair {
            area: polygon_area(&domain),
            normal,
            event_planes: event_planes(&target, between, &domain),
            target,
            target_normal,
            cells: Vec::new(),
        };
        let standing = standing_on(&domain, normal, between);
        let parts = parts_between_planes(domain, &standing);
        for (triangle, k) in parts.iter().flat_map(|part| fan(part)).zip(0..) {
            let cell_seed = split_mix64(seed.wrapping_add(k));
            let cell = Cell::new(&pair, triangle, between, cell_seed, visibility);
            pair.cells.push(cell);
        }
        pair
    }
}

impl PairVisibility {
    /// The visibility of `s` and `t` past `blockers`; `seed` makes cuts differ from pair to pair.
    pub fn between(
        s: &ConvexPolygon,
        t: &ConvexPolygon,
        blockers: &BlockerTree,
        visibility: &mut PointVisibility,
        seed: u64,
    ) -> PairVisibility {
        let Some(pair) = FacingPair::new(s, t) else { return PairVisibility::Hidden };
        let between = blockers.within(&pair.shaft());
        if between.is_empty() {
            return PairVisibility::Unoccluded(pair.unoccluded());
        }
        if between.iter().any(|blocker| fully_occludes(blocker, &pair.a, &pair.b)) {
            return PairVisibility::Hidden;
        }
        let pair = if pair.is_better_from_a(&between) { pair } else { pair.swapped() };
        PairVisibility::Occluded(Box::new(pair.occluded_from_a(&between, visibility, seed)))
    }
}

/// Whether a corner of `polygon` is in front of the plane of `other`, which passes through
/// `origin`.
fn reaches_before(polygon: &ConvexPolygon, other: &ConvexPolygon, origin: DVec3) -> bool {
    polygon.corners.iter().any(|&p| other.normal.dot(p - origin) > CONTACT_HEIGHT)
}
