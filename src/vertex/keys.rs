//! Vertices of a subdivided mesh, known by keys.
//!
//! All corners of all cells of a triangle's quadtree lie on one lattice of `Mesh::MAX_DEPTH`
//! halvings. A lattice point's key says what it is on the smooth surface, so that triangles that
//! share it agree, and so do meshes of one scene that are subdivided differently:
//!
//! ```text
//!     Corner(id)                 id: the corner's number on the smooth surface
//!        ●
//!       ╱ ╲   ● Side{id, step}   id: the side's number there; steps from its lower corner
//!      ╱ ● ╲                     Inside{triangle, i, j}: lattice coordinates
//!     ●─────●
//! ```
//!
//! The outline of an element is its corners and the vertices that finer neighbours put on its
//! sides, found by halving each side for as long as there is a vertex in the middle.

use std::hash::BuildHasher;
use std::ops::Range;

use glam::DVec3;
use hashbrown::HashTable;
use rayon::prelude::*;
use rustc_hash::FxBuildHasher;

use crate::mesh::{Cell, Mesh, Side, SurfaceTopology};
use crate::scene::Scene;

/// Steps along a triangle's side on the lattice of the finest subdivision.
const LATTICE_STEPS: u32 = 1 << Mesh::MAX_DEPTH;

/// Identity of a vertex: the same key is the same vertex, in all meshes of one scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum VertexKey {
    /// A corner of triangles, by its number on the smooth surface.
    Corner(u32),
    /// On a side of one or two triangles, so many lattice steps from its start.
    Side { id: u32, step: u32 },
    /// Inside a triangle, at lattice coordinates: steps towards its second and third corner.
    Inside { triangle: u32, i: u32, j: u32 },
}

/// The vertices of a mesh.
#[derive(Clone, Default)]
pub(crate) struct Vertices {
    /// Identity of each vertex.
    pub keys: Vec<VertexKey>,
    /// Position of each vertex, scene unit.
    pub positions: Vec<DVec3>,
    /// A triangle that each vertex lies in, and where on its lattice.
    places: Vec<(u32, [u32; 2])>,
    /// The vertices at the corners of each element.
    pub corners: Vec<[u32; 3]>,
    /// All vertices around each element.
    pub outlines: ElementLoops,
    /// The vertices by their keys.
    index: HashTable<u32>,
}

/// Elements whose vertices are found by one thread at a time. Chosen by hand.
const ELEMENTS_A_TASK: usize = 4096;

/// The vertices around each element, counter-clockwise: its corners, and those that finer
/// neighbours put between them.
#[derive(Clone, Default)]
pub(crate) struct ElementLoops {
    /// Where each element's vertices end in `vertices`.
    ends: Vec<u32>,
    vertices: Vec<u32>,
}

impl ElementLoops {
    /// Adds the loop of one more element, which `add` appends.
    pub fn push(&mut self, add: impl FnOnce(&mut Vec<u32>)) {
        add(&mut self.vertices);
        self.ends.push(self.vertices.len() as u32);
    }

    /// Adds the loops of further elements.
    pub fn append(&mut self, other: &ElementLoops) {
        let start = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.ends.extend(other.ends.iter().map(|end| start + end));
    }

    /// The same with other numbers of the vertices.
    pub fn renumbered(mut self, number: impl Fn(u32) -> u32) -> ElementLoops {
        for v in &mut self.vertices {
            *v = number(*v);
        }
        self
    }

    /// The vertices around element `e`.
    pub fn of(&self, e: usize) -> &[u32] {
        let start = if e == 0 { 0 } else { self.ends[e - 1] };
        &self.vertices[start as usize..self.ends[e] as usize]
    }

    /// Each element with the vertices around it.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &[u32])> {
        (0..self.ends.len()).map(|e| (e, self.of(e)))
    }

    /// The elements around each of `vertices` vertices, ascending.
    pub fn elements_around(&self, vertices: usize) -> Vec<Vec<u32>> {
        let mut around = vec![vec![]; vertices];
        for (e, outline) in self.iter() {
            for &v in outline {
                around[v as usize].push(e as u32);
            }
        }
        around
    }
}

/// A place where an element's outline could have a vertex, but the mesh has none.
pub(crate) struct MissingVertex<'a> {
    pub key: VertexKey,
    /// Gives its position, scene unit.
    pub position: &'a dyn Fn() -> DVec3,
    /// The vertices of the outline that it lies half-way between.
    pub between: [u32; 2],
}

impl Vertices {
    /// The vertices of `mesh`, whose scene has the smooth surfaces `topology`.
    pub fn new(mesh: &Mesh, topology: &SurfaceTopology) -> Vertices {
        let mut vertices = Vertices::default();
        vertices.corners.reserve_exact(mesh.element_count());
        for e in 0..mesh.element_count() {
            vertices.add_corners(mesh, topology, e);
        }
        vertices.keys.shrink_to_fit();
        vertices.positions.shrink_to_fit();
        vertices.places.shrink_to_fit();
        let loops = by_task(mesh.element_count(), |elements| {
            let mut loops = ElementLoops::default();
            for e in elements {
                loops.push(|outline| {
                    vertices.add_outline(mesh, topology, e, outline, &mut |_| None);
                });
            }
            loops
        });
        for loops in loops {
            vertices.outlines.append(&loops);
        }
        vertices
    }

    /// The index of the vertex with this key.
    pub fn index_of(&self, key: &VertexKey) -> Option<u32> {
        self.index.find(hash(key), |&v| self.keys[v as usize] == *key).copied()
    }

    /// A triangle that each vertex lies in, and its barycentric position there: the weights of the
    /// second and third corner.
    pub fn barycentric(&self) -> impl Iterator<Item = (usize, [f64; 2])> + '_ {
        self.places.iter().map(|&(t, point)| (t as usize, point.map(side_fraction)))
    }

    fn add_corners(&mut self, mesh: &Mesh, topology: &SurfaceTopology, e: usize) {
        let node = mesh.element(e);
        let t = mesh.triangle(node);
        let corners = lattice_corners(mesh.cell(node)).map(|point| {
            let key = vertex_key(topology, t, point);
            self.index_of(&key).unwrap_or_else(|| {
                let v = self.keys.len() as u32;
                self.keys.push(key);
                self.positions.push(lattice_position(mesh.scene(), topology, t, point));
                self.places.push((t as u32, point));
                self.index.insert_unique(hash(&key), v, |&v| hash(&self.keys[v as usize]));
                v
            })
        });
        self.corners.push(corners);
    }

    /// Adds the vertices around element `e` to `outline`: its corners, and those between them,
    /// midpoints of midpoints for as long as there are any. Where there is none, `missing` may give
    /// one.
    pub fn add_outline(
        &self,
        mesh: &Mesh,
        topology: &SurfaceTopology,
        e: usize,
        outline: &mut Vec<u32>,
        missing: &mut impl FnMut(&MissingVertex) -> Option<u32>,
    ) {
        let node = mesh.element(e);
        let t = mesh.triangle(node);
        let corners = lattice_corners(mesh.cell(node));
        let corner = |k: usize| (corners[k % 3], self.corners[e][k % 3]);
        // Pieces of the side that are still to be halved: the next along the side is the last.
        let mut pieces = vec![];
        for k in 0..3 {
            pieces.push((corner(k), corner(k + 1)));
            while let Some((a, b)) = pieces.pop() {
                let midpoint = lattice_midpoint(a.0, b.0).and_then(|point| {
                    let key = vertex_key(topology, t, point);
                    let position = || lattice_position(mesh.scene(), topology, t, point);
                    let vertex = self.index_of(&key).or_else(|| {
                        missing(&MissingVertex { key, position: &position, between: [a.1, b.1] })
                    });
                    vertex.map(|v| (point, v))
                });
                match midpoint {
                    Some(midpoint) => pieces.extend([(midpoint, b), (a, midpoint)]),
                    None => outline.push(a.1),
                }
            }
        }
    }
}

/// What `work` makes of ranges of `elements` elements, in their order.
pub(super) fn by_task<T: Send>(elements: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let tasks = (0..elements.div_ceil(ELEMENTS_A_TASK)).into_par_iter();
    let range = |k: usize| k * ELEMENTS_A_TASK..elements.min((k + 1) * ELEMENTS_A_TASK);
    tasks.map(|k| work(range(k))).collect()
}

fn hash(key: &VertexKey) -> u64 {
    FxBuildHasher.hash_one(key)
}

/// The keys of the corners of a cell of triangle `t`.
pub(crate) fn corner_keys(topology: &SurfaceTopology, t: usize, cell: Cell) -> [VertexKey; 3] {
    lattice_corners(cell).map(|point| vertex_key(topology, t, point))
}

/// The keys of the vertices that splitting a cell of triangle `t` makes: in the middle of the side
/// from its first to its second corner, and so on. None at the finest level.
pub(crate) fn midside_keys(
    topology: &SurfaceTopology,
    t: usize,
    cell: Cell,
) -> Option<[VertexKey; 3]> {
    let [a, b, c] = lattice_corners(cell);
    let key = |p, q| Some(vertex_key(topology, t, lattice_midpoint(p, q)?));
    Some([key(a, b)?, key(b, c)?, key(c, a)?])
}

/// The lattice point half-way between two; none between neighbours.
fn lattice_midpoint(a: [u32; 2], b: [u32; 2]) -> Option<[u32; 2]> {
    let distance = a[0].abs_diff(b[0]).max(a[1].abs_diff(b[1]));
    (distance >= 2).then(|| [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2])
}

/// Corners of `cell` on the finest lattice of its triangle.
fn lattice_corners(cell: Cell) -> [[u32; 2]; 3] {
    cell.lattice_corners().map(|c| c.map(|k| k * (LATTICE_STEPS >> cell.level)))
}

/// Lattice steps as a fraction of a triangle's side.
fn side_fraction(steps: u32) -> f64 {
    f64::from(steps) / f64::from(LATTICE_STEPS)
}

/// Position of a lattice point of triangle `t`, scene unit. On a side it is the same, bit for bit,
/// for both triangles that share the side.
fn lattice_position(
    scene: &Scene,
    topology: &SurfaceTopology,
    t: usize,
    [i, j]: [u32; 2],
) -> DVec3 {
    let corners = scene.corners(t);
    let on_side = |k: usize, step: u32| {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let (from, to, step) =
            if topology.sides[t][k].reversed { (b, a, LATTICE_STEPS - step) } else { (a, b, step) };
        from * (1.0 - side_fraction(step)) + to * side_fraction(step)
    };
    match (i, j) {
        (i, 0) => on_side(0, i),
        (i, j) if i + j == LATTICE_STEPS => on_side(1, j),
        (0, j) => on_side(2, LATTICE_STEPS - j),
        (i, j) => {
            let (u, v) = (side_fraction(i), side_fraction(j));
            corners[0] * (1.0 - u - v) + corners[1] * u + corners[2] * v
        }
    }
}

/// The key of a lattice point of `triangle`.
fn vertex_key(topology: &SurfaceTopology, triangle: usize, [i, j]: [u32; 2]) -> VertexKey {
    let corner = |k: usize| VertexKey::Corner(topology.corners[triangle][k]);
    let on_side = |k: usize, step: u32| {
        let Side { id, reversed } = topology.sides[triangle][k];
        VertexKey::Side { id, step: if reversed { LATTICE_STEPS - step } else { step } }
    };
    match (i, j) {
        (0, 0) => corner(0),
        (LATTICE_STEPS, 0) => corner(1),
        (0, LATTICE_STEPS) => corner(2),
        (i, 0) => on_side(0, i),
        (i, j) if i + j == LATTICE_STEPS => on_side(1, j),
        (0, j) => on_side(2, LATTICE_STEPS - j),
        (i, j) => VertexKey::Inside { triangle: triangle as u32, i, j },
    }
}
