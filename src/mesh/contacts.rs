//! Where surfaces touch: elements there are cut small, since the light on them jumps.

use glam::{DVec2, DVec3};

use super::{Cell, MAX_DEPTH, Mesh, Smooth};
use crate::scene::Scene;

/// Of a cell's size (the square root of its area): what comes this close to its plane touches it.
const TOUCH: f64 = 0.15;

/// Of an element's size: lines have to come this far into it to part it.
const INSIDE: f64 = 0.02;

/// Cosine of the angle between triangles in one plane, at least: 1e-5 radians.
const FLAT: f64 = 1.0 - 5e-11;

/// A line on a triangle along which another triangle touches or crosses it.
#[derive(Clone, Copy, Debug)]
struct Line {
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
    /// would go beyond [`MAX_DEPTH`] are left out.
    pub fn split_at_contacts(&self, levels: u32) -> Mesh {
        let lines = lines(self);
        let deeper = |t: usize, cell: Cell| {
            let base = self.level_at(t, cell);
            let reach = TOUCH * (self.scene.area(t) / f64::from(1u32 << (2 * cell.level))).sqrt();
            let near = |l: &&Line| l.gap <= reach;
            cell.level < base
                || cell.level < (base + levels).min(MAX_DEPTH)
                    && lines[t].iter().filter(near).any(|l| parts(l, cell))
        };
        Mesh::grown(self.scene.clone(), deeper)
    }

    /// Level of this mesh's elements at the middle of `cell` of triangle `t`.
    fn level_at(&self, t: usize, cell: Cell) -> u32 {
        let c = cell.corners();
        let middle = |k: usize| (c[0][k] + c[1][k] + c[2][k]) / 3.0;
        self.cell(self.element(self.element_at(t, middle(0), middle(1)).0)).level
    }
}

/// Whether `line` comes into `cell`, by more than a margin.
fn parts(line: &Line, cell: Cell) -> bool {
    // In the cell's own weights; all three are at least `INSIDE` well within.
    let [a, b] = line.ends.map(|p| {
        let [u, v] = cell.local(p.x, p.y);
        [1.0 - u - v, u, v]
    });
    let (mut from, mut to) = (0.0f64, 1.0f64);
    for k in 0..3 {
        let (start, end) = (a[k] - INSIDE, b[k] - INSIDE);
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

/// For every triangle, the lines along which others touch it.
fn lines(mesh: &Mesh) -> Vec<Vec<Line>> {
    let scene = mesh.scene();
    let count = scene.triangles().len();
    let slack: Vec<f64> = (0..count)
        .map(|t| TOUCH * (scene.area(t) / f64::from(1u32 << (2 * mesh.depth(t)))).sqrt())
        .collect();
    let boxes: Vec<[DVec3; 2]> = (0..count)
        .map(|t| {
            let [a, b, c] = scene.corners(t);
            [a.min(b).min(c) - slack[t], a.max(b).max(c) + slack[t]]
        })
        .collect();
    // Sweep along x: of the boxes that have begun, those that have not ended.
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_unstable_by(|&s, &t| boxes[s][0].x.total_cmp(&boxes[t][0].x).then(s.cmp(&t)));
    let rims = rims(scene);
    let mut out = vec![vec![]; count];
    let mut begun: Vec<usize> = vec![];
    for t in order {
        begun.retain(|&s| boxes[s][1].x >= boxes[t][0].x);
        for &s in &begun {
            let apart = boxes[s][0].cmpgt(boxes[t][1]) | boxes[t][0].cmpgt(boxes[s][1]);
            if !apart.any() {
                touch(scene, t, s, &rims[s], slack[t], &mut out[t]);
                touch(scene, s, t, &rims[t], slack[s], &mut out[s]);
            }
        }
        begun.push(t);
    }
    out
}

/// Per triangle, which of its sides do not go on in its own plane: the diagonals of a polygon part
/// nothing.
fn rims(scene: &Scene) -> Vec<[bool; 3]> {
    let smooth = Smooth::new(scene);
    let mut out = vec![[true; 3]; smooth.sides.len()];
    for [(s, l), (t, k)] in smooth.joins() {
        if scene.normal(s).dot(scene.normal(t)) > FLAT {
            (out[t][k], out[s][l]) = (false, false);
        }
    }
    out
}

/// Adds the lines along which triangle `s` touches or crosses `t`: the parts of its sides `rim` that
/// lie within `slack` of the plane of `t`, and its cut with that plane.
fn touch(scene: &Scene, t: usize, s: usize, rim: &[bool; 3], slack: f64, lines: &mut Vec<Line>) {
    let ([a, b, c], normal) = (scene.corners(t), scene.normal(t));
    let corners = scene.corners(s);
    let height = corners.map(|p| normal.dot(p - a));
    if height.iter().all(|&h| h > slack) || height.iter().all(|&h| h < -slack) {
        return;
    }
    let (e1, e2) = (b - a, c - a);
    let flat = |p: DVec3| {
        let n = e1.cross(e2);
        let d = p - a;
        DVec2::new(d.cross(e2).dot(n), e1.cross(d).dot(n)) / n.length_squared()
    };
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
                lines.push(Line { ends, gap });
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
        lines.push(Line { ends: [p, q], gap: 0.0 });
    }
}
