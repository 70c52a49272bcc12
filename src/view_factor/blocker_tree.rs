//! The convex polygons of a scene in a bounding volume tree, to find those in a shaft.
//!
//! Polygons are split at the median of their box centres along the longest side of their common
//! box, down to leaves of a few. A query descends into boxes that intersect it.

use std::ops::ControlFlow;

use glam::DVec3;

use super::convex_polygons::ConvexPolygon;
use super::shaft::{Blocker, Shaft};
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::aabb::Aabb;
use crate::geometry::bvh::Bvh;
use crate::geometry::polygon::{max_distance, polygon_difference};

/// Convex polygons in a tree of boxes.
pub(super) struct BlockerTree {
    polygons: Vec<ConvexPolygon>,
    bvh: Bvh,
}

impl BlockerTree {
    /// The tree of `polygons`.
    pub fn new(polygons: Vec<ConvexPolygon>) -> BlockerTree {
        let boxes: Vec<Aabb> = polygons.iter().map(ConvexPolygon::bounds).collect();
        let bvh = Bvh::new(&boxes, 4, |part, bounds| {
            let axis = bounds.longest_axis();
            let twice_centre = |&k: &u32| (boxes[k as usize].low + boxes[k as usize].high)[axis];
            part.sort_by(|a, b| twice_centre(a).total_cmp(&twice_centre(b)));
        });
        BlockerTree { polygons, bvh }
    }

    /// Unit normal of polygon `k`.
    pub fn normal(&self, k: u32) -> DVec3 {
        self.polygons[k as usize].normal
    }

    /// The parts of polygons strictly within `shaft`.
    pub fn within(&self, shaft: &Shaft) -> Vec<Blocker> {
        self.few_within(shaft, usize::MAX).unwrap_or_default()
    }

    /// As [`BlockerTree::within`], or `None` if there are more than `most`.
    pub fn few_within(&self, shaft: &Shaft, most: usize) -> Option<Vec<Blocker>> {
        let mut blockers = Vec::new();
        self.bvh.visit(
            |node| shaft.intersects(node),
            |k| {
                blockers.extend(self.part_within(k, shaft));
                match blockers.len() > most {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            },
        );
        (blockers.len() <= most).then_some(blockers)
    }

    /// The parts of the polygons of these indices strictly within `shaft`.
    pub fn of_these_within(&self, indices: &[u32], shaft: &Shaft) -> Vec<Blocker> {
        indices.iter().filter_map(|&k| self.part_within(k, shaft)).collect()
    }

    /// The part of polygon `k` strictly within `shaft`, if any.
    fn part_within(&self, k: u32, shaft: &Shaft) -> Option<Blocker> {
        let polygon = &self.polygons[k as usize];
        Some(Blocker { corners: shaft.clip(&polygon.corners)?, normal: polygon.normal })
    }

    /// The polygons in leaves of the tree that meet `bounds`: all that overlap, and possibly
    /// others.
    fn nearby(&self, bounds: &Aabb) -> Vec<&ConvexPolygon> {
        let mut polygons = Vec::new();
        self.bvh.visit(
            |node| node.overlaps(bounds),
            |k| {
                polygons.push(&self.polygons[k as usize]);
                ControlFlow::Continue(())
            },
        );
        polygons
    }

    /// The backs of all polygons, less the parts covered by a polygon of `fronts` in the same
    /// plane: such a plate has two fronts.
    pub fn backs(&self, fronts: &BlockerTree) -> Vec<ConvexPolygon> {
        let mut backs = Vec::new();
        for &k in self.bvh.order() {
            let polygon = &self.polygons[k as usize];
            let back = polygon.reversed();
            let mut parts = vec![back.corners.clone()];
            for front in fronts.nearby(&polygon.bounds()) {
                if lies_on(front, &back) {
                    parts = parts
                        .iter()
                        .flat_map(|part| polygon_difference(part, &front.corners, front.normal))
                        .collect();
                }
            }
            let with_area = |part| ConvexPolygon::new(part, polygon.group);
            backs.extend(parts.into_iter().filter_map(with_area));
        }
        backs
    }
}

/// Whether two polygons face the same way in the same plane.
fn lies_on(polygon: &ConvexPolygon, other: &ConvexPolygon) -> bool {
    let Some(&origin) = other.corners.first() else { return false };
    let tolerance = COINCIDENCE_TOLERANCE * max_distance(&polygon.corners, origin);
    let mut heights = polygon.corners.iter().map(|p| other.normal.dot(*p - origin));
    polygon.normal.dot(other.normal) > 0.0 && heights.all(|height| height.abs() <= tolerance)
}
