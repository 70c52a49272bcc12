//! Convex polygons of a scene: merged coplanar neighbouring triangles.
//!
//! Fewer and larger polygons mean fewer pairs, and no shadow edges along the diagonals of quads.
//!
//! ```text
//! weld corners ─→ find sides shared by two consistently wound triangles
//!              ─→ flood coplanar regions; each that is convex as a whole becomes one polygon
//!              ─→ in others, join neighbours across the longest sides while the union is convex
//!              ─→ drop corners at which the outline is straight
//! ```

use std::collections::{BTreeMap, HashMap};

use glam::DVec3;

use super::tolerances::COPLANARITY;
use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::geometry::aabb::Aabb;
use crate::geometry::polygon::area_vector;
use crate::geometry::union_find::UnionFind;
use crate::geometry::weld::Weld;
use crate::scene::Scene;

/// A convex planar polygon, counter-clockwise seen from its front, in units of the scene's size.
#[derive(Clone, Debug)]
pub(super) struct ConvexPolygon {
    pub corners: Vec<DVec3>,
    /// Unit normal, towards the front.
    pub normal: DVec3,
    /// In squares of the scene's size.
    pub area: f64,
    /// Group of its triangles; that of the first triangle where groups are merged.
    pub group: u32,
}

impl ConvexPolygon {
    /// The polygon with these corners; `None` if it has no area.
    pub fn new(corners: Vec<DVec3>, group: u32) -> Option<ConvexPolygon> {
        let vector = area_vector(&corners);
        let area = vector.length();
        let normal = vector.normalize_or_zero();
        (normal != DVec3::ZERO).then_some(ConvexPolygon { corners, normal, area, group })
    }

    /// The smallest box around the corners.
    pub fn bounds(&self) -> Aabb {
        Aabb::from_points(self.corners.iter().copied())
    }

    /// The same polygon with its front on the other side.
    pub fn reversed(&self) -> ConvexPolygon {
        let corners = self.corners.iter().rev().copied().collect();
        ConvexPolygon { corners, normal: -self.normal, ..*self }
    }
}

/// Which triangles may become one polygon.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Merge {
    /// Within one group: polygons that emit and receive.
    WithinGroups,
    /// Across groups: blockers.
    AcrossGroups,
}

/// Polygons of a scene, and the polygon of each triangle.
pub(super) struct MergedTriangles {
    /// In the order of first triangles.
    pub polygons: Vec<ConvexPolygon>,
    /// Per triangle, the index of its polygon; `None` for triangles without area.
    pub of_triangle: Vec<Option<u32>>,
}

/// The scene as convex polygons relative to its centre, every length divided by `unit`.
///
/// A connected coplanar region that is convex as a whole becomes one polygon; of any other region
/// neighbours are joined across their longest common sides as long as the union stays convex.
pub(super) fn convex_polygons(scene: &Scene, unit: f64, merge: Merge) -> MergedTriangles {
    let mut outlines = Outlines::new(scene, unit, merge);
    outlines.join_whole_regions();
    outlines.join_neighbours();
    outlines.finish(scene)
}

/// Polygons under construction: loops of welded corners.
struct Outlines {
    corners: Vec<DVec3>,
    /// Per triangle, the loop of its polygon if it is the representative, else empty.
    loops: Vec<Vec<u32>>,
    /// The triangles of each polygon, represented by the first.
    joined: UnionFind,
    normals: Vec<DVec3>,
    /// Pairs of triangles that may merge, and the squared length of their common side.
    neighbours: Vec<(f64, usize, usize)>,
}

impl Outlines {
    fn new(scene: &Scene, unit: f64, merge: Merge) -> Outlines {
        let count = scene.triangles().len();
        let (loops, corners) = weld(scene, unit);
        let normals: Vec<DVec3> = (0..count).map(|t| scene.normal(t)).collect();
        let mut sides: HashMap<(u32, u32), Vec<usize>> = HashMap::new();
        for (t, outline) in loops.iter().enumerate() {
            for k in 0..3 {
                sides.entry((outline[k], outline[(k + 1) % 3])).or_default().push(t);
            }
        }
        let mut neighbours = Vec::new();
        for (t, outline) in loops.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (outline[k], outline[(k + 1) % 3]);
                let beyond = match (sides.get(&(a, b)), sides.get(&(b, a))) {
                    // A side shared by more than two triangles is not merged across.
                    (Some(here), Some(there)) if here.len() == 1 && there.len() == 1 => there[0],
                    _ => continue,
                };
                let group = |t: usize| scene.triangles()[t].group;
                let allowed = merge == Merge::AcrossGroups || group(t) == group(beyond);
                if t < beyond && allowed && normals[t].dot(normals[beyond]) > 0.0 {
                    let side = corners[a as usize].distance_squared(corners[b as usize]);
                    neighbours.push((side, t, beyond));
                }
            }
        }
        neighbours.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        Outlines { corners, loops, joined: UnionFind::new(count), normals, neighbours }
    }

    /// Joins those regions of triangles coplanar with the region's first that are convex as a
    /// whole.
    fn join_whole_regions(&mut self) {
        let mut region: Vec<usize> = vec![usize::MAX; self.loops.len()];
        let mut beside: Vec<Vec<usize>> = vec![Vec::new(); self.loops.len()];
        for &(_, a, b) in &self.neighbours {
            beside[a].push(b);
            beside[b].push(a);
        }
        for seed in 0..self.loops.len() {
            if region[seed] != usize::MAX {
                continue;
            }
            let mut members = vec![seed];
            region[seed] = seed;
            let mut next = 0;
            while let Some(&t) = members.get(next) {
                next += 1;
                for &n in &beside[t] {
                    if region[n] == usize::MAX && self.coplanar(seed, &self.loops[n]) {
                        region[n] = seed;
                        members.push(n);
                    }
                }
            }
            if members.len() > 1
                && let Some(outline) = self.union(&members, self.normals[seed])
            {
                for &t in &members {
                    self.joined.join(seed, t);
                    self.loops[t].clear();
                }
                self.loops[seed] = outline;
            }
        }
    }

    fn join_neighbours(&mut self) {
        for k in 0..self.neighbours.len() {
            let (_, a, b) = self.neighbours[k];
            let (a, b) = (self.joined.find(a), self.joined.find(b));
            let (first, second) = (a.min(b), a.max(b));
            if first == second || !self.coplanar(first, &self.loops[second]) {
                continue;
            }
            if let Some(outline) = self.union(&[first, second], self.normals[first]) {
                self.joined.join(first, second);
                self.loops[second].clear();
                self.loops[first] = outline;
            }
        }
    }

    /// Whether `outline` lies in the plane of triangle `t`'s polygon.
    fn coplanar(&self, t: usize, outline: &[u32]) -> bool {
        let own = self.loops[t].iter().map(|&k| self.corners[k as usize]);
        let other = outline.iter().map(|&k| self.corners[k as usize]);
        let Some(origin) = own.clone().next() else { return false };
        let all = own.chain(other);
        let mut off = all.map(|p| self.normals[t].dot(p - origin).abs());
        off.all(|off| off <= COPLANARITY)
    }

    /// The loop around all of `members`, if there is a single convex one.
    fn union(&self, members: &[usize], normal: DVec3) -> Option<Vec<u32>> {
        // A corner visited twice would make the traversal below ambiguous, and is never convex.
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for &t in members {
            let outline = &self.loops[t];
            for (k, &a) in outline.iter().enumerate() {
                let b = outline[(k + 1) % outline.len()];
                // A pair of opposite sides is inside the union: both are removed.
                match next.get_mut(&b).map(|ends| (ends.iter().position(|&e| e == a), ends)) {
                    Some((Some(at), ends)) => drop(ends.swap_remove(at)),
                    _ => next.entry(a).or_default().push(b),
                }
            }
        }
        next.retain(|_, ends| !ends.is_empty());
        let start = *next.keys().next()?;
        let mut outline = vec![start];
        let mut at = start;
        loop {
            let &[end] = next.get(&at)?.as_slice() else { return None };
            if end == start {
                break;
            }
            outline.push(end);
            at = end;
            if outline.len() > next.len() {
                return None;
            }
        }
        (outline.len() == next.len() && self.convex(&outline, normal)).then_some(outline)
    }

    /// Whether all turns of a loop are left turns or straight, and the loop goes around once.
    fn convex(&self, outline: &[u32], normal: DVec3) -> bool {
        let mut around = 0.0;
        for k in 0..outline.len() {
            let (sine, cosine) = self.turn(outline, k, normal);
            if sine < -COINCIDENCE_TOLERANCE || (cosine < 0.0 && sine <= COINCIDENCE_TOLERANCE) {
                return false;
            }
            around += libm::atan2(sine, cosine);
        }
        around < 1.5 * std::f64::consts::TAU
    }

    /// Sine and cosine of the turn at corner `k` of a loop.
    fn turn(&self, outline: &[u32], k: usize, normal: DVec3) -> (f64, f64) {
        let n = outline.len();
        let at = |k: usize| self.corners[outline[k % n] as usize];
        let (into, out) = (at(k) - at(k + n - 1), at(k + 1) - at(k));
        let scale = into.length() * out.length();
        (normal.dot(into.cross(out)) / scale, into.dot(out) / scale)
    }

    fn finish(mut self, scene: &Scene) -> MergedTriangles {
        let mut polygons = Vec::new();
        // Indices of polygons, by representative triangle.
        let mut numbers = vec![None; self.loops.len()];
        for (t, outline) in self.loops.iter().enumerate() {
            let bend =
                |&k: &usize| self.turn(outline, k, self.normals[t]).0 > COINCIDENCE_TOLERANCE;
            let kept = (0..outline.len()).filter(bend);
            let corners = kept.map(|k| self.corners[outline[k] as usize]).collect();
            if let Some(polygon) = ConvexPolygon::new(corners, scene.triangles()[t].group) {
                numbers[t] = Some(polygons.len() as u32);
                polygons.push(polygon);
            }
        }
        let of_triangle = (0..self.loops.len()).map(|t| numbers[self.joined.find(t)]).collect();
        MergedTriangles { polygons, of_triangle }
    }
}

/// A position relative to the centre of the scene, divided by `unit`.
pub(super) fn in_units(scene: &Scene, unit: f64) -> impl Fn(DVec3) -> DVec3 + use<> {
    let centre = scene.bounds().centre();
    move |p| (p - centre) / unit
}

/// Per triangle its corners as indices of distinct positions, and these positions, relative to the
/// centre of the scene and divided by `unit`.
fn weld(scene: &Scene, unit: f64) -> (Vec<Vec<u32>>, Vec<DVec3>) {
    let mut weld = Weld::default();
    let loops = (0..scene.triangles().len())
        .map(|t| scene.corners(t).into_iter().map(|p| weld.number(p)).collect())
        .collect();
    let corners = weld.positions.into_iter().map(in_units(scene, unit)).collect();
    (loops, corners)
}
