//! Which corners and sides of scene triangles belong to one smooth surface.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::Scene;

/// Neighbours whose normals differ by more than this many degrees meet in a crease.
pub const CREASE_DEGREES: f64 = 40.0;

/// Identities shared across a smooth surface: one object or group, one material, no crease.
pub(crate) struct Smooth {
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

impl Smooth {
    pub fn new(scene: &Scene) -> Smooth {
        let welded = weld(scene);
        let count = scene.triangles().len();
        let mut by_ends: HashMap<(u32, u32), Vec<(usize, usize)>> = HashMap::new();
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
        let mut joined = Joined::new(3 * count);
        let mut edges = vec![[0; 3]; count];
        for pair in by_ends.values() {
            // In the order of the triangles: the first is the lowest.
            pair.iter().for_each(|&(t, k)| edges[t][k] = (3 * pair[0].0 + pair[0].1) as u32);
            // More than two triangles at a side have no one surface to continue.
            let &[(t, k), (s, l)] = pair.as_slice() else { continue };
            let opposite = sides[t][k].reversed != sides[s][l].reversed;
            if !opposite || !continues(scene, t, s) {
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
        Smooth { corners, sides, edges }
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
        let mut joined = Joined::new(self.sides.len());
        self.joins().for_each(|[(s, _), (t, _)]| joined.join(s, t));
        (0..self.sides.len()).map(|t| joined.find(t) as u32).collect()
    }
}

/// Whether two neighbouring triangles belong to one smooth surface.
fn continues(scene: &Scene, t: usize, s: usize) -> bool {
    let (a, b) = (scene.triangles()[t], scene.triangles()[s]);
    a.group == b.group
        && a.material == b.material
        && scene.normal(t).dot(scene.normal(s)) >= CREASE_DEGREES.to_radians().cos()
}

/// Per triangle corner, one number for each distinct position.
fn weld(scene: &Scene) -> Vec<[u32; 3]> {
    let mut seen: HashMap<[u64; 3], u32> = HashMap::new();
    let mut number = |p: DVec3| {
        // Adding zero makes -0 equal to 0, bit for bit.
        let bits = (p + DVec3::ZERO).to_array().map(f64::to_bits);
        let next = seen.len() as u32;
        *seen.entry(bits).or_insert(next)
    };
    (0..scene.triangles().len()).map(|t| scene.corners(t).map(&mut number)).collect()
}

/// Disjoint sets; the lowest member stands for its set, whatever the order of joining.
struct Joined(Vec<usize>);

impl Joined {
    fn new(count: usize) -> Joined {
        Joined((0..count).collect())
    }

    fn find(&mut self, mut k: usize) -> usize {
        while self.0[k] != k {
            self.0[k] = self.0[self.0[k]];
            k = self.0[k];
        }
        k
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.0[a.max(b)] = a.min(b);
    }
}
