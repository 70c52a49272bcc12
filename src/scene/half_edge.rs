//! Sides of triangles by the positions at their ends.

use rayon::prelude::*;

use super::Scene;

/// A side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct HalfEdge {
    /// Numbers of the welded positions at its ends, the lower first.
    pub ends: [u32; 2],
    pub triangle: usize,
    /// From this corner of the triangle to the next.
    pub corner: usize,
    /// Whether the triangle runs along it from the higher position to the lower.
    pub reversed: bool,
}

impl HalfEdge {
    /// Whether both lie between the same two positions.
    pub fn has_ends_of(&self, other: &HalfEdge) -> bool {
        self.ends == other.ends
    }
}

impl Scene {
    /// The sides of all triangles: those between the same two positions together, in the order of
    /// the triangles.
    pub(crate) fn half_edges(&self) -> Vec<HalfEdge> {
        let of_triangle = |(triangle, corners): (usize, [u32; 3])| {
            [0, 1, 2].map(|corner| {
                let (a, b) = (corners[corner], corners[(corner + 1) % 3]);
                HalfEdge { ends: [a.min(b), a.max(b)], triangle, corner, reversed: a > b }
            })
        };
        let welded = self.welded_corners();
        let corners = welded.corners.iter().copied().enumerate();
        let mut all: Vec<HalfEdge> = corners.flat_map(of_triangle).collect();
        all.par_sort_unstable();
        all
    }
}
