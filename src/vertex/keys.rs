//! Which vertices a mesh has: places on lattices that are the same place, on one smooth surface.

use glam::DVec3;
use rustc_hash::FxHashMap;

use crate::mesh::{Cell, Mesh, Side, SurfaceTopology};
use crate::scene::Scene;

/// Steps along a triangle's side on the lattice that all depths share.
const FINEST: u32 = 1 << Mesh::MAX_DEPTH;

/// What makes a vertex: the same key, the same vertex, in all meshes of one scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum VertexKey {
    Corner(u32),
    Side { id: u32, step: u32 },
    Inside { triangle: u32, i: u32, j: u32 },
}

/// The vertices of a mesh.
#[derive(Clone, Default)]
pub(crate) struct Vertices {
    /// What each vertex is.
    pub keys: Vec<VertexKey>,
    /// Where it is, scene unit.
    pub positions: Vec<DVec3>,
    /// A triangle that each lies in, and its barycentric position there: weights of the second and
    /// third corner.
    pub barycentric: Vec<(usize, [f64; 2])>,
    /// The three at the corners of each element.
    pub corners: Vec<[u32; 3]>,
    /// All around each element.
    pub outlines: ElementLoops,
    index: FxHashMap<VertexKey, u32>,
}

/// The vertices around each element: its corners, and what finer neighbours put between them.
#[derive(Clone, Default)]
pub(crate) struct ElementLoops {
    ends: Vec<usize>,
    vertices: Vec<u32>,
}

impl ElementLoops {
    /// Adds the rim of one more element.
    pub fn push(&mut self, add: impl FnOnce(&mut Vec<u32>)) {
        add(&mut self.vertices);
        self.ends.push(self.vertices.len());
    }

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
    pub fn new(mesh: &Mesh, smooth: &SurfaceTopology) -> Vertices {
        let mut out = Vertices::default();
        (0..mesh.element_count()).for_each(|e| out.add_corners(mesh, smooth, e));
        let mut rims = ElementLoops::default();
        for e in 0..mesh.element_count() {
            rims.push(|rim| out.outline(mesh, smooth, e, rim, &mut |_, _, _| None));
        }
        out.outlines = rims;
        out
    }

    /// The vertex with this key.
    pub fn index_of(&self, key: &VertexKey) -> Option<u32> {
        self.index.get(key).copied()
    }

    fn add_corners(&mut self, mesh: &Mesh, smooth: &SurfaceTopology, e: usize) {
        let node = mesh.element(e);
        let t = mesh.triangle(node);
        self.corners.push(lattice(mesh.cell(node)).map(|place| {
            let key = key(smooth, t, place);
            *self.index.entry(key).or_insert_with(|| {
                self.keys.push(key);
                self.positions.push(position(mesh.scene(), smooth, t, place));
                self.barycentric.push((t, place.map(share)));
                self.positions.len() as u32 - 1
            })
        }));
    }

    /// Adds the vertices around element `e` to `rim`: its corners, and those between them, midpoints
    /// of midpoints for as long as there are any. Where there is none, `missing` is asked for one,
    /// given the key, the position and the vertices that it lies between.
    pub fn outline(
        &self,
        mesh: &Mesh,
        smooth: &SurfaceTopology,
        e: usize,
        rim: &mut Vec<u32>,
        missing: &mut impl FnMut(VertexKey, &dyn Fn() -> DVec3, [u32; 2]) -> Option<u32>,
    ) {
        let node = mesh.element(e);
        let t = mesh.triangle(node);
        let places = lattice(mesh.cell(node));
        // What lies between two places, in order: the latest part first.
        let mut open = vec![];
        for k in 0..3 {
            let end = |k: usize| (places[k], self.corners[e][k]);
            open.push((end(k), end((k + 1) % 3)));
            while let Some((a, b)) = open.pop() {
                let half = middle(a.0, b.0).and_then(|place| {
                    let key = key(smooth, t, place);
                    let at = || position(mesh.scene(), smooth, t, place);
                    let vertex = self.index_of(&key).or_else(|| missing(key, &at, [a.1, b.1]));
                    vertex.map(|v| (place, v))
                });
                match half {
                    Some(half) => open.extend([(half, b), (a, half)]),
                    None => rim.push(a.1),
                }
            }
        }
    }
}

/// The vertices at the corners of a cell of triangle `t`.
pub(crate) fn corner_keys(smooth: &SurfaceTopology, t: usize, cell: Cell) -> [VertexKey; 3] {
    lattice(cell).map(|place| key(smooth, t, place))
}

/// The vertices that splitting a cell of triangle `t` makes: in the middle of the sides from its
/// first to its second corner, and so on. None at the finest level.
pub(crate) fn midside_keys(
    smooth: &SurfaceTopology,
    t: usize,
    cell: Cell,
) -> Option<[VertexKey; 3]> {
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

fn share(steps: u32) -> f64 {
    f64::from(steps) / f64::from(FINEST)
}

/// Where a lattice point of triangle `t` is. On a side that does not depend, bit for bit, on the
/// triangle that asks.
fn position(scene: &Scene, smooth: &SurfaceTopology, t: usize, [i, j]: [u32; 2]) -> DVec3 {
    let corners = scene.corners(t);
    let side = |k: usize, step: u32| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (from, to, step) =
            if smooth.sides[t][k].reversed { (b, a, FINEST - step) } else { (a, b, step) };
        from * (1.0 - share(step)) + to * share(step)
    };
    match (i, j) {
        (i, 0) => side(0, i),
        (i, j) if i + j == FINEST => side(1, j),
        (0, j) => side(2, FINEST - j),
        (i, j) => {
            let (u, v) = (share(i), share(j));
            corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v
        }
    }
}

fn key(smooth: &SurfaceTopology, triangle: usize, [i, j]: [u32; 2]) -> VertexKey {
    let corner = |k: usize| VertexKey::Corner(smooth.corners[triangle][k]);
    let side = |k: usize, step: u32| {
        let Side { id, reversed } = smooth.sides[triangle][k];
        VertexKey::Side { id, step: if reversed { FINEST - step } else { step } }
    };
    match (i, j) {
        (0, 0) => corner(0),
        (FINEST, 0) => corner(1),
        (0, FINEST) => corner(2),
        (i, 0) => side(0, i),
        (i, j) if i + j == FINEST => side(1, j),
        (0, j) => side(2, FINEST - j),
        (i, j) => VertexKey::Inside { triangle: triangle as u32, i, j },
    }
}
