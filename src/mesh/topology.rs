//! Corners and sides of scene triangles that belong to one smooth surface.
//!
//! Corners at one position are welded; two triangles that share a side between the same two
//! positions continue one another across it, unless the side is a crease:
//!
//! ```text
//!        b                    The surface continues from t to s across side ab if
//!       ╱│╲                   - both look into one wedge of space around it, with no third
//!      ╱ │ ╲                    triangle in between,
//!     ╱ t│s ╲                 - both are of one group and one material, and
//!     ╲  │  ╱                 - their normals differ by at most the crease angle.
//!      ╲ │ ╱                  Then t and s share the side's identity, and the corners at a
//!        a                    and at b.
//! ```
//!
//! Of two triangles t runs along the side from a to b then, and s from b to a. If more share the
//! side, each is adjacent to at most one, by the order of their angles around the side: of a plate
//! with triangles for both sides, the triangles of either side continue one another.
//!
//! ```text
//!                     the front of
//!          front      │ t, seen along the side, looks to larger angles; that of
//!     ──t────┐ ┌────s─┤ s to smaller ones, and s is the next after t
//!     ──u────┘ └────v─┤
//!          front      │ likewise v and u: the next after v, all around
//! ```
//!
//! A corner's identity is shared by all triangles connected across such sides around it, so that
//! one position has a vertex for each smooth surface there.

use std::f64::consts::TAU;
use std::sync::Arc;

use rayon::prelude::*;

use crate::geometry::FILE_TOLERANCE;
use crate::geometry::union_find::UnionFind;
use crate::mesh::Mesh;
use crate::scene::{HalfEdge, Scene, Triangle};

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
    /// The topology of [`SurfaceTopology::new`], computed once for a scene.
    pub fn of_scene(scene: &Scene) -> Arc<SurfaceTopology> {
        scene.derived(SurfaceTopology::new)
    }

    /// Surfaces that continue by the scene's smoothing groups and by angles: up to
    /// [`Mesh::CREASE_DEGREES`] within one smoothing group, up to [`Scene::crease_degrees`] if none
    /// is known, else up to [`Mesh::COPLANAR_DEGREES`].
    pub fn new(scene: &Scene) -> SurfaceTopology {
        SurfaceTopology::with_crease_angle(scene, |a, b| match (a.smoothing, b.smoothing) {
            (None, None) => scene.crease_degrees().unwrap_or(Mesh::CREASE_DEGREES),
            (Some(a), Some(b)) if a == b && a != 0 => Mesh::CREASE_DEGREES,
            _ => Mesh::COPLANAR_DEGREES,
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
        crease_angle: impl Fn(&Triangle, &Triangle) -> f64 + Sync,
    ) -> SurfaceTopology {
        let count = scene.triangles().len();
        let half_edges = scene.half_edges();
        let mut sides = vec![[Side { id: 0, reversed: false }; 3]; count];
        let mut edges = vec![[0; 3]; count];
        for sharing in half_edges.chunk_by(HalfEdge::has_ends_of) {
            for &HalfEdge { triangle: t, corner: k, reversed, .. } in sharing {
                sides[t][k] = Side { id: (3 * t + k) as u32, reversed };
                edges[t][k] = (3 * sharing[0].triangle + sharing[0].corner) as u32;
            }
        }
        let continued = |sharing: &[HalfEdge]| {
            let mut pairs = facing_pairs(scene, sharing);
            pairs.retain(|&[(t, k), (s, l)]| {
                let is_cut = scene.is_cut(t, k) || scene.is_cut(s, l);
                !is_cut && continues(scene, t, s, &crease_angle)
            });
            pairs
        };
        let pairs: Vec<[TriangleSide; 2]> =
            half_edges.par_chunk_by(HalfEdge::has_ends_of).flat_map_iter(continued).collect();
        let mut corners = UnionFind::new(3 * count);
        // No two of these share a side.
        for [(t, k), (s, l)] in pairs {
            let id = sides[t][k].id.min(sides[s][l].id);
            sides[t][k].id = id;
            sides[s][l].id = id;
            // Opposite windings: the start of one side is the end of the other.
            corners.join(3 * t + k, 3 * s + (l + 1) % 3);
            corners.join(3 * t + (k + 1) % 3, 3 * s + l);
        }
        let corners =
            (0..count).map(|t| [0, 1, 2].map(|k| corners.find(3 * t + k) as u32)).collect();
        SurfaceTopology { corners, sides, edges }
    }

    /// The sides across which the surface continues smoothly to another triangle: each once, as the
    /// two triangles that share it and the index of the side in each.
    pub fn shared_edges(&self) -> impl Iterator<Item = [TriangleSide; 2]> {
        let all = (0..self.sides.len()).flat_map(|t| [(t, 0), (t, 1), (t, 2)]);
        let with_first = all.map(|(t, k)| {
            let id = self.sides[t][k].id as usize;
            [(id / 3, id % 3), (t, k)]
        });
        with_first.filter(|[(s, _), (t, _)]| s != t)
    }

    /// Per triangle, its smooth surface: the number of that surface's first triangle.
    pub fn surfaces(&self) -> Vec<u32> {
        let mut surfaces = UnionFind::new(self.sides.len());
        for [(s, _), (t, _)] in self.shared_edges() {
            surfaces.join(s, t);
        }
        (0..self.sides.len()).map(|t| surfaces.find(t) as u32).collect()
    }
}

/// Of triangles with sides between the same two positions, those whose fronts look into one wedge
/// of space with no other triangle in between: the first to larger angles around the side, the
/// second to smaller ones. Each is in one pair at most.
fn facing_pairs(scene: &Scene, sharing: &[HalfEdge]) -> Vec<[TriangleSide; 2]> {
    let side = |edge: &HalfEdge| (edge.triangle, edge.corner);
    if let [t, s] = sharing {
        // For two the order is irrelevant.
        return if t.reversed == s.reversed { vec![] } else { vec![[side(t), side(s)]] };
    }
    let mut around = by_angle(scene, sharing);
    // Of coincident ones, those that face smaller angles come before those that face larger ones.
    let mut start = 0;
    for end in 1..=around.len() {
        if end == around.len() || around[end].0 - around[end - 1].0 > FILE_TOLERANCE {
            around[start..end].sort_by_key(|(_, edge)| (!edge.reversed, side(edge)));
            start = end;
        }
    }
    let next = around.iter().cycle().skip(1);
    let pairs = around.iter().zip(next).filter(|((_, t), (_, s))| !t.reversed && s.reversed);
    pairs.map(|((_, t), (_, s))| [side(t), side(s)]).collect()
}

/// Triangles with sides between the same two positions, sorted by their angles around the side,
/// radians, from the first.
fn by_angle<'a>(scene: &Scene, sharing: &'a [HalfEdge]) -> Vec<(f64, &'a HalfEdge)> {
    // Within the triangle and at right angles to the side, along the same direction for all.
    let across = |edge: &HalfEdge| {
        let (corners, k) = (scene.corners(edge.triangle), edge.corner);
        let (a, b, c) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let along = if edge.reversed { a - b } else { b - a };
        let along = along.normalize();
        (along, (c - a).reject_from_normalized(along))
    };
    let Some(first) = sharing.first() else { return vec![] };
    let (axis, zero) = across(first);
    let quarter = axis.cross(zero);
    let angle = |edge: &HalfEdge| {
        let (_, out) = across(edge);
        // Triangles that coincide with the first have about its angle, on both sides of 0.
        let angle = libm::atan2(out.dot(quarter), out.dot(zero));
        if angle < -FILE_TOLERANCE { angle + TAU } else { angle }
    };
    let mut around: Vec<_> = sharing.iter().map(|edge| (angle(edge), edge)).collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    around
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
    let min_cosine = libm::cos(crease_angle(a, b).to_radians());
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

    /// Triangles at the side from the origin to +z, given by the angle at which each lies around
    /// it, degrees, and whether its front looks to larger angles.
    fn fan(sheets: &[(f64, bool)]) -> Vec<u32> {
        let mut points = vec![DVec3::ZERO, DVec3::Z];
        let mut triangles = vec![];
        for (k, &(degrees, forward)) in sheets.iter().enumerate() {
            let (sin, cos) = f64::to_radians(degrees).sin_cos();
            // At another height each: coincident, but with other corners.
            points.push(DVec3::new(cos, sin, 0.1 + 0.2 * k as f64));
            let corner = k as u32 + 2;
            let corners = if forward { [0, 1, corner] } else { [1, 0, corner] };
            triangles.push(Triangle { corners, ..Default::default() });
        }
        // Another one that has only the origin: sides then run from it to +z, whichever is first.
        let count = points.len() as u32;
        points.extend([DVec3::new(7.0, 0.0, -1.0), DVec3::new(0.0, 7.0, -1.0)]);
        triangles.insert(0, Triangle { corners: [0, count, count + 1], ..Default::default() });
        let material = Material::grey("m", 0.5);
        let scene = Scene::new(points, triangles, vec!["g".into()], vec![material]).unwrap();
        SurfaceTopology::new(&scene).surfaces().split_off(1)
    }

    #[test]
    fn each_side_of_a_plate_continues_by_itself() {
        // Every order of the four, of both sides of a plate that is bent by 10°: the two that face
        // the wedge of 170° are joined, and so are those that face the one of 190°.
        let [t, s, u, v] = [(0.0, true), (170.0, false), (0.0, false), (170.0, true)];
        let sheets = [t, s, u, v];
        // One of a coincident pair is off by the precision of six digits, to either side.
        for (turn, off) in [(0.0, 1e-4), (45.0, -1e-4), (100.0, 1e-4), (-90.0, -1e-4)] {
            for order in 0..24 {
                let mut left = vec![0, 1, 2, 3];
                let picks = [order / 6, order % 6 / 2, order % 2, 0];
                let order = picks.map(|k| left.remove(k));
                let turned = |k: usize| (sheets[k].0 + turn + off * (k / 2) as f64, sheets[k].1);
                let surfaces = fan(&order.map(turned));
                let surface_of = |k| surfaces[order.iter().position(|&o| o == k).unwrap()];
                assert_eq!(surface_of(0), surface_of(1), "{order:?}");
                assert_eq!(surface_of(2), surface_of(3), "{order:?}");
                assert_ne!(surface_of(0), surface_of(2), "{order:?}");
            }
        }
    }

    #[test]
    fn what_stands_on_a_plate_parts_the_side_it_stands_on() {
        // A plate for both sides with a third sheet that stands on its upper side.
        let plate = [(0.0, true), (170.0, false), (0.0, false), (170.0, true)];
        for post in [true, false] {
            let surfaces = fan(&[&plate[..], &[(85.0, post)]].concat());
            assert_ne!(surfaces[0], surfaces[1]);
            assert_eq!(surfaces[2], surfaces[3]);
        }
        // Two boxes that touch along a side: each keeps its own crease, and nothing is joined.
        let boxes = [(0.0, true), (90.0, false), (180.0, true), (270.0, false)];
        assert_eq!(fan(&boxes), [1, 2, 3, 4]);
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
    fn a_chosen_angle_holds_where_no_smoothing_group_is_known() {
        let surfaces = |degrees, smoothing| {
            let scene = fold(degrees, [smoothing; 2]).with_crease_degrees(10.0);
            SurfaceTopology::new(&scene).surfaces()
        };
        assert_eq!(surfaces(9.9, None), [0, 0]);
        assert_eq!(surfaces(10.1, None), [0, 1]);
        assert_eq!(surfaces(10.1, Some(1)), [0, 0]);
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
