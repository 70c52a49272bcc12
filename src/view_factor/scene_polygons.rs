//! A scene as convex polygons: those that emit and receive, and the blockers.

use super::blocker_tree::BlockerTree;
use super::convex_polygons::{Merge, MergedTriangles, convex_polygons};
use super::fronts::Fronts;
use crate::scene::Scene;

/// The polygons of a scene relative to its centre, in its unit.
pub(super) struct ScenePolygons {
    /// Divisor of all lengths: a power of two near the size of the scene, so that dividing does not
    /// round.
    pub unit: f64,
    /// Polygons that emit and receive.
    pub fronts: Fronts,
    /// Blockers, of any group.
    pub blockers: BlockerTree,
    /// Per triangle, the index of the blocker that it is a part of.
    pub blocker_of_triangle: Vec<Option<u32>>,
}

impl ScenePolygons {
    /// The polygons of `scene`. Groups of index `two_sided` have two sides, each a row.
    pub fn new(scene: &Scene, two_sided: &[usize]) -> ScenePolygons {
        let unit = libm::exp2(libm::log2(scene.bounds().longest_side()).floor());
        let fronts = Fronts::new(scene, unit, two_sided);
        let MergedTriangles { polygons, of_triangle: blocker_of_triangle } =
            convex_polygons(scene, unit, Merge::AcrossGroups);
        ScenePolygons { unit, fronts, blockers: BlockerTree::new(polygons), blocker_of_triangle }
    }
}
