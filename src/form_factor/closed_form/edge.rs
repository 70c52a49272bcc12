//! Edges of a polygon, for sums over its outline.

use glam::DVec3;

/// An edge of a polygon.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    pub start: DVec3,
    pub end: DVec3,
    /// From start to end, of unit length.
    pub direction: DVec3,
    pub length: f64,
}

/// The edges of a polygon in order, less those without length.
pub(super) fn edges(polygon: &[DVec3]) -> impl Iterator<Item = Edge> {
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).filter_map(|(&start, &end)| {
        let length = start.distance(end);
        (length > 0.0).then(|| Edge { start, end, direction: (end - start) / length, length })
    })
}
