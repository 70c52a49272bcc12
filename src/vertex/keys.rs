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
use std::sync::atomic::{AtomicU32, Ordering};

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

/// Elements of a parallel task; results do not depend on it.
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
}

/// A place where an element's outline could have a vertex, but the mesh has none.
pub(crate) struct MissingVertex<'a> {
    pub key: VertexKey,
    /// Gives its position, scene unit.
    pub position: &'a dyn Fn() -> DVec3,
    /// The vertices of the outline that it lies half-way between.
    pub between: [u32; 2],
}

/// In the place of a vertex's number: it has none yet.
const UNNUMBERED: u32 = u32::MAX;

impl Vertices {
    /// The vertices of `mesh`, whose scene has the smooth surfaces `topology`.
    pub fn new(mesh: &Mesh, topology: &SurfaceTopology) -> Vertices {
        let mut vertices = Vertices::default();
        vertices.corners.reserve_exact(mesh.element_count());
        vertices.index = HashTable::with_capacity(mesh.element_count());
        for e in 0..mesh.element_count() {
            let node = mesh.element(e);
            let t = mesh.triangle(node);
            let corners = lattice_corners(mesh.cell(node));
            let corners = corners.map(|point| vertices.number(mesh, topology, (t, point)));
            vertices.corners.push(corners);
        }
        vertices.keys.shrink_to_fit();
        vertices.positions.shrink_to_fit();
        vertices.places.shrink_to_fit();
        vertices.outlines = outlines_of(mesh, |e, outline| {
            vertices.add_outline(mesh, topology, e, outline, &mut |_| None);
        });
        vertices
    }

    /// The vertices of `finer`, the mesh of these with each of `elements` (ascending) split into
    /// four: the same as by [`Vertices::new`], in the same order. And of each its number among
    /// these, none of a new one.
    pub fn split(
        &self,
        finer: &Mesh,
        topology: &SurfaceTopology,
        elements: &[usize],
    ) -> (Vertices, Vec<Option<u32>>) {
        let old_elements = self.old_elements(elements);
        let (mut corners, new) = self.split_corners(finer, topology, &old_elements);
        let old_count = self.keys.len();
        // They are numbered in the order in which the corners of elements name them.
        let count = old_count + new.keys.len();
        let naming = naming_corners(corners.as_flattened(), count);
        let by_number: Vec<u32> =
            naming.par_iter().map(|&corner| corners.as_flattened()[corner as usize]).collect();
        let mut numbers = vec![UNNUMBERED; count];
        for (number, &v) in (0..).zip(&by_number) {
            numbers[v as usize] = number;
        }
        corners.as_flattened_mut().par_iter_mut().for_each(|v| *v = numbers[*v as usize]);
        let places = naming.par_iter().map(|&corner| {
            let (t, point) = corner_place(finer, corner as usize / 3, corner as usize % 3);
            (t as u32, point)
        });
        let places: Vec<(u32, [u32; 2])> = places.collect();
        let key = |&v: &u32| match self.keys.get(v as usize) {
            Some(key) => *key,
            None => new.keys[v as usize - old_count],
        };
        let position = |(&v, &place): (&u32, &(u32, [u32; 2]))| match v as usize {
            // The first element of an old vertex may be in another triangle than before.
            v if v >= old_count => new.positions[v - old_count],
            v if self.places[v] == place => self.positions[v],
            _ => lattice_position(finer.scene(), topology, place.0 as usize, place.1),
        };
        let mut split = Vertices {
            keys: by_number.par_iter().map(key).collect(),
            positions: by_number.par_iter().zip(&places).map(position).collect(),
            places,
            corners,
            outlines: ElementLoops::default(),
            index: self.index.clone(),
        };
        split.index.iter_mut().for_each(|v| *v = numbers[*v as usize]);
        numbers[old_count..].iter().for_each(|&v| split.add_to_index(v));
        let mut is_at_split = vec![false; old_count];
        let at_split = elements.iter().flat_map(|&e| self.corners[e]);
        at_split.for_each(|v| is_at_split[v as usize] = true);
        split.outlines = outlines_of(finer, |f, outline| {
            match old_elements[f].and_then(|e| self.kept_outline(e, &is_at_split)) {
                Some(old) => outline.extend(old.iter().map(|&v| numbers[v as usize])),
                None => split.add_outline(finer, topology, f, outline, &mut |_| None),
            }
        });
        let old_number = |v: u32| Some(v).filter(|&v| (v as usize) < old_count);
        (split, by_number.into_par_iter().map(old_number).collect())
    }

    /// Of each element after `elements` (ascending) are split the element that it was; none of a
    /// part of one that is split.
    fn old_elements(&self, elements: &[usize]) -> Vec<Option<usize>> {
        let mut old_elements = Vec::with_capacity(self.corners.len() + 3 * elements.len());
        let mut elements = elements.iter().peekable();
        for e in 0..self.corners.len() {
            match elements.next_if_eq(&&e) {
                Some(_) => old_elements.extend([None; 4]),
                None => old_elements.push(Some(e)),
            }
        }
        old_elements
    }

    /// The vertices at the corners of the elements of `finer`, and the new ones among them: old
    /// ones have their old numbers, and new ones those from the number of old ones on.
    fn split_corners(
        &self,
        finer: &Mesh,
        topology: &SurfaceTopology,
        old_elements: &[Option<usize>],
    ) -> (Vec<[u32; 3]>, Vertices) {
        let old_corner = |f: usize, k: usize| {
            let (t, point) = corner_place(finer, f, k);
            self.index_of(&vertex_key(topology, t, point)).unwrap_or(UNNUMBERED)
        };
        let old_corners = |(f, old): (usize, &Option<usize>)| match old {
            Some(e) => self.corners[*e],
            None => [0, 1, 2].map(|k| old_corner(f, k)),
        };
        let mut corners: Vec<[u32; 3]> =
            old_elements.par_iter().enumerate().map(old_corners).collect();
        let mut new = Vertices::default();
        for (f, corners) in corners.iter_mut().enumerate() {
            for (k, v) in corners.iter_mut().enumerate().filter(|(_, v)| **v == UNNUMBERED) {
                let number = new.number(finer, topology, corner_place(finer, f, k));
                *v = self.keys.len() as u32 + number;
            }
        }
        (corners, new)
    }

    /// The outline of element `e`, if no vertex can have come into it: between two vertices of
    /// which one is at no split element there is no new one.
    fn kept_outline(&self, e: usize, is_at_split: &[bool]) -> Option<&[u32]> {
        let outline = self.outlines.of(e);
        let is_at_split = |k: usize| is_at_split[outline[k % outline.len()] as usize];
        let is_halved = (0..outline.len()).any(|k| is_at_split(k) && is_at_split(k + 1));
        (!is_halved).then_some(outline)
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

    /// The number of the vertex at a place, a triangle and a point of its lattice: of a new one if
    /// there is none.
    fn number(
        &mut self,
        mesh: &Mesh,
        topology: &SurfaceTopology,
        (t, point): (usize, [u32; 2]),
    ) -> u32 {
        let key = vertex_key(topology, t, point);
        self.index_of(&key).unwrap_or_else(|| {
            let v = self.keys.len() as u32;
            self.keys.push(key);
            self.positions.push(lattice_position(mesh.scene(), topology, t, point));
            self.places.push((t as u32, point));
            self.add_to_index(v);
            v
        })
    }

    fn add_to_index(&mut self, v: u32) {
        let hash_of = |v: &u32| hash(&self.keys[*v as usize]);
        self.index.insert_unique(hash_of(&v), v, hash_of);
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

/// The outlines of the elements of `mesh`, each appended by `add`.
fn outlines_of(mesh: &Mesh, add: impl Fn(usize, &mut Vec<u32>) + Sync) -> ElementLoops {
    let of_tasks = by_task(mesh.element_count(), |elements| {
        let mut loops = ElementLoops::default();
        elements.for_each(|e| loops.push(|outline| add(e, outline)));
        loops
    });
    let mut all = ElementLoops::default();
    of_tasks.iter().for_each(|loops| all.append(loops));
    all
}

/// What `work` makes of ranges of `elements` elements, in their order.
pub(super) fn by_task<T: Send>(elements: usize, work: impl Fn(Range<usize>) -> T + Sync) -> Vec<T> {
    let tasks = (0..elements.div_ceil(ELEMENTS_A_TASK)).into_par_iter();
    let range = |k: usize| k * ELEMENTS_A_TASK..elements.min((k + 1) * ELEMENTS_A_TASK);
    tasks.map(|k| work(range(k))).collect()
}

/// The indices in `corners`, ascending, that are the first to name one of so many `vertices`.
fn naming_corners(corners: &[u32], vertices: usize) -> Vec<u32> {
    let first: Vec<AtomicU32> = (0..vertices).map(|_| AtomicU32::new(u32::MAX)).collect();
    corners.par_iter().enumerate().for_each(|(k, &v)| {
        first[v as usize].fetch_min(k as u32, Ordering::Relaxed);
    });
    let all = (0..corners.len() as u32).into_par_iter();
    all.filter(|&k| first[corners[k as usize] as usize].load(Ordering::Relaxed) == k).collect()
}

fn hash(key: &VertexKey) -> u64 {
    FxBuildHasher.hash_one(key)
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

/// Corner `k` of element `e`: its triangle, and the point on its lattice.
fn corner_place(mesh: &Mesh, e: usize, k: usize) -> (usize, [u32; 2]) {
    let node = mesh.element(e);
    (mesh.triangle(node), lattice_corners(mesh.cell(node))[k])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    #[test]
    fn vertices_of_a_split_mesh_are_those_found_anew() {
        // Two walls and a floor of one smooth surface each, of unequal elements.
        let at = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let quads = [[0, 1, 3, 2], [0, 4, 5, 1], [0, 2, 6, 4]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
        let scene = Scene::new(
            (0..8).map(at).collect(),
            triangles.map(|corners| Triangle { corners, ..Default::default() }).collect(),
            vec!["walls".into()],
            vec![Material::grey("grey", 0.5)],
        );
        let mut mesh = Mesh::new(scene.unwrap(), 0.8).unwrap();
        let topology = SurfaceTopology::new(mesh.scene());
        let mut vertices = Vertices::new(&mesh, &topology);
        for round in 0..5 {
            let is_split = |&e: &usize| (e * 7 + round) % 5 < 2;
            let elements: Vec<usize> = (0..mesh.element_count()).filter(is_split).collect();
            let finer = mesh.split(&elements).unwrap();
            let (split, old_numbers) = vertices.split(&finer, &topology, &elements);
            let anew = Vertices::new(&finer, &topology);
            assert_eq!(split.keys, anew.keys);
            assert_eq!((&split.positions, &split.places), (&anew.positions, &anew.places));
            assert_eq!(split.corners, anew.corners);
            assert!(split.outlines.iter().eq(anew.outlines.iter()));
            assert!(split.outlines.iter().any(|(_, outline)| outline.len() > 3));
            for (v, (key, old)) in (0..).zip(split.keys.iter().zip(old_numbers)) {
                assert_eq!((split.index_of(key), old), (Some(v), vertices.index_of(key)));
            }
            (mesh, vertices) = (finer, split);
        }
    }
}
