//! The polygons that emit and receive: those of all groups, and the backs of two-sided ones.

use super::convex_polygons::{ConvexPolygon, Merge, MergedTriangles, convex_polygons};
use super::matrix_rows::MatrixRows;
use crate::scene::Scene;

/// Polygons that emit and receive, by row of the matrix, and the polygon of each triangle.
pub(super) struct Fronts {
    /// Their groups are rows of the matrix: those of the scene, then the backs of two-sided ones.
    pub polygons: Vec<ConvexPolygon>,
    pub rows: MatrixRows,
    /// Area of each row, in squares of the scene's unit.
    pub areas: Vec<f64>,
    /// Per triangle, the index of the polygon that a ray hits on its front, and on its back.
    of_triangle: Vec<[Option<u32>; 2]>,
}

/// A side of a polygon, and the row of the matrix that it belongs to.
struct Side {
    polygon: usize,
    is_back: bool,
    row: u32,
}

impl Fronts {
    /// The polygons of `scene`, all lengths divided by `unit`. Groups of index `two_sided` have two
    /// sides.
    pub fn new(scene: &Scene, unit: f64, two_sided: &[usize]) -> Fronts {
        let MergedTriangles { polygons, of_triangle } =
            convex_polygons(scene, unit, Merge::WithinGroups);
        let rows = MatrixRows::new(scene.groups(), two_sided);
        let backs = rows.backs();
        let mut sides: Vec<Side> = vec![];
        for (k, polygon) in polygons.iter().enumerate() {
            let row = polygon.group;
            sides.push(Side { polygon: k, is_back: false, row });
            let back = backs[row as usize];
            sides.extend(back.map(|row| Side { polygon: k, is_back: true, row }));
        }
        sides.sort_by_key(|side| side.row);
        let mut numbers = vec![[None; 2]; polygons.len()];
        let mut areas = vec![0.0; rows.count()];
        let mut fronts = Vec::with_capacity(sides.len());
        for (number, Side { polygon: k, is_back, row }) in (0..).zip(sides) {
            let polygon = if is_back { polygons[k].reversed() } else { polygons[k].clone() };
            numbers[k][usize::from(is_back)] = Some(number);
            areas[row as usize] += polygon.area;
            fronts.push(ConvexPolygon { group: row, ..polygon });
        }
        let numbers_of = |k: Option<u32>| k.map_or([None; 2], |k| numbers[k as usize]);
        let of_triangle = of_triangle.into_iter().map(numbers_of).collect();
        Fronts { polygons: fronts, rows, areas, of_triangle }
    }

    /// The index of the polygon hit by a ray on the front of triangle `t`, or on its back.
    pub fn met(&self, t: usize, from_front: bool) -> Option<u32> {
        self.of_triangle[t][usize::from(!from_front)]
    }

    /// The polygons on the front and the back of triangle `t`.
    pub fn both_sides(&self, t: usize) -> [Option<u32>; 2] {
        self.of_triangle[t]
    }

    /// The row of polygon `s`.
    pub fn group(&self, s: u32) -> usize {
        self.polygons[s as usize].group as usize
    }
}
