//! Triangles cut along the lines where others touch or cross them, so that no element lies on both
//! sides of a wall (Baum, Mann, Smith and Winget, "Making radiosity usable", 1991; the
//! discontinuities of order zero of Heckbert, "Discontinuity meshing for radiosity", 1992).
//!
//! ```text
//!   ┌─────────────┐        ┌─────────────┐     The foot of a wall is a contact segment on the
//!   │      ┃      │        │╲   ╱┃╲   ╱ ╱│     floor. A constrained Delaunay triangulation has it
//!   │      ┃ wall │   ─►   │ ╲ ╱ ┃ ╲ ╱ ╱ │     as sides of triangles, and the surface does not
//!   │      ┃      │        │  ╳──●──╳ ╱  │     continue across these: light may be another on
//!   └─────────────┘        └─────────────┘     each side. Around its end it does.
//! ```
//!
//! Irradiance drops from full to none at such a line, and a dark point that is interpolated with
//! the light beside it is off by many times its own value: where objects penetrate one another, a
//! strip of nearly no area makes most of the error, and no element is small enough. So cuts are
//! made along nearly every line with light on both its sides, or a slit on one: see [`openness`].
//! Points nearer than [`SNAP_DISTANCE`] are merged: see [`snapping`].

mod crossings;
mod openness;
mod snapping;
mod triangulation;

use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::box_overlap::overlapping_pairs;
use super::contacts::{TrianglePlane, outer_edges};
use super::{Cell, Mesh, Side, SurfaceTopology};
use crate::geometry::aabb::Aabb;
use crate::scene::{Piece, Scene, longest_edge};
use crate::work;
use openness::Openness;
use snapping::{Cuts, STEPS, Snapping};
use triangulation::CutTriangle;

/// Length of the shortest cuts, in units of the finest edge. A bake for 10 % of a room full of
/// penetrating objects had an error of 84 ± 6 % with cuts down to 4 finest edges, and of 21 ± 5 %
/// with these.
const SHORTEST_CUT: f64 = 0.02;

/// Distance from a triangle's plane below which another triangle touches it, in units of the
/// shortest cut: a slit as narrow transmits almost no light. Plain choice.
const CONTACT_DISTANCE: f64 = 0.05;

/// Distance below which points are merged, in units of the shortest cut: pieces need not be
/// thinner. Plain choice.
const SNAP_DISTANCE: f64 = 0.02;

/// `scene` with its reflecting triangles cut where others touch them, for elements with edges down
/// to `finest` (scene unit); unchanged if none are touched, or if the pieces were more than about
/// `most`.
pub(crate) fn cut_at_contacts(scene: &Arc<Scene>, finest: f64, most: usize) -> Arc<Scene> {
    let topology = SurfaceTopology::of_scene(scene);
    let mut cuts = find_cuts(scene, &topology, finest);
    let segments: usize = cuts.iter().map(|cuts| cuts.segments.len()).sum();
    // Each makes some four pieces, and a mesh that fine resolves few of 2^17.
    if segments == 0 || segments > (most / 4).min(1 << 17) {
        return scene.clone();
    }
    share_side_points(&topology, &mut cuts);
    let cut = |(t, cuts): (usize, &Cuts)| {
        CutTriangle { corners: scene.corners(t), sides: topology.sides[t], finest }.pieces(cuts)
    };
    let pieces: Vec<Vec<Piece>> = cuts.par_iter().enumerate().map(cut).collect();
    Arc::new(scene.cut(pieces))
}

impl Mesh {
    /// The same mesh with elements longer than `finest` (scene unit) split further, `levels` times,
    /// if they have a corner on a cut: shadows begin there.
    pub(crate) fn split_beside_cuts(&self, levels: u32, finest: f64) -> Mesh {
        let scene = self.scene();
        let touches = |t: usize, cell: Cell| {
            let steps = 1 << cell.level;
            let on_side = |k: usize, [i, j]: [u32; 2]| [j == 0, i + j == steps, i == 0][k];
            let corners = cell.lattice_corners();
            (0..3).any(|k| scene.is_cut(t, k) && corners.iter().any(|&corner| on_side(k, corner)))
        };
        let length =
            |t: usize, cell: Cell| longest_edge(scene.corners(t)) / f64::from(1 << cell.level);
        Mesh::refined_where(self.scene.clone(), |t, cell| {
            let level = self.level_at(t, cell);
            let deepest = (level + levels).min(Mesh::MAX_DEPTH);
            cell.level < level
                || cell.level < deepest && length(t, cell) > finest && touches(t, cell)
        })
    }
}

/// The contact segments on each triangle to be cut.
fn find_cuts(scene: &Scene, topology: &SurfaceTopology, finest: f64) -> Vec<Cuts> {
    let shortest = SHORTEST_CUT * finest;
    let count = scene.triangles().len();
    let tolerance = CONTACT_DISTANCE * shortest;
    let boxes: Vec<Aabb> =
        (0..count).map(|t| Aabb::from_points(scene.corners(t)).expanded(tolerance / 2.0)).collect();
    let nearby = overlapping_pairs(&boxes, |t| scene.area(t));
    let outer = outer_edges(scene, topology);
    let neighbours = neighbours(topology);
    let openness = Openness::new(scene, CONTACT_DISTANCE, [shortest, finest]);
    let cuts = |t: usize| {
        let corners = scene.corners(t);
        let material = scene.material(t);
        // Glass cut only partly would enclose no body.
        let is_glass = material.specular.is_some_and(|specular| specular.is_glass());
        // What is no longer than the finest edge is an element as it is: a figure of 9 000 small
        // triangles, each of which meets ten others, would have 400 000 pieces.
        if longest_edge(corners) <= finest || !material.scatters() || is_glass {
            return Cuts::default();
        }
        let plane = TrianglePlane::new(scene, t, tolerance);
        let is_near =
            |s: usize| scene.corners(s).iter().all(|&p| plane.height(p).abs() <= tolerance);
        let mut others: Vec<usize> = nearby[t].iter().map(|&s| s as usize).collect();
        others.sort_unstable();
        let mut segments = vec![];
        for s in others {
            // No shadow begins at clear panes.
            if scene.is_clear(s) {
                continue;
            }
            let mut sides = outer[s];
            if is_near(s) {
                // Of coplanar triangles, only the outline.
                for (k, side) in sides.iter_mut().enumerate() {
                    *side &= !neighbours[s][k].is_some_and(|n| is_near(n as usize));
                }
            }
            plane.add_contacts(&scene.corners(s), &sides, &boxes[t], &mut segments);
        }
        segments.retain(|segment| openness.is_worth_a_cut(segment, corners));
        Snapping::new(corners, SNAP_DISTANCE * shortest).cuts(&segments)
    };
    work::map(count, cuts)
}

/// Per triangle and side, the triangle that the surface continues to.
fn neighbours(topology: &SurfaceTopology) -> Vec<[Option<u32>; 3]> {
    let mut neighbours = vec![[None; 3]; topology.sides.len()];
    for [(s, l), (t, k)] in topology.shared_edges() {
        neighbours[s][l] = Some(t as u32);
        neighbours[t][k] = Some(s as u32);
    }
    neighbours
}

/// Gives the points on each side to both triangles that share it.
fn share_side_points(topology: &SurfaceTopology, cuts: &mut [Cuts]) {
    let mut shared: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    let from_start = |side: Side, step: u32| if side.reversed { STEPS - step } else { step };
    for (cuts, sides) in cuts.iter().zip(&topology.sides) {
        for (points, &side) in cuts.on_sides.iter().zip(sides) {
            if !points.is_empty() {
                let list = shared.entry(side.id).or_default();
                list.extend(points.iter().map(|&step| from_start(side, step)));
            }
        }
    }
    for (cuts, sides) in cuts.iter_mut().zip(&topology.sides) {
        for (points, &side) in cuts.on_sides.iter_mut().zip(sides) {
            if let Some(list) = shared.get(&side.id) {
                *points = list.iter().map(|&step| from_start(side, step)).collect();
                points.sort_unstable();
                points.dedup();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Material, Triangle};

    /// A scene of grey quads, each a group of its own.
    fn quads(corners: &[[[f64; 3]; 4]]) -> Arc<Scene> {
        let positions = corners.iter().flatten().map(|&p| DVec3::from_array(p)).collect();
        let pair = |q: u32| {
            [[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
                corners: corners.map(|c| 4 * q + c),
                group: q,
                ..Default::default()
            })
        };
        let count = corners.len() as u32;
        let groups = (0..count).map(|q| q.to_string()).collect();
        let triangles = (0..count).flat_map(pair).collect();
        Arc::new(Scene::new(positions, triangles, groups, vec![Material::grey("m", 0.5)]).unwrap())
    }

    /// More pieces than any scene here has.
    const MANY: usize = 1 << 19;

    const FLOOR: [[f64; 3]; 4] =
        [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 8.0, 0.0], [0.0, 8.0, 0.0]];

    /// Pieces of the floor, and the number of their smooth surfaces.
    fn floor_of(scene: &Scene) -> (Vec<[DVec3; 3]>, usize) {
        let topology = SurfaceTopology::new(scene);
        let surfaces = topology.surfaces();
        let all = 0..scene.triangles().len();
        let floor: Vec<usize> = all.filter(|&t| scene.triangles()[t].group == 0).collect();
        let different: std::collections::HashSet<u32> =
            floor.iter().map(|&t| surfaces[t]).collect();
        (floor.into_iter().map(|t| scene.corners(t)).collect(), different.len())
    }

    fn area(pieces: &[[DVec3; 3]]) -> f64 {
        pieces.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() / 2.0).sum()
    }

    #[test]
    fn no_piece_is_on_both_sides_of_a_wall() {
        // From side to side, through the floor, and a hair above it.
        for bottom in [0.0, -1.0, 5e-5] {
            let wall = [[4.0, 0.0, bottom], [5.0, 8.0, bottom], [5.0, 8.0, 3.0], [4.0, 0.0, 3.0]];
            let scene = quads(&[FLOOR, wall]);
            let cut = cut_at_contacts(&scene, 0.1, MANY);
            let (pieces, surfaces) = floor_of(&cut);
            assert!((area(&pieces) - 80.0).abs() < 1e-9);
            // Distance to the wall's plane.
            let beyond = |p: &DVec3| (p.x - 4.0 - p.y / 8.0) / (1.0 + 1.0 / 64.0f64).sqrt();
            for piece in &pieces {
                let [low, high] =
                    [f64::min, f64::max].map(|fold| piece.iter().map(beyond).reduce(fold).unwrap());
                assert!(low > -1e-6 || high < 1e-6, "{bottom}: {piece:?}");
            }
            assert_eq!(surfaces, 2, "{bottom}");
        }
    }

    #[test]
    fn no_more_pieces_are_cut_than_a_mesh_may_have() {
        let wall = [[4.0, 0.0, 0.0], [5.0, 8.0, 0.0], [5.0, 8.0, 3.0], [4.0, 0.0, 3.0]];
        let scene = quads(&[FLOOR, wall]);
        // A segment makes about four.
        for (most, is_cut) in [(3, false), (MANY, true)] {
            assert_eq!(!Arc::ptr_eq(&scene, &cut_at_contacts(&scene, 0.1, most)), is_cut, "{most}");
        }
    }

    #[test]
    fn walls_are_cut_across_the_sides_of_triangles() {
        // Near the floor's corner almost the whole foot is on one of its two triangles.
        for x in [1e-3, 10.0 - 1e-3] {
            let wall = [[x, 0.0, 0.0], [x, 8.0, 0.0], [x, 8.0, 3.0], [x, 0.0, 3.0]];
            let (pieces, surfaces) = floor_of(&cut_at_contacts(&quads(&[FLOOR, wall]), 0.1, MANY));
            assert!((area(&pieces) - 80.0).abs() < 1e-9);
            assert_eq!(surfaces, 2, "{x}: nothing continues around the end of its longer part");
        }
    }

    #[test]
    fn surfaces_continue_around_the_end_of_a_wall() {
        let wall = [[4.0, 0.0, 0.0], [4.0, 5.0, 0.0], [4.0, 5.0, 3.0], [4.0, 0.0, 3.0]];
        let cut = cut_at_contacts(&quads(&[FLOOR, wall]), 0.1, MANY);
        let (pieces, surfaces) = floor_of(&cut);
        assert!(pieces.len() > 2 && surfaces == 1);
        // Along the wall there are two vertices at each position.
        let topology = SurfaceTopology::new(&cut);
        let mesh = Mesh::new(cut.clone(), f64::INFINITY).unwrap();
        let split = mesh.split_beside_cuts(2, 0.1);
        let foot_of = |mesh: &Mesh| {
            let at_foot = |p: &DVec3| (p.x - 4.0).abs() < 1e-6 && p.y < 5.1;
            let sizes = (0..mesh.element_count()).filter_map(|e| {
                let node = mesh.element(e);
                let at_foot = mesh.corners(node).iter().filter(|p| at_foot(p)).count() == 2;
                (mesh.group(node) == 0 && at_foot).then(|| mesh.longest_edge(node))
            });
            sizes.fold(0.0, f64::max)
        };
        assert!(foot_of(&split) < 0.3 * foot_of(&mesh), "two levels finer");
        let kept = mesh.split_beside_cuts(2, 13.0);
        assert_eq!(kept.element_count(), mesh.element_count(), "the floor is 12.8 long");
        let mut foot = vec![];
        for (t, corners) in topology.corners.iter().enumerate() {
            for (k, p) in cut.corners(t).into_iter().enumerate() {
                if cut.triangles()[t].group == 0 && p.abs_diff_eq(DVec3::X * 4.0, 1e-6) {
                    foot.push(corners[k]);
                }
            }
        }
        foot.sort_unstable();
        foot.dedup();
        assert_eq!(foot.len(), 2);
    }

    /// A box on the floor between two corners, 2 high: its sides, and its top.
    fn box_on_floor(low: [f64; 2], high: [f64; 2]) -> [[[f64; 3]; 4]; 5] {
        let [a, b, c, d] =
            [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        let at = |[x, y]: [f64; 2], z: f64| [x, y, z];
        let side = |p, q| [at(p, 0.0), at(q, 0.0), at(q, 2.0), at(p, 2.0)];
        let top = [at(a, 2.0), at(b, 2.0), at(c, 2.0), at(d, 2.0)];
        [side(a, b), side(b, c), side(c, d), side(d, a), top]
    }

    #[test]
    fn slits_between_solids_are_cut() {
        let first = box_on_floor([3.0, 3.0], [5.0, 6.0]);
        for (width, is_slit) in [(0.05, true), (0.2, false)] {
            let second = box_on_floor([5.0 + width, 3.0], [7.0, 6.0]);
            let scene = quads(&[&[FLOOR][..], &first, &second].concat());
            let cut = cut_at_contacts(&scene, 0.1, MANY);
            let (pieces, _) = floor_of(&cut);
            assert!((area(&pieces) - 80.0).abs() < 1e-9);
            assert_eq!(pieces.len() > 2, is_slit, "{width}");
            let in_slit = |piece: &&[DVec3; 3]| {
                let middle = piece.iter().sum::<DVec3>() / 3.0;
                (middle.x - 5.0 - width / 2.0).abs() < width / 2.0 && (middle.y - 4.5).abs() < 1.5
            };
            let slit: Vec<[DVec3; 3]> = pieces.iter().filter(in_slit).copied().collect();
            let expected = if is_slit { 3.0 * width } else { 0.0 };
            // Its two sides of length 3 may snap by this.
            let off = 6.0 * SNAP_DISTANCE * SHORTEST_CUT * 0.1;
            assert!((area(&slit) - expected).abs() < off, "{width}: {}", area(&slit));
        }
    }

    #[test]
    fn what_is_hidden_or_small_is_not_cut() {
        let solid = [&[FLOOR][..], &box_on_floor([3.0, 3.0], [6.0, 6.0])].concat();
        let scene = quads(&solid);
        assert!(
            Arc::ptr_eq(&scene, &cut_at_contacts(&scene, 0.1, MANY)),
            "the inside of a box is not visible"
        );
        // The floor is visible through a hole in the lid, which fills 1/30 of the view from floor
        // beside a wall.
        let lid = |[x0, x1]: [f64; 2], [y0, y1]: [f64; 2]| {
            [[x0, y0, 2.0], [x1, y0, 2.0], [x1, y1, 2.0], [x0, y1, 2.0]]
        };
        let frame = [
            lid([3.0, 6.0], [3.0, 4.0]),
            lid([3.0, 6.0], [5.0, 6.0]),
            lid([3.0, 4.0], [4.0, 5.0]),
            lid([5.0, 6.0], [4.0, 5.0]),
        ];
        let holed = quads(&[&solid[..5], &frame].concat());
        let (pieces, surfaces) = floor_of(&cut_at_contacts(&holed, 0.1, MANY));
        assert!(pieces.len() > 2 && surfaces == 2, "what is within the walls, and without");
        // And without a lid.
        let open = quads(&solid[..5]);
        assert!(cut_at_contacts(&open, 0.1, MANY).triangles().len() > open.triangles().len());
        assert!(Arc::ptr_eq(&open, &cut_at_contacts(&open, 3.1 / SHORTEST_CUT, MANY)), "too short");
    }
}
