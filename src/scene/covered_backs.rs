//! Backs that are hidden by coincident fronts.
//!
//! If a file has a surface once for each side, two fronts lie in one plane and face opposite ways.
//! Each covers the other's back: a ray from a side hits that side's front.
//!
//! ```text
//!     \   ray               front of t     ┐ coincident: the ray
//!   ───▼──────────── t ─── back of s       ┘ hits t, not s
//!   ──────────────── s ─── back of t
//!                           front of s
//! ```

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::covers::Covers;
use super::{Facets, Scene, longest_edge};
use crate::geometry::FILE_TOLERANCE;
use crate::geometry::incidence::Incidence;
use crate::geometry::polygon::{polygon_area, polygon_difference};

/// Number of triangles at a corner above which the corner is skipped, and maximum number of
/// candidates for one triangle: otherwise thousands that meet in a point would each test all of
/// them. Plain choice.
const MAX_TRIANGLES: usize = 256;

/// The covered backs of `scene`.
pub(super) fn covered_backs(scene: &Scene) -> Covers {
    let count = scene.triangles().len();
    let welded = &*scene.welded_corners();
    let corners = &welded.corners[..];
    let meeting =
        Incidence::new(welded.positions, || corners.iter().map(<[u32; 3]>::as_slice).enumerate());
    let surfaces = Surfaces { scene, facets: scene.facets(), corners, meeting };
    let covers: Vec<Option<Vec<u32>>> =
        (0..count).into_par_iter().map(|t| surfaces.covers(t)).collect();
    Covers::new((0..).zip(covers).filter_map(|(t, covers)| Some((t, covers?))))
}

/// Triangles by the positions of their corners.
struct Surfaces<'a> {
    scene: &'a Scene,
    facets: Arc<Facets>,
    /// Per triangle, the positions of its corners by number.
    corners: &'a [[u32; 3]],
    /// The triangles that meet at each position.
    meeting: Incidence,
}

impl Surfaces<'_> {
    fn meeting_at(&self, v: u32) -> &[u32] {
        let meeting = self.meeting.at(v);
        if meeting.len() > MAX_TRIANGLES { &[] } else { meeting }
    }

    /// Subtracts the fronts in the plane of triangle `t` from it, from its corners outwards;
    /// returns these fronts if nothing is left.
    fn covers(&self, t: usize) -> Option<Vec<u32>> {
        let (corners, normal) = (self.scene.corners(t), self.facets.normals[t]);
        let touching = || self.corners[t].iter().flat_map(|&v| self.meeting_at(v));
        let covers_some = |&s: &u32| self.cover(t, (corners, normal), s as usize).is_some();
        // Light passes a clear triangle from either side.
        if self.scene.is_clear(t) || !touching().any(covers_some) {
            return None;
        }
        // Slivers between outlines stay open by rounding.
        let still_open = 1e-6 * self.scene.area(t);
        let mut open = vec![corners.to_vec()];
        let mut known: FxHashSet<u32> = FxHashSet::default();
        let mut covers = vec![];
        let mut queue: Vec<u32> = self.corners[t].to_vec();
        let mut k = 0;
        while k < queue.len() && known.len() < MAX_TRIANGLES {
            for &s in self.meeting_at(queue[k]) {
                let cover = self.cover(t, (corners, normal), s as usize);
                let Some(cover) = cover.filter(|_| known.insert(s)) else { continue };
                let taken_off = |part: &Vec<DVec3>| polygon_difference(part, &cover, -normal);
                let left: Vec<Vec<DVec3>> = open.iter().flat_map(taken_off).collect();
                // Only fronts that cover some of it lead further.
                if left != open {
                    let further = self.corners[s as usize];
                    queue.extend(further.iter().filter(|v| !self.corners[t].contains(v)));
                    open = left;
                    covers.push(s);
                }
            }
            if open.iter().map(|part| polygon_area(part)).sum::<f64>() <= still_open {
                return Some(covers);
            }
            k += 1;
        }
        None
    }

    /// Triangle `s` in the plane of triangle `t`, which has these `corners` and this unit `normal`,
    /// if it coincides, faces the other way and has no holes except those of `t`.
    fn cover(
        &self,
        t: usize,
        (corners, normal): ([DVec3; 3], DVec3),
        s: usize,
    ) -> Option<[DVec3; 3]> {
        if normal.dot(self.facets.normals[s]) >= 0.0 || self.scene.is_clear(s) {
            return None;
        }
        let of_s = self.scene.corners(s);
        let height = |p: DVec3| normal.dot(p - corners[0]);
        let reach = FILE_TOLERANCE * longest_edge(corners).max(longest_edge(of_s));
        let in_plane = of_s.iter().all(|&p| height(p).abs() <= reach);
        let weights = || of_s.map(|p| self.scene.barycentric(t, p));
        let covers = in_plane
            && (!self.scene.has_cut_outs()
                || self.scene.has_no_other_holes(t, (self.scene, s), weights()));
        covers.then(|| of_s.map(|p| p - height(p) * normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Piece, Triangle};

    /// Whether each of these triangles has a covered back.
    fn covered(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<bool> {
        let triangles: Vec<Triangle> =
            triangles.iter().map(|&corners| Triangle { corners, ..Default::default() }).collect();
        let material = Material::grey("m", 0.5);
        let count = triangles.len();
        let scene = Scene::new(positions.to_vec(), triangles, vec!["g".into()], vec![material]);
        let scene = scene.unwrap();
        (0..count).map(|t| scene.is_back_covered(t)).collect()
    }

    /// Corners of a regular polygon in a skew plane, with six digits as in a file.
    fn polygon(corners: u32) -> Vec<DVec3> {
        let [x, y] = [DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.48, 0.8, 0.36)];
        let corner = |k: u32| {
            let (sin, cos) = (f64::from(k) / f64::from(corners) * std::f64::consts::TAU).sin_cos();
            ((3.0 * cos * x + 2.0 * sin * y + 7.0) * 1e6).round() / 1e6
        };
        (0..corners).map(corner).collect()
    }

    fn fan(corners: u32, first: u32) -> impl Iterator<Item = [u32; 3]> {
        (1..corners - 1).map(move |k| [0, k, k + 1].map(|v| (v + first) % corners))
    }

    fn reversed([a, b, c]: [u32; 3]) -> [u32; 3] {
        [c, b, a]
    }

    #[test]
    fn surfaces_that_a_file_has_for_each_side_are_covered() {
        for corners in [3, 4, 5, 12, 40] {
            for first in [0, 1, corners / 2] {
                let front: Vec<[u32; 3]> = fan(corners, 0).collect();
                let both: Vec<_> =
                    front.iter().copied().chain(fan(corners, first).map(reversed)).collect();
                let found = covered(&polygon(corners), &both);
                assert!(found.iter().all(|&c| c), "{corners} from {first}: {found:?}");
                assert!(!covered(&polygon(corners), &front).contains(&true));
                // Twice with the same winding: no front behind any of them.
                let twice = [&front[..], &front[..]].concat();
                assert!(!covered(&polygon(corners), &twice).contains(&true));
            }
        }
    }

    #[test]
    fn a_back_that_is_open_somewhere_is_not_covered() {
        // A quad, and behind it one of the triangles of its other diagonal: that one is covered,
        // and of the quad neither triangle is.
        let found = covered(&polygon(4), &[[0, 1, 2], [0, 2, 3], [3, 1, 0]]);
        assert_eq!(found, [false, false, true]);
    }

    #[test]
    fn bodies_are_not_covered_however_thin() {
        // A plate whose other face lies a millionth of its size behind: it has corners of its own.
        let back = |p: &DVec3| *p - 3e-6 * DVec3::new(-0.64, -0.6, 0.48);
        let front = polygon(4);
        let positions = [&front[..], &front.iter().map(back).collect::<Vec<_>>()].concat();
        let faces: Vec<[u32; 3]> =
            fan(4, 0).chain(fan(4, 0).map(|t| reversed(t).map(|v| v + 4))).collect();
        assert!(!covered(&positions, &faces).contains(&true));
    }

    #[test]
    fn pieces_are_covered_as_their_triangles() {
        let both: Vec<[u32; 3]> = fan(4, 0).chain(fan(4, 0).map(reversed)).collect();
        let triangles =
            both.iter().map(|&corners| Triangle { corners, ..Default::default() }).collect();
        let material = Material::grey("m", 0.5);
        let scene = Scene::new(polygon(4), triangles, vec!["g".into()], vec![material]).unwrap();
        // The first is halved, and what lies behind it is not.
        let [a, b, c] = scene.corners(0);
        let half = |corners, weights| Piece { corners, weights, cut: [false; 3] };
        let halves = vec![
            half([a, b, b.midpoint(c)], [[0.0, 0.0], [1.0, 0.0], [0.5, 0.5]]),
            half([a, b.midpoint(c), c], [[0.0, 0.0], [0.5, 0.5], [0.0, 1.0]]),
        ];
        let whole = (1..4).map(|t| vec![Piece::whole(scene.corners(t))]);
        let cut = scene.cut([halves].into_iter().chain(whole).collect());
        assert!((0..5).all(|t| cut.is_back_covered(t)));
    }

    #[test]
    fn crowds_of_triangles_at_a_corner_take_no_quadratic_time() {
        // A disc of a hundred thousand triangles around its middle, for each side: each tests the
        // few that meet at the rim. All pairs would be ten thousand million.
        let corners = 100_000;
        let mut positions = polygon(corners);
        positions.push(DVec3::splat(7.0));
        let slice = |k: u32| [corners, k, (k + 1) % corners];
        let both: Vec<_> = (0..corners).flat_map(|k| [slice(k), reversed(slice(k))]).collect();
        let found = covered(&positions, &both);
        let open = found.iter().filter(|&&covered| !covered).count();
        assert!(open == 0, "{open}");
    }
}
