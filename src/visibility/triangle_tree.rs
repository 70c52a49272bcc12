//! The binary tree over triangles, in 32 bits, from which the ray hierarchies of the CPU and of
//! devices are built.

use glam::DVec3;

use super::ray32::LocalUnit;
use super::sah_tree::{Aabb32, SahTree};
use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

/// A binary tree over the boxes of triangles.
pub(crate) struct TriangleTree {
    /// In the unit of the tree.
    pub tree: SahTree,
    /// Indices of the triangles, in the order of the tree.
    pub triangles: Vec<u32>,
    pub unit: LocalUnit,
}

impl TriangleTree {
    /// The tree of `triangles`, by their indices, with these `corners`, within `bounds`; lengths
    /// are in the scene's unit.
    pub fn new(
        triangles: Vec<u32>,
        corners: impl Fn(usize) -> [DVec3; 3],
        bounds: &Aabb,
    ) -> TriangleTree {
        let unit = LocalUnit::new(bounds);
        let boxes: Vec<Aabb32> =
            triangles.iter().map(|&t| unit.bounds(corners(t as usize))).collect();
        let tree = SahTree::new(&boxes);
        let triangles = tree.order.iter().map(|&k| triangles[k as usize]).collect();
        TriangleTree { tree, triangles, unit }
    }

    /// The tree of the triangles of `scene` for which `is_included` is true.
    pub fn of_scene(scene: &Scene, is_included: impl Fn(usize) -> bool) -> TriangleTree {
        let count = scene.triangles().len() as u32;
        let included = (0..count).filter(|&t| is_included(t as usize)).collect();
        TriangleTree::new(included, |t| scene.corners(t), &scene.bounds())
    }
}
