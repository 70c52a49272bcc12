//! Which vertices a mesh has: places on lattices that are the same place, on one smooth surface.

use std::collections::HashMap;

use glam::DVec3;

use crate::mesh::{Cell, MAX_DEPTH, Mesh, Side, Smooth};

/// Steps along a triangle's side on the lattice that all depths share.
const FINEST: u32 = 1 << MAX_DEPTH;

/// What makes a vertex: the same key, the same vertex, in all meshes of one scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Key {
    Corner(u32),
    Side { id: u32, step: u32 },
    Inside { triangle: u32, i: u32, j: u32 },
}

/// The vertices of a mesh.
pub(super) struct Vertices {
    /// What each vertex is.
    pub keys: Vec<Key>,
    /// Where it is, scene unit.
    pub positions: Vec<DVec3>,
    /// The three at the corners of each element.
    pub corners: Vec<[u32; 3]>,
    /// All around each element.
    pub rims: Rims,
    numbers: HashMap<Key, u32>,
}

/// The vertices around each element: its corners, and what finer neighbours put between them.
#[derive(Default)]
pub(super) struct Rims {
    ends: Vec<usize>,
    vertices: Vec<u32>,
}

impl Rims {
    pub fn of(&self, e: usize) -> &[u32] {
        let start = if e == 0 { 0 } else { self.ends[e - 1] };
        &self.vertices[start..self.ends[e]]
    }

    pub fn iter(&self) -> impl Iterator<Item = (usize, &[u32])> {
        (0..self.ends.len()).map(|e| (e, self.of(e)))
    }
}

impl Vertices {
    /// Those of `mesh`, whose scene's smooth surfaces are `smooth`.
    pub fn new(mesh: &Mesh, smooth: &Smooth) -> Vertices {
        let (keys, positions, corners, rims, numbers) = Default::default();
        let mut out = Vertices { keys, positions, corners, rims, numbers };
        (0..mesh.element_count()).for_each(|e| out.add_corners(mesh, smooth, e));
        (0..mesh.element_count()).for_each(|e| out.add_rim(mesh, smooth, e));
        out
    }

    /// The vertex with this key.
    pub fn find(&self, key: &Key) -> Option<u32> {
        self.numbers.get(key).copied()
    }

    fn add_corners(&mut self, mesh: &Mesh, smooth: &Smooth, e: usize) {
        let node = mesh.element(e);
        let (places, positions) = (lattice(mesh.cell(node)), mesh.corners(node));
        self.corners.push([0, 1, 2].map(|k| {
            let key = key(smooth, mesh.triangle(node), places[k]);
            *self.numbers.entry(key).or_insert_with(|| {
                self.keys.push(key);
                self.positions.push(positions[k]);
                self.positions.len() as u32 - 1
            })
        }));
    }

    fn add_rim(&mut self, mesh: &Mesh, smooth: &Smooth, e: usize) {
        let node = mesh.element(e);
        let places = lattice(mesh.cell(node));
        let mut rim = std::mem::take(&mut self.rims.vertices);
        for k in 0..3 {
            rim.push(self.corners[e][k]);
            let (from, to) = (places[k], places[(k + 1) % 3]);
            self.add_between(smooth, mesh.triangle(node), from, to, &mut rim);
        }
        self.rims.ends.push(rim.len());
        self.rims.vertices = rim;
    }

    /// Vertices strictly between lattice points `a` and `b`, in order: midpoints of midpoints, for
    /// as long as there are any.
    fn add_between(&self, smooth: &Smooth, t: usize, a: [u32; 2], b: [u32; 2], rim: &mut Vec<u32>) {
        let Some(middle) = middle(a, b) else { return };
        if let Some(vertex) = self.find(&key(smooth, t, middle)) {
            self.add_between(smooth, t, a, middle, rim);
            rim.push(vertex);
            self.add_between(smooth, t, middle, b, rim);
        }
    }
}

/// The vertices at the corners of a cell of triangle `t`.
pub(super) fn corners(smooth: &Smooth, t: usize, cell: Cell) -> [Key; 3] {
    lattice(cell).map(|place| key(smooth, t, place))
}

/// The vertices that splitting a cell of triangle `t` makes: in the middle of the sides from its
/// first to its second corner, and so on. None at the finest level.
pub(super) fn middles(smooth: &Smooth, t: usize, cell: Cell) -> Option<[Key; 3]> {
    let [a, b, c] = lattice(cell);
    let at = |p, q| Some(key(smooth, t, middle(p, q)?));
    Some([at(a, b)?, at(b, c)?, at(c, a)?])
}

/// The lattice point half-way, unless the two are neighbours.
fn middle(a: [u32; 2], b: [u32; 2]) -> Option<[u32; 2]> {
    let apart = a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1]));
    (apart >= 2).then(|| [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2])
}

/// Corners of `cell` on the finest lattice of its triangle.
fn lattice(cell: Cell) -> [[u32; 2]; 3] {
    cell.lattice_corners().map(|c| c.map(|k| k * (FINEST >> cell.level)))
}

fn key(smooth: &Smooth, triangle: usize, [i, j]: [u32; 2]) -> Key {
    let corner = |k: usize| Key::Corner(smooth.corners[triangle][k]);
    let side = |k: usize, step: u32| {
        let Side { id, reversed } = smooth.sides[triangle][k];
        Key::Side { id, step: if reversed { FINEST - step } else { step } }
    };
    match (i, j) {
        (0, 0) => corner(0),
        (FINEST, 0) => corner(1),
        (0, FINEST) => corner(2),
        (i, 0) => side(0, i),
        (i, j) if i + j == FINEST => side(1, j),
        (0, j) => side(2, FINEST - j),
        (i, j) => Key::Inside { triangle: triangle as u32, i, j },
    }
}
