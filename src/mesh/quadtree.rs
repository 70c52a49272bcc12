//! One cell of a triangle's quadtree: its position, corners, children and parent.

use serde::{Deserialize, Serialize};

/// A cell of the midpoint subdivision of a triangle.
///
/// At level `l` the triangle is a lattice of 2ˡ steps along its barycentric axes u and v (weights
/// of the second and third corner). An upright cell has the corners (i, j), (i+1, j), (i, j+1); a
/// flipped one (i+1, j+1), (i, j+1), (i+1, j). Both wind like the triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub(crate) struct Cell {
    pub level: u32,
    pub i: u32,
    pub j: u32,
    pub flipped: bool,
}

impl Cell {
    pub const ROOT: Cell = Cell { level: 0, i: 0, j: 0, flipped: false };

    /// Corners on the lattice of this level, as (i, j).
    pub fn lattice_corners(self) -> [[u32; 2]; 3] {
        let Cell { i, j, flipped, .. } = self;
        match flipped {
            false => [[i, j], [i + 1, j], [i, j + 1]],
            true => [[i + 1, j + 1], [i, j + 1], [i + 1, j]],
        }
    }

    /// Corners as barycentric (u, v), exact.
    pub fn corners(self) -> [[f64; 2]; 3] {
        let step = 1.0 / f64::from(1u32 << self.level);
        self.lattice_corners().map(|c| c.map(|k| f64::from(k) * step))
    }

    /// The four cells of the next level: one at each corner, then the middle one.
    pub fn children(self) -> [Cell; 4] {
        let (level, i, j) = (self.level + 1, 2 * self.i, 2 * self.j);
        let cell = |i, j, flipped| Cell { level, i, j, flipped };
        match self.flipped {
            false => {
                [cell(i, j, false), cell(i + 1, j, false), cell(i, j + 1, false), cell(i, j, true)]
            }
            true => [
                cell(i + 1, j + 1, true),
                cell(i, j + 1, true),
                cell(i + 1, j, true),
                cell(i + 1, j + 1, false),
            ],
        }
    }

    /// Calls `f` with every cell of `level` (not above this one) that lies in this one.
    pub fn for_each_descendant(self, level: u32, f: &mut impl FnMut(Cell)) {
        match self.level == level {
            true => f(self),
            false => self.children().into_iter().for_each(|c| c.for_each_descendant(level, f)),
        }
    }

    /// Barycentric position in this cell (weights of its second and third corner) of (u, v) in the
    /// triangle.
    pub fn local(self, u: f64, v: f64) -> [f64; 2] {
        let side = f64::from(1u32 << self.level);
        let [[i, j], ..] = self.lattice_corners();
        let (u, v) = (u * side - f64::from(i), v * side - f64::from(j));
        if self.flipped { [-u, -v] } else { [u, v] }
    }

    /// The inverse of [`Cell::local`]: the position in the triangle of (u, v) in this cell.
    pub fn in_triangle(self, [u, v]: [f64; 2]) -> [f64; 2] {
        let side = f64::from(1u32 << self.level);
        let [[i, j], ..] = self.lattice_corners();
        let [u, v] = if self.flipped { [-u, -v] } else { [u, v] };
        [(f64::from(i) + u) / side, (f64::from(j) + v) / side]
    }

    /// Number of this cell among the 4ˡ of its level, row by row (`i` first). The item-buffer
    /// shader computes the same number.
    pub fn index(self) -> u32 {
        let side = 1u32 << self.level;
        self.i * (2 * side - self.i) + 2 * self.j + u32::from(self.flipped)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All cells of a level, by descent from the root.
    fn level(l: u32) -> Vec<Cell> {
        (0..l)
            .fold(vec![Cell::ROOT], |cells, _| cells.into_iter().flat_map(Cell::children).collect())
    }

    fn signed_area(c: Cell) -> f64 {
        let [a, b, d] = c.corners();
        (b[0] - a[0]) * (d[1] - a[1]) - (d[0] - a[0]) * (b[1] - a[1])
    }

    #[test]
    fn children_tile_their_parent_and_keep_its_winding() {
        for l in 0..5 {
            for parent in level(l) {
                let children = parent.children();
                for child in children {
                    // Lattice coordinates are exact: four equal parts, wound like the root.
                    assert_eq!(signed_area(child) * 4.0, signed_area(parent));
                    assert!(signed_area(child) > 0.0);
                }
                let corners = parent.corners();
                for k in 0..3 {
                    let [a, b] = [1, 2].map(|step| corners[(k + step) % 3]);
                    let opposite = [0, 1].map(|axis| (a[axis] + b[axis]) / 2.0);
                    assert_eq!(children[k].corners()[k], corners[k]);
                    assert_eq!(children[3].corners()[k], opposite);
                }
            }
        }
    }

    #[test]
    fn places_in_a_cell_are_found_in_the_triangle() {
        for cell in level(3) {
            let [a, b, c] = cell.corners();
            for (at, corner) in [([0.0, 0.0], a), ([1.0, 0.0], b), ([0.0, 1.0], c)] {
                assert_eq!(cell.in_triangle(at), corner);
            }
            let [u, v] = cell.in_triangle([0.25, 0.125]);
            assert_eq!(cell.local(u, v), [0.25, 0.125]);
        }
    }

    #[test]
    fn indices_number_a_level_without_gaps() {
        for l in 0..6 {
            let mut indices: Vec<u32> = level(l).into_iter().map(Cell::index).collect();
            indices.sort();
            assert_eq!(indices, (0..4u32.pow(l)).collect::<Vec<_>>());
        }
    }
}
