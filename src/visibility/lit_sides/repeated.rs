//! Duplicate triangles of a file.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::geometry::weld::Weld;
use crate::scene::{Rgb, Scene, Sides};

/// Per triangle, whether it is translucent or one of [`Sides::Auto`], with the same three
/// positions, material, group and texture coordinates as an earlier one; and the same winding, if
/// it emits.
pub fn repeated_triangles(scene: &Scene) -> Vec<bool> {
    let welded = scene.welded_corners();
    let mut known: FxHashMap<_, usize> = FxHashMap::default();
    let mut is_repeated = |t: usize| {
        let triangle = &scene.triangles()[t];
        let (corners, winding) = sorted(welded.corners[t]);
        let winding = (scene.exitance(t) != Rgb::ZERO).then_some(winding);
        let key = (corners, winding, triangle.material, triangle.group);
        let first = *known.entry(key).or_insert(t);
        let point = |t: usize, p: DVec3| {
            let k = scene.corners(t).iter().position(|&q| q == p);
            k.zip(scene.texture_coordinates(t)).map(|(k, points)| points[k].to_array())
        };
        let same_texture =
            || scene.corners(t).into_iter().all(|p| same(point(t, p), point(first, p)));
        let material = scene.material(t);
        let is_concerned = material.sides == Sides::Auto || material.is_translucent();
        is_concerned && first != t && same_texture()
    };
    (0..scene.triangles().len()).map(&mut is_repeated).collect()
}

/// For each of `lamps`, the first other one with the same corners in the opposite winding, if any.
pub fn lamps_of_other_sides(scene: &Scene, lamps: &[usize]) -> FxHashMap<usize, usize> {
    let mut weld = Weld::default();
    let mut key = |&t: &usize| (t, sorted(scene.corners(t).map(|p| weld.number(p))));
    let keys: Vec<_> = lamps.iter().map(&mut key).collect();
    let mut first: FxHashMap<([u32; 3], bool), usize> = FxHashMap::default();
    for (t, key) in &keys {
        first.entry(*key).or_insert(*t);
    }
    let other = |(t, (corners, ascends)): (usize, ([u32; 3], bool))| {
        Some((t, *first.get(&(corners, !ascends))?))
    };
    keys.into_iter().filter_map(other).collect()
}

/// Three different numbers in ascending order, and whether they were given in that cyclic order.
fn sorted(mut corners: [u32; 3]) -> ([u32; 3], bool) {
    let [a, b, c] = corners;
    // Of the three steps around, two ascend in ascending order, and one in descending.
    let ascends = !((a < b) ^ (b < c) ^ (c < a));
    corners.sort_unstable();
    (corners, ascends)
}

/// Whether both are equal bit by bit; missing texture coordinates are NaN.
fn same(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> bool {
    a.map(|a| a.map(f64::to_bits)) == b.map(|b| b.map(f64::to_bits))
}
