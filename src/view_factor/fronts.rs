//! The polygons that emit and receive: those of all groups, and the backs of two-sided ones.

use super::convex_polygons::{ConvexPolygon, Merge, MergedTriangles, convex_polygons};
use crate::scene::Scene;

/// Polygons that emit and receive, by group, and the polygon of each triangle.
pub(super) struct Fronts {
    pub polygons: Vec<ConvexPolygon>,
    /// Radiating area of each group, in squares of the scene's unit.
    pub areas: Vec<f64>,
    /// Per triangle, the index of the polygon that a ray hits on its front, and on its back.
    of_triangle: Vec<[Option<u32>; 2]>,
}

impl Fronts {
    /// The polygons of `scene`, all lengths divided by `unit`. Groups of index `two_sided` have two
    /// sides.
    pub fn new(scene: &Scene, unit: f64, two_sided: &[usize]) -> Fronts {
        let MergedTriangles { polygons, of_triangle } =
            convex_polygons(scene, unit, Merge::WithinGroups);
        let mut is_two_sided = vec![false; scene.groups().len()];
        two_sided.iter().for_each(|&group| is_two_sided[group] = true);
        // Polygon and side of each front; the backs come after the fronts.
        let count = polygons.len();
        let backs = (0..count).filter(|&k| is_two_sided[polygons[k].group as usize]);
        let mut sides: Vec<(usize, usize)> = (0..count).map(|k| (k, 0)).collect();
        sides.extend(backs.map(|k| (k, 1)));
        sides.sort_by_key(|&(k, _)| polygons[k].group);
        let mut numbers = vec![[None; 2]; count];
        let mut areas = vec![0.0; scene.groups().len()];
        let mut fronts = Vec::with_capacity(sides.len());
        for (number, (k, side)) in (0..).zip(sides) {
            let polygon = &polygons[k];
            numbers[k][side] = Some(number);
            areas[polygon.group as usize] += polygon.area;
            fronts.push(if side == 0 { polygon.clone() } else { polygon.reversed() });
        }
        let numbers_of = |k: Option<u32>| k.map_or([None; 2], |k| numbers[k as usize]);
        let of_triangle = of_triangle.into_iter().map(numbers_of).collect();
        Fronts { polygons: fronts, areas, of_triangle }
    }

    /// The index of the polygon hit by a ray on the front of triangle `t`, or on its back.
    pub fn met(&self, t: usize, from_front: bool) -> Option<u32> {
        self.of_triangle[t][usize::from(!from_front)]
    }

    /// The polygons on the front and the back of triangle `t`.
    pub fn both_sides(&self, t: usize) -> [Option<u32>; 2] {
        self.of_triangle[t]
    }

    /// The group of polygon `s`.
    pub fn group(&self, s: u32) -> usize {
        self.polygons[s as usize].group as usize
    }
}
