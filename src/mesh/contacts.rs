//! Contacts of surfaces: elements there are split further, since the light on them jumps.
//!
//! ```text
//!          │ wall                 An element that straddles the wall's foot is lit on one
//!   lit    │   in shadow          side and dark on the other. The foot is a *contact segment*
//!  ────────┴─────────── floor     on the floor's triangle: along it, another triangle's outer
//!  ┌───┬─┬─┼─┬─┬───┐              edge comes near the plane, or the triangle crosses it.
//!  │   ├─┼─┼─┼─┤   │              Elements that a segment separates are split, level by level.
//!  └───┴─┴─┴─┴─┴───┘
//! ```
//!
//! 1. Boxes of triangles, expanded by the contact distance, give the candidate pairs.
//! 2. For each pair, the segments that one triangle makes on the other are computed, in
//!    barycentric coordinates.
//! 3. The quadtree of each triangle is descended along its segments.

use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;

use super::box_overlap::overlapping_pairs;
use super::{Cell, Mesh, SurfaceTopology};
use crate::geometry::aabb::Aabb;
use crate::scene::{Scene, longest_edge};
use crate::work;

/// Least depth of a segment in an element for separating it, as a barycentric weight: a segment
/// along the element's edge does not. Plain choice; no measurement was kept.
const MIN_PENETRATION: f64 = 0.02;

/// Cosine of the angle between the normals above which triangles are coplanar: 1e-5 radians.
const COPLANAR_COSINE: f64 = 1.0 - 5e-11;

/// A line on a triangle along which another triangle touches or crosses it.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactSegment {
    /// Both ends, by barycentric weights of the second and third corner.
    pub ends: [DVec2; 2],
    /// Distance from the plane to the other triangle, scene unit.
    gap: f64,
}

impl Mesh {
    /// The same mesh with elements split further, `levels` times, if edges or faces of other
    /// triangles touch their interior: an element that straddles a wall's foot is light on one side
    /// and hidden on the other (the discontinuities of order zero of Heckbert, "Discontinuity
    /// meshing for radiosity", 1992).
    ///
    /// The contact distance is 15 % of the square root of an element's area; levels beyond
    /// [`Mesh::MAX_DEPTH`] are left out.
    ///
    /// Among triangles that each have more than 256 others near them, only the largest 256 touch
    /// the rest: this bounds the time for thousands of faces at one point.
    pub fn split_at_contacts(&self, levels: u32) -> Mesh {
        self.split_at_contacts_down_to(levels, 0.0)
    }

    /// The same, without splitting elements no longer than `finest` (scene unit).
    pub(crate) fn split_at_contacts_down_to(&self, levels: u32, finest: f64) -> Mesh {
        let count = self.trees.depths.len();
        let tolerances: Vec<f64> =
            (0..count).map(|t| self.contact_distance(t, self.depth(t))).collect();
        let boxes: Vec<Aabb> = (0..count)
            .map(|t| Aabb::from_points(self.scene.corners(t)).expanded(tolerances[t]))
            .collect();
        let nearby = overlapping_pairs(&boxes, |t| self.scene.area(t));
        let outer_edges = outer_edges(self.scene(), &SurfaceTopology::of_scene(self.scene()));
        let separated_in = |t: usize| {
            let plane = TrianglePlane::new(self.scene(), t, tolerances[t]);
            let mut segments = vec![];
            for s in nearby[t].iter().map(|&s| s as usize) {
                let corners = self.scene.corners(s);
                plane.add_contacts(&corners, &outer_edges[s], &boxes[t], &mut segments);
            }
            let longest = longest_edge(self.scene.corners(t));
            let deepest = match longest > finest {
                true => libm::log2(longest / finest).ceil().min(f64::from(Mesh::MAX_DEPTH)) as u32,
                false => 0,
            };
            let mut separated = vec![];
            let levels = [levels, deepest];
            self.collect_separated(t, Cell::ROOT, &segments, levels, &mut separated);
            separated
        };
        let separated: FxHashSet<(usize, Cell)> =
            work::map(count, separated_in).into_iter().flatten().collect();
        let deeper = |t: usize, cell: Cell| {
            cell.level < self.level_at(t, cell) || separated.contains(&(t, cell))
        };
        Mesh::refined_where(self.scene.clone(), deeper)
    }

    /// Adds to `separated` the elements within `cell` of triangle `t`, and parts of them down to
    /// `levels` further levels, that `segments` separate.
    fn collect_separated(
        &self,
        t: usize,
        cell: Cell,
        segments: &[ContactSegment],
        [levels, deepest]: [u32; 2],
        separated: &mut Vec<(usize, Cell)>,
    ) {
        // Elements are at most `MAX_DEPTH` levels smaller.
        let segments: Vec<ContactSegment> = segments
            .iter()
            .filter(|segment| {
                segment.separates(cell, MIN_PENETRATION / (1u32 << Mesh::MAX_DEPTH) as f64)
            })
            .copied()
            .collect();
        if segments.is_empty() {
            return;
        }
        let element_level = self.level_at(t, cell);
        if cell.level >= element_level {
            let distance = self.contact_distance(t, cell.level);
            let touches = |segment: &ContactSegment| {
                segment.gap <= distance && segment.separates(cell, MIN_PENETRATION)
            };
            let deepest = (element_level + levels).min(deepest);
            if cell.level >= deepest || !segments.iter().any(touches) {
                return;
            }
            separated.push((t, cell));
        }
        for child in cell.children() {
            self.collect_separated(t, child, &segments, [levels, deepest], separated);
        }
    }

    /// Distance from its plane below which something touches a cell of `level` in triangle `t`,
    /// scene unit.
    fn contact_distance(&self, t: usize, level: u32) -> f64 {
        // Plain choice.
        0.15 * (self.scene.area(t) / f64::from(1u32 << (2 * level))).sqrt()
    }

    /// Level of this mesh's element at the centroid of `cell` of triangle `t`.
    pub(super) fn level_at(&self, t: usize, cell: Cell) -> u32 {
        let corners = cell.corners();
        let mean = |k: usize| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0;
        self.cell(self.element(self.element_at(t, mean(0), mean(1)).0)).level
    }
}

impl ContactSegment {
    /// Whether the segment enters `cell` by more than `margin`, a barycentric weight of the cell:
    /// whether it intersects the triangle in which all three weights are at least that.
    fn separates(&self, cell: Cell, margin: f64) -> bool {
        let [start, end] = self.ends.map(|p| {
            let [u, v] = cell.local(p.x, p.y);
            [1.0 - u - v, u, v]
        });
        part_inside([start, end].map(|weights| weights.map(|w| w - margin))).is_some()
    }
}

/// The range of a segment, as fractions of its length, in which no weight is below zero, given the
/// three weights at both ends; none if empty. Clipped against the three sides one by one (Liang and
/// Barsky 1984).
pub(super) fn part_inside([start, end]: [[f64; 3]; 2]) -> Option<[f64; 2]> {
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for (start, end) in start.into_iter().zip(end) {
        if start < 0.0 && end < 0.0 {
            return None;
        }
        let crossing = start / (start - end);
        if start < 0.0 {
            from = from.max(crossing);
        } else if end < 0.0 {
            to = to.min(crossing);
        }
    }
    (from < to).then_some([from, to])
}

/// Per triangle, the sides at which its plane ends: the diagonals of a flat polygon are not among
/// them, and separate nothing.
pub(super) fn outer_edges(scene: &Scene, topology: &SurfaceTopology) -> Vec<[bool; 3]> {
    let mut outer = vec![[true; 3]; topology.sides.len()];
    for [(s, l), (t, k)] in topology.shared_edges() {
        if scene.normal(s).dot(scene.normal(t)) > COPLANAR_COSINE {
            outer[t][k] = false;
            outer[s][l] = false;
        }
    }
    outer
}

/// The plane of a triangle, on which other triangles make contact segments.
pub(super) struct TrianglePlane {
    corner: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    /// Distance from the plane below which others touch it, scene unit.
    tolerance: f64,
}

impl TrianglePlane {
    pub fn new(scene: &Scene, t: usize, tolerance: f64) -> TrianglePlane {
        let [a, b, c] = scene.corners(t);
        TrianglePlane { corner: a, edges: [b - a, c - a], normal: scene.normal(t), tolerance }
    }

    /// Height of `p` above the plane, scene unit.
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p - self.corner)
    }

    /// Barycentric position of `p`, projected along the normal.
    fn barycentric(&self, p: DVec3) -> DVec2 {
        let [e1, e2] = self.edges;
        let n = e1.cross(e2);
        let d = p - self.corner;
        DVec2::new(d.cross(e2).dot(n), e1.cross(d).dot(n)) / n.length_squared()
    }

    /// Adds the segments along which the triangle with these `corners` touches or crosses this one,
    /// whose expanded box is `within`: the parts of its `outer` sides that lie within the tolerance
    /// of the plane, and its cut with the plane. A coplanar triangle does not cut it, whatever the
    /// rounding.
    pub fn add_contacts(
        &self,
        corners: &[DVec3; 3],
        outer: &[bool; 3],
        within: &Aabb,
        segments: &mut Vec<ContactSegment>,
    ) {
        let tolerance = self.tolerance;
        let other = OverPlane { corners: *corners, height: corners.map(|p| self.height(p)) };
        let height = other.height;
        if height.iter().all(|&h| h > tolerance) || height.iter().all(|&h| h < -tolerance) {
            return;
        }
        if !Aabb::from_points(*corners).overlaps(within) {
            return;
        }
        let [a, b, c] = *corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let is_coplanar = normal.dot(self.normal).abs() > COPLANAR_COSINE;
        for (k, l) in [(0, 1), (1, 2), (2, 0)] {
            let (low, high) = (height[k].min(height[l]), height[k].max(height[l]));
            if outer[k] && low <= tolerance && high >= -tolerance {
                let ends = [(k, l), (l, k)].map(|(k, l)| other.end_within(tolerance, k, l));
                let ends = ends.map(|p| self.barycentric(p));
                let crosses = !is_coplanar && low < 0.0 && high > 0.0;
                let gap = if crosses { 0.0 } else { low.abs().min(high.abs()) };
                if ends[0] != ends[1] {
                    segments.push(ContactSegment { ends, gap });
                }
            }
        }
        if let Some(cut) = other.cut().filter(|_| !is_coplanar) {
            segments.push(ContactSegment { ends: cut.map(|p| self.barycentric(p)), gap: 0.0 });
        }
    }
}

/// A triangle by the heights of its corners over a plane.
struct OverPlane {
    corners: [DVec3; 3],
    height: [f64; 3],
}

impl OverPlane {
    /// The point at height `h` of the side between corners `k` and `l`.
    fn at_height(&self, h: f64, k: usize, l: usize) -> DVec3 {
        let share = (h - self.height[k]) / (self.height[l] - self.height[k]);
        self.corners[k].lerp(self.corners[l], share.clamp(0.0, 1.0))
    }

    /// The end at corner `k` of the part of the side to `l` that is within `tolerance` of the
    /// plane.
    fn end_within(&self, tolerance: f64, k: usize, l: usize) -> DVec3 {
        if self.height[k].abs() <= tolerance {
            return self.corners[k];
        }
        self.at_height(tolerance * self.height[k].signum(), k, l)
    }

    /// The ends of the cut with the plane, if that goes through the triangle.
    fn cut(&self) -> Option<[DVec3; 2]> {
        let height = self.height;
        let crosses = |(k, l): &(usize, usize)| {
            height[*k].min(height[*l]) < 0.0 && height[*k].max(height[*l]) > 0.0
        };
        let sides = [(0, 1), (1, 2), (2, 0)].into_iter().filter(crosses);
        let crossings = sides.map(|(k, l)| self.at_height(0.0, k, l));
        // Of a single side, the cut goes through the corner opposite.
        let corner = (0..3).find(|&k| height[k] == 0.0).map(|k| self.corners[k]);
        let mut ends = crossings.chain(corner);
        Some([ends.next()?, ends.next()?])
    }
}
