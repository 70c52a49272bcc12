//! A scene as convex polygons: those that give and receive, and those that stand in the way.

use super::blocker_tree::BlockerTree;
use super::convex_polygons::{Merge, MergedTriangles, convex_polygons};
use super::fronts::Fronts;
use crate::scene::Scene;

/// The polygons of a scene around its middle, in its unit.
pub(super) struct ScenePolygons {
    /// What every length is divided by: a power of two near the size of the scene, so that dividing
    /// does not round.
    pub unit: f64,
    /// Those that give and receive.
    pub fronts: Fronts,
    /// Those that stand in the way, of any group.
    pub blockers: BlockerTree,
    /// Per triangle, the index of the blocker that it is a part of.
    pub blocker_of_triangle: Vec<Option<u32>>,
}

impl ScenePolygons {
    /// Those of `scene`. Groups of index `two_sided` have two fronts.
    pub fn new(scene: &Scene, two_sided: &[usize]) -> ScenePolygons {
        let unit = scene.bounds().longest_side().log2().floor().exp2();
        let fronts = Fronts::new(scene, unit, two_sided);
        let MergedTriangles { polygons, of_triangle: blocker_of_triangle } =
            convex_polygons(scene, unit, Merge::AcrossGroups);
        ScenePolygons { unit, fronts, blockers: BlockerTree::new(polygons), blocker_of_triangle }
    }
}
