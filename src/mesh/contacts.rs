//! Where surfaces touch: elements there are cut small, since the light on them jumps.

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::box_overlap::overlapping_pairs;
use super::{Cell, Mesh, SurfaceTopology};
use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

/// Of a cell's size (the square root of its area): what comes this close to its plane touches it.
const TOUCH: f64 = 0.15;

/// Of an element's size: lines have to come this far into it to part it.
const INSIDE: f64 = 0.02;

/// Of a cell's size: lines that part some element in the cell come this far into it, since elements
/// are at most [`Mesh::MAX_DEPTH`] levels smaller.
const LEAST: f64 = INSIDE / (1u32 << Mesh::MAX_DEPTH) as f64;

/// Cosine of the angle between triangles in one plane, at least: 1e-5 radians.
const FLAT: f64 = 1.0 - 5e-11;

/// A line on a triangle along which another triangle touches or crosses it.
#[derive(Clone, Copy, Debug)]
struct ContactSegment {
    /// From where to where, by barycentric weights of the second and third corner.
    ends: [DVec2; 2],
    /// How near the other comes, scene unit.
    gap: f64,
}

impl Mesh {
    /// The same mesh with elements that others' edges or faces touch within split further, `levels`
    /// times: an element that straddles a wall's foot is light on one side and hidden on the other
    /// (the discontinuities of order zero of Heckbert, "Discontinuity meshing for radiosity", 1992).
    ///
    /// What comes nearer than 15 % of the square root of an element's area touches it; levels that
    /// would go beyond [`Mesh::MAX_DEPTH`] are left out.
    ///
    /// Where more than 256 triangles have more than 256 others about them each, only the largest 256
    /// touch the rest of these: thousands of faces in one place are not worth the time.
    pub fn split_at_contacts(&self, levels: u32) -> Mesh {
        let slack: Vec<f64> =
            (0..self.depths.len()).map(|t| self.reach(t, self.depth(t))).collect();
        let boxes = boxes(self.scene(), &slack);
        let touching = overlapping_pairs(&boxes, |t| self.scene.area(t));
        let rims = rims(self.scene());
        let parted = |t: usize| {
            let plane = Plane::of(self.scene(), t, slack[t]);
            let mut lines = vec![];
            for s in touching[t].iter().map(|&s| s as usize) {
                plane.touch(&self.scene.corners(s), &rims[s], &boxes[t], &mut lines);
            }
            let mut out = vec![];
            self.part(t, Cell::ROOT, &lines, levels, &mut out);
            out
        };
        let parted: FxHashSet<(usize, Cell)> =
            (0..slack.len()).into_par_iter().flat_map_iter(parted).collect();
        let deeper = |t: usize, cell: Cell| {
            cell.level < self.level_at(t, cell) || parted.contains(&(t, cell))
        };
        Mesh::refined_where(self.scene.clone(), deeper)
    }

    /// Adds to `out` the elements in `cell` of triangle `t`, and parts of them, that `lines` part.
    fn part(
        &self,
        t: usize,
        cell: Cell,
        lines: &[ContactSegment],
        levels: u32,
        out: &mut Vec<(usize, Cell)>,
    ) {
        let lines: Vec<ContactSegment> =
            lines.iter().filter(|l| parts(l, cell, LEAST)).copied().collect();
        if lines.is_empty() {
            return;
        }
        let base = self.level_at(t, cell);
        if cell.level >= base {
            let reach = self.reach(t, cell.level);
            let split = cell.level < (base + levels).min(Mesh::MAX_DEPTH)
                && lines.iter().any(|l| l.gap <= reach && parts(l, cell, INSIDE));
            if !split {
                return;
            }
            out.push((t, cell));
        }
        cell.children().into_iter().for_each(|c| self.part(t, c, &lines, levels, out));
    }

    /// How near to a cell of triangle `t` something has to come to touch it, scene unit.
    fn reach(&self, t: usize, level: u32) -> f64 {
        TOUCH * (self.scene.area(t) / f64::from(1u32 << (2 * level))).sqrt()
    }

    /// Level of this mesh's elements at the middle of `cell` of triangle `t`.
    fn level_at(&self, t: usize, cell: Cell) -> u32 {
        let c = cell.corners();
        let middle = |k: usize| (c[0][k] + c[1][k] + c[2][k]) / 3.0;
        self.cell(self.element(self.element_at(t, middle(0), middle(1)).0)).level
    }
}

/// Whether `line` comes into `cell`, by more than `margin`, a share of its size.
fn parts(line: &ContactSegment, cell: Cell, margin: f64) -> bool {
    // In the cell's own weights; all three are at least `margin` well within.
    let [a, b] = line.ends.map(|p| {
        let [u, v] = cell.local(p.x, p.y);
        [1.0 - u - v, u, v]
    });
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for k in 0..3 {
        let (start, end) = (a[k] - margin, b[k] - margin);
        if start < 0.0 && end < 0.0 {
            return false;
        }
        let at = start / (start - end);
        if start < 0.0 {
            from = from.max(at);
        } else if end < 0.0 {
            to = to.min(at);
        }
    }
    from < to
}

/// The box around each triangle, grown by its `slack`.
fn boxes(scene: &Scene, slack: &[f64]) -> Vec<Aabb> {
    let grown = |(t, &slack): (usize, &f64)| Aabb::from_points(scene.corners(t)).expanded(slack);
    slack.iter().enumerate().map(grown).collect()
}

/// Per triangle, which of its sides do not go on in its own plane: the diagonals of a polygon part
/// nothing.
fn rims(scene: &Scene) -> Vec<[bool; 3]> {
    let smooth = SurfaceTopology::new(scene);
    let mut out = vec![[true; 3]; smooth.sides.len()];
    for [(s, l), (t, k)] in smooth.joins() {
        if scene.normal(s).dot(scene.normal(t)) > FLAT {
            (out[t][k], out[s][l]) = (false, false);
        }
    }
    out
}

/// The plane of a triangle, on which others draw lines.
struct Plane {
    corner: DVec3,
    edges: [DVec3; 2],
    normal: DVec3,
    /// How near to the plane others touch it, scene unit.
    slack: f64,
}

impl Plane {
    fn of(scene: &Scene, t: usize, slack: f64) -> Plane {
        let ([a, b, c], normal) = (scene.corners(t), scene.normal(t));
        Plane { corner: a, edges: [b - a, c - a], normal, slack }
    }

    /// Barycentric position of `p` in the triangle, seen along its normal.
    fn flat(&self, p: DVec3) -> DVec2 {
        let [e1, e2] = self.edges;
        let n = e1.cross(e2);
        let d = p - self.corner;
        DVec2::new(d.cross(e2).dot(n), e1.cross(d).dot(n)) / n.length_squared()
    }

    /// Adds the lines along which a triangle of these `corners` touches or crosses this one, whose box
    /// with slack is `within`: the parts of its sides `rim` that lie within `slack` of the plane, and its
    /// cut with that plane.
    fn touch(
        &self,
        corners: &[DVec3; 3],
        rim: &[bool; 3],
        within: &Aabb,
        lines: &mut Vec<ContactSegment>,
    ) {
        let slack = self.slack;
        let height = corners.map(|p| self.normal.dot(p - self.corner));
        if height.iter().all(|&h| h > slack) || height.iter().all(|&h| h < -slack) {
            return;
        }
        if !Aabb::from_points(*corners).overlaps(within) {
            return;
        }
        let flat = |p: DVec3| self.flat(p);
        let at = |k: usize, l: usize, h: f64| {
            let share = (h - height[k]) / (height[l] - height[k]);
            corners[k].lerp(corners[l], share.clamp(0.0, 1.0))
        };
        let mut cut = vec![];
        for (k, l) in [(0, 1), (1, 2), (2, 0)] {
            let (low, high) = (height[k].min(height[l]), height[k].max(height[l]));
            if rim[k] && low <= slack && high >= -slack {
                let within = |k: usize, l: usize| {
                    if height[k].abs() <= slack {
                        corners[k]
                    } else {
                        at(k, l, slack * height[k].signum())
                    }
                };
                let ends = [within(k, l), within(l, k)].map(flat);
                let crosses = low < 0.0 && high > 0.0;
                let gap = if crosses { 0.0 } else { low.abs().min(high.abs()) };
                if ends[0] != ends[1] {
                    lines.push(ContactSegment { ends, gap });
                }
            }
            if low < 0.0 && high > 0.0 {
                cut.push(flat(at(k, l, 0.0)));
            }
        }
        if cut.len() == 1 {
            // The cut goes through the corner opposite.
            cut.extend((0..3).find(|&k| height[k] == 0.0).map(|k| flat(corners[k])));
        }
        if let [p, q] = cut[..] {
            lines.push(ContactSegment { ends: [p, q], gap: 0.0 });
        }
    }
}
