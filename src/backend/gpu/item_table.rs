//! Maps the item of a pixel to the slot of the row that it counts for.

use super::layout::{BACK, FIRST_FRONT, OPEN, TriangleCells};
use crate::mesh::Mesh;

/// Every triangle as a lattice of the finest cells in its quadtree. A pixel's item is OPEN, BACK or
/// a cell; only this table maps cells to elements, of whatever depths.
pub struct ItemTable {
    /// First item of each triangle, and number of cells along its edge.
    pub triangles: Vec<TriangleCells>,
    /// The row slot of each item.
    pub slots: Vec<u32>,
}

impl ItemTable {
    /// Number of items for `mesh`; known before the table is made.
    pub fn count(mesh: &Mesh) -> u64 {
        let triangles = 0..mesh.scene().triangles().len();
        u64::from(FIRST_FRONT) + triangles.map(|t| 1 << (2 * mesh.depth(t))).sum::<u64>()
    }

    /// The table for `mesh`.
    pub fn new(mesh: &Mesh) -> ItemTable {
        let mut slots = vec![OPEN, BACK];
        let mut triangles = vec![];
        for t in 0..mesh.scene().triangles().len() {
            let (first, depth) = (slots.len(), mesh.depth(t));
            triangles.push(TriangleCells { first: first as u32, side: 1 << depth });
            slots.resize(first + (1 << (2 * depth)), OPEN);
            for e in mesh.elements_of(mesh.root(t)) {
                let cell = mesh.cell(mesh.element(e));
                cell.for_each_descendant(depth, &mut |c| {
                    slots[first + c.index() as usize] = FIRST_FRONT + e as u32;
                });
            }
        }
        ItemTable { triangles, slots }
    }
}
