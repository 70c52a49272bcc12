//! Triangles that a file gives more than once.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::geometry::weld::Weld;
use crate::scene::{Scene, Sides};

/// Per triangle, whether it is translucent or one of [`Sides::Auto`], with the same three
/// positions, material, group and texture coordinates as one before it.
pub fn repeated_triangles(scene: &Scene) -> Vec<bool> {
    let mut weld = Weld::default();
    let mut known: FxHashMap<([u32; 3], u32, u32), usize> = FxHashMap::default();
    let mut is_repeated = |t: usize| {
        let triangle = &scene.triangles()[t];
        let mut corners = scene.corners(t).map(|p| weld.number(p));
        corners.sort_unstable();
        let first = *known.entry((corners, triangle.material, triangle.group)).or_insert(t);
        let place = |t: usize, p: DVec3| {
            let k = scene.corners(t).iter().position(|&q| q == p);
            k.zip(scene.texture_coordinates(t)).map(|(k, places)| places[k].to_array())
        };
        let same_texture =
            || scene.corners(t).into_iter().all(|p| same(place(t, p), place(first, p)));
        let material = scene.material(t);
        let is_concerned = material.sides == Sides::Auto || material.is_translucent();
        is_concerned && first != t && same_texture()
    };
    (0..scene.triangles().len()).map(&mut is_repeated).collect()
}

/// Whether these are the same, bit by bit: places without texture coordinates are no numbers.
fn same(a: Option<[f64; 2]>, b: Option<[f64; 2]>) -> bool {
    a.map(|a| a.map(f64::to_bits)) == b.map(|b| b.map(f64::to_bits))
}
