//! Which corners and sides of scene triangles belong to one smooth surface.
//!
//! Corners at one position are welded; two triangles that share a side between the same two
//! positions continue one another across it, unless the side is a crease:
//!
//! ```text
//!        b                    The surface continues from t to s across side ab if
//!       ╱│╲                   - no third triangle has that side,
//!      ╱ │ ╲                  - t runs along it from a to b, and s from b to a,
//!     ╱ t│s ╲                 - both are of one group and one material, and
//!     ╲  │  ╱                 - their normals differ by at most the crease angle.
//!      ╲ │ ╱                  Then t and s share the side's identity, and the corners at a
//!        a                    and at b.
//! ```
//!
//! A corner's identity is shared by all triangles that are connected across such sides around it,
//! so that one position has a vertex for each smooth surface that meets there.

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
    /// Same for both triangles where the surface continues smoothly, else unique: three times the
    /// first triangle, plus the side's number there.
    pub id: u32,
    /// Whether this triangle runs along it from the higher to the lower of the welded positions.
    pub reversed: bool,
}

/// A triangle, and the number of one of its sides.
type TriangleSide = (usize, usize);

impl SurfaceTopology {
    /// Surfaces that continue by the scene's smoothing groups and by angles: up to
    /// [`Mesh::CREASE_DEGREES`] within one smoothing group or where none is known, else up to
    /// [`Mesh::COPLANAR_DEGREES`].
    pub fn new(scene: &Scene) -> SurfaceTopology {
        SurfaceTopology::with_crease_angle(scene, |a, b| {
            if a.smoothing == b.smoothing && a.smoothing != Some(0) {
                Mesh::CREASE_DEGREES
            } else {
                Mesh::COPLANAR_DEGREES
            }
        })
    }

    /// Surfaces that continue by angles up to [`Mesh::CREASE_DEGREES`] alone.
    pub fn ignoring_smoothing_groups(scene: &Scene) -> SurfaceTopology {
        SurfaceTopology::with_crease_angle(scene, |_, _| Mesh::CREASE_DEGREES)
    }

    /// Surfaces that continue across a shared side if the normals of its two triangles differ by at
    /// most `crease_angle` of both, degrees.
    fn with_crease_angle(
        scene: &Scene,
        crease_angle: impl Fn(&Triangle, &Triangle) -> f64,
    ) -> SurfaceTopology {
        let count = scene.triangles().len();
        let ends = side_ends(scene);
        let mut by_ends: FxHashMap<(u32, u32), Vec<TriangleSide>> = FxHashMap::default();
        for (t, sides) in ends.iter().enumerate() {
            for (k, &(a, b)) in sides.iter().enumerate() {
                by_ends.entry((a.min(b), a.max(b))).or_default().push((t, k));
            }
        }
        let mut sides: Vec<[Side; 3]> = (0..count)
            .map(|t| {
                [0, 1, 2].map(|k| {
                    let (a, b) = ends[t][k];
                    Side { id: (3 * t + k) as u32, reversed: a > b }
                })
            })
            .collect();
        let mut corners = UnionFind::new(3 * count);
        let mut edges = vec![[0; 3]; count];
        // No two of these have a side in common, so that their order does not matter.
        for sharing in by_ends.values() {
            // In the order of the triangles: the first is the lowest.
            let edge = (3 * sharing[0].0 + sharing[0].1) as u32;
            for &(t, k) in sharing {
                edges[t][k] = edge;
            }
            // More than two triangles at a side have no one surface to continue.
            let &[(t, k), (s, l)] = sharing.as_slice() else { continue };
            let opposite = sides[t][k].reversed != sides[s][l].reversed;
            let is_cut = scene.is_cut(t, k) || scene.is_cut(s, l);
            if is_cut || !opposite || !continues(scene, t, s, &crease_angle) {
                continue;
            }
            let id = sides[t][k].id.min(sides[s][l].id);
            sides[t][k].id = id;
            sides[s][l].id = id;
            // Opposite windings: where one side starts, the other ends.
            corners.join(3 * t + k, 3 * s + (l + 1) % 3);
            corners.join(3 * t + (k + 1) % 3, 3 * s + l);
        }
        let corners =
            (0..count).map(|t| [0, 1, 2].map(|k| corners.find(3 * t + k) as u32)).collect();
        SurfaceTopology { corners, sides, edges }
    }

    /// The sides across which the surface continues smoothly to another triangle: each once, as the
    /// two triangles that share it and which of their sides it is.
    pub fn shared_edges(&self) -> impl Iterator<Item = [TriangleSide; 2]> {
        let all = (0..self.sides.len()).flat_map(|t| [(t, 0), (t, 1), (t, 2)]);
        let with_first = all.map(|(t, k)| {
            let id = self.sides[t][k].id as usize;
            [(id / 3, id % 3), (t, k)]
        });
        with_first.filter(|[(s, _), (t, _)]| s != t)
    }

    /// Per triangle, the smooth surface that it is a part of: the number of its first triangle.
    pub fn surfaces(&self) -> Vec<u32> {
        let mut surfaces = UnionFind::new(self.sides.len());
        for [(s, _), (t, _)] in self.shared_edges() {
            surfaces.join(s, t);
        }
        (0..self.sides.len()).map(|t| surfaces.find(t) as u32).collect()
    }
}

/// Per triangle and side, the welded positions that it runs from and to.
fn side_ends(scene: &Scene) -> Vec<[(u32, u32); 3]> {
    let mut weld = Weld::default();
    let ends = |t: usize| {
        let [a, b, c] = scene.corners(t).map(|p| weld.number(p));
        [(a, b), (b, c), (c, a)]
    };
    (0..scene.triangles().len()).map(ends).collect()
}

/// Whether triangles `t` and `s`, which share a side, are of one group and material and differ by
/// no more than the crease angle, degrees.
fn continues(
    scene: &Scene,
    t: usize,
    s: usize,
    crease_angle: impl Fn(&Triangle, &Triangle) -> f64,
) -> bool {
    let (a, b) = (&scene.triangles()[t], &scene.triangles()[s]);
    let min_cosine = crease_angle(a, b).to_radians().cos();
    a.group == b.group
        && a.material == b.material
        && scene.normal(t).dot(scene.normal(s)) >= min_cosine
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
    fn smoothing_groups_override_crease_angle() {
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
    fn angles_alone_decide_where_smoothing_groups_are_ignored() {
        for pair in [SAME.as_slice(), &NOT_THE_SAME].concat() {
            assert_eq!(
                SurfaceTopology::ignoring_smoothing_groups(&fold(20.0, pair)).surfaces(),
                [0, 0],
                "{pair:?}"
            );
            assert_eq!(
                SurfaceTopology::ignoring_smoothing_groups(&fold(60.0, pair)).surfaces(),
                [0, 1],
                "{pair:?}"
            );
        }
    }
}
