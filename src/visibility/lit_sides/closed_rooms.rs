//! Rooms: closed surfaces around all of a scene that look inwards.

use rustc_hash::FxHashMap;

use crate::geometry::aabb::Aabb;
use crate::geometry::union_find::UnionFind;
use crate::scene::{HalfEdge, Scene};

/// Per triangle of `scene`, whether it belongs to a surface that is closed, consistently wound with
/// its fronts inwards, and as large as the scene. Light from outside does not matter in there: the
/// walls of a room without a lamp are dark; it is not a body in the open that is wound inside out.
pub fn closed_rooms(scene: &Scene) -> Vec<bool> {
    let count = scene.triangles().len();
    let (mut surfaces, mut is_open) = (UnionFind::new(count), vec![false; count]);
    for sharing in scene.half_edges().chunk_by(HalfEdge::has_ends_of) {
        match sharing {
            [a, b] if a.reversed != b.reversed => surfaces.join(a.triangle, b.triangle),
            others => others.iter().for_each(|edge| is_open[edge.triangle] = true),
        }
    }
    let mut of_surfaces: FxHashMap<usize, Surface> = FxHashMap::default();
    let centre = scene.bounds().centre();
    for (t, &is_open) in is_open.iter().enumerate() {
        let surface = of_surfaces.entry(surfaces.find(t)).or_default();
        let [a, b, c] = scene.corners(t).map(|p| p - centre);
        surface.volume += a.dot(b.cross(c));
        surface.is_open |= is_open;
        surface.triangles.push(t);
    }
    let mut is_room = vec![false; count];
    for surface in of_surfaces.values().filter(|surface| !surface.is_open && surface.volume < 0.0) {
        let corners = surface.triangles.iter().flat_map(|&t| scene.corners(t));
        if Aabb::from_points(corners) == scene.bounds() {
            surface.triangles.iter().for_each(|&t| is_room[t] = true);
        }
    }
    is_room
}

/// Connected triangles.
#[derive(Default)]
struct Surface {
    triangles: Vec<usize>,
    /// Whether it has an edge that is not shared by exactly two consistently wound triangles.
    is_open: bool,
    /// Six times the enclosed volume, if it is closed: negative where fronts face inwards.
    volume: f64,
}
