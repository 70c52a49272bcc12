//! Which corners and sides of scene triangles belong to one smooth surface.

use rustc_hash::FxHashMap;

use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::Weld;
use crate::mesh::Mesh;
use crate::scene::{Scene, Triangle};

/// Identities shared across a smooth surface: one object or group, one material, no crease.
#[derive(Clone)]
pub(crate) struct SurfaceTopology {
    /// Per triangle, the identity of each corner.
    pub corners: Vec<[u32; 3]>,
    /// Per triangle, the sides from corner k to corner k+1.
    pub sides: Vec<[Side; 3]>,
    /// Per triangle, the edge of the scene that each side lies on: the same for all triangles with
    /// sides between the same two positions, creases or not.
    pub edges: Vec<[u32; 3]>,
}

/// A side of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Side {
    /// Same for both triangles where the surface goes on smoothly, else unique.
    pub id: u32,
    /// Whether this triangle runs along it against its own direction.
    pub reversed: bool,
}

impl SurfaceTopology {
    /// What goes on smoothly by the scene's smoothing groups and by angles.
    pub fn new(scene: &Scene) -> SurfaceTopology {
        let together =
            |a: &Triangle, b: &Triangle| a.smoothing == b.smoothing && a.smoothing != Some(0);
        SurfaceTopology::up_to(scene, |a, b| {
            if together(a, b) { Mesh::CREASE_DEGREES } else { Mesh::COPLANAR_DEGREES }
        })
    }

    /// What would go on smoothly if nothing were known of smoothing groups.
    pub fn by_angle(scene: &Scene) -> SurfaceTopology {
        SurfaceTopology::up_to(scene, |_, _| Mesh::CREASE_DEGREES)
    }

    /// What goes on smoothly where two neighbours' normals may differ by as many degrees as `most`
    /// says.
    fn up_to(scene: &Scene, most: impl Fn(&Triangle, &Triangle) -> f64) -> SurfaceTopology {
        let count = scene.triangles().len();
        let mut weld = Weld::default();
        let welded: Vec<[u32; 3]> =
            (0..count).map(|t| scene.corners(t).map(|p| weld.number(p))).collect();
        let mut by_ends: FxHashMap<(u32, u32), Vec<(usize, usize)>> = FxHashMap::default();
        let ends = |t: usize, k: usize| (welded[t][k], welded[t][(k + 1) % 3]);
        for t in 0..count {
            for k in 0..3 {
                let (a, b) = ends(t, k);
                by_ends.entry((a.min(b), a.max(b))).or_default().push((t, k));
            }
        }
        let own = |t: usize, k: usize| {
            let (a, b) = ends(t, k);
            Side { id: (3 * t + k) as u32, reversed: a > b }
        };
        let mut sides: Vec<[Side; 3]> = (0..count).map(|t| [0, 1, 2].map(|k| own(t, k))).collect();
        let mut joined = UnionFind::new(3 * count);
        let mut edges = vec![[0; 3]; count];
        for pair in by_ends.values() {
            // In the order of the triangles: the first is the lowest.
            pair.iter().for_each(|&(t, k)| edges[t][k] = (3 * pair[0].0 + pair[0].1) as u32);
            // More than two triangles at a side have no one surface to continue.
            let &[(t, k), (s, l)] = pair.as_slice() else { continue };
            let opposite = sides[t][k].reversed != sides[s][l].reversed;
            let (a, b) = (&scene.triangles()[t], &scene.triangles()[s]);
            let alike = a.group == b.group && a.material == b.material;
            let least = most(a, b).to_radians().cos();
            if !opposite || !alike || scene.normal(t).dot(scene.normal(s)) < least {
                continue;
            }
            let id = sides[t][k].id.min(sides[s][l].id);
            (sides[t][k].id, sides[s][l].id) = (id, id);
            // Opposite windings: where one side starts, the other ends.
            joined.join(3 * t + k, 3 * s + (l + 1) % 3);
            joined.join(3 * t + (k + 1) % 3, 3 * s + l);
        }
        let corners =
            (0..count).map(|t| [0, 1, 2].map(|k| joined.find(3 * t + k) as u32)).collect();
        SurfaceTopology { corners, sides, edges }
    }

    /// The sides across which the surface goes on smoothly to another triangle: each once, as the two
    /// triangles that share it and which of their sides it is.
    pub fn joins(&self) -> impl Iterator<Item = [(usize, usize); 2]> {
        let all = (0..self.sides.len()).flat_map(|t| [(t, 0), (t, 1), (t, 2)]);
        // A side's identity is its place with the first of the triangles that share it.
        let shared = all.map(|(t, k)| {
            let id = self.sides[t][k].id as usize;
            [(id / 3, id % 3), (t, k)]
        });
        shared.filter(|[(s, _), (t, _)]| s != t)
    }

    /// Per triangle, the smooth surface that it is a part of: the number of its first triangle.
    pub fn surfaces(&self) -> Vec<u32> {
        let mut joined = UnionFind::new(self.sides.len());
        self.joins().for_each(|[(s, _), (t, _)]| joined.join(s, t));
        (0..self.sides.len()).map(|t| joined.find(t) as u32).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Material;

    /// Two triangles of these smoothing groups, folded along their shared side.
    fn fold(degrees: f64, smoothing: [Option<u32>; 2]) -> Scene {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let points = [[0., 0., 0.], [0., 1., 0.], [-1., 0., 0.], [cos, 0., sin]];
        let triangle = |corners, smoothing| Triangle { corners, smoothing, ..Default::default() };
        let triangles = vec![triangle([0, 1, 2], smoothing[0]), triangle([1, 0, 3], smoothing[1])];
        let (points, material) = (points.map(DVec3::from_array), Material::grey("m", 0.5));
        Scene::new(points.to_vec(), triangles, vec!["g".into()], vec![material]).unwrap()
    }

    const SAME: [[Option<u32>; 2]; 2] = [[None, None], [Some(3), Some(3)]];
    const NOT_THE_SAME: [[Option<u32>; 2]; 4] =
        [[Some(0), Some(0)], [Some(3), Some(4)], [Some(3), Some(0)], [Some(3), None]];

    #[test]
    fn smoothing_groups_part_what_is_not_flat_and_join_what_is_not_sharp() {
        for (degrees, same, others) in [
            (0.0, true, true),
            (Mesh::COPLANAR_DEGREES - 0.1, true, true),
            (Mesh::COPLANAR_DEGREES + 0.1, true, false),
            (20.0, true, false),
            (Mesh::CREASE_DEGREES - 0.1, true, false),
            (Mesh::CREASE_DEGREES + 0.1, false, false),
            (60.0, false, false),
        ] {
            for (pairs, joined) in [(&SAME[..], same), (&NOT_THE_SAME[..], others)] {
                for &pair in pairs {
                    let surfaces = SurfaceTopology::new(&fold(degrees, pair)).surfaces();
                    assert_eq!(surfaces == [0, 0], joined, "{pair:?} at {degrees}°");
                }
            }
        }
    }

    #[test]
    fn by_angle_no_smoothing_group_counts() {
        for pair in [SAME.as_slice(), &NOT_THE_SAME].concat() {
            assert_eq!(SurfaceTopology::by_angle(&fold(20.0, pair)).surfaces(), [0, 0], "{pair:?}");
            assert_eq!(SurfaceTopology::by_angle(&fold(60.0, pair)).surfaces(), [0, 1], "{pair:?}");
        }
    }
}
