//! Quadtrees on triangles: elements receive, patches shoot.
//!
//! Every scene triangle carries a quadtree of midpoint splits. Its leaves are *elements*; any node
//! is a *patch*, which shoots for all elements below it. Elements are numbered depth first, so that
//! a patch is one contiguous range of elements, however unequal the depths below it:
//!
//! ```text
//!          ╱╲                 triangle: a patch of elements 0 to 6
//!         ╱5 ╲                ├─ part at the first corner: a patch of elements 0 to 3
//!        ╱────╲               │  └─ elements 0 to 3
//!       ╱╲ 6  ╱╲              ├─ element 4, at the second corner
//!      ╱──╲  ╱  ╲             ├─ element 5, at the third corner
//!     ╱_╲╱_╲╱__4_╲            └─ element 6, the middle part, which is turned over
//! ```
//!
//! Above the triangle, neighbours with similar normals form clusters (`mesh/clusters.rs`). Nodes
//! are numbered: first the roots, one per triangle, then four consecutive children at a time.

mod box_overlap;
mod clusters;
mod contact_cuts;
mod contacts;
mod fingerprint;
mod large_triangles;
mod quadtree;
pub(crate) mod sizing;
mod solid_areas;
mod textured;
mod topology;
mod transmission;

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorKind};
use crate::scene::{Facets, Material, Rgb, Scene, longest_edge};
pub(crate) use clusters::Clusters;
pub(crate) use contact_cuts::cut_at_contacts;
pub(crate) use large_triangles::cut_large_triangles;
pub(crate) use quadtree::Cell;
pub(crate) use sizing::ElementSizing;
pub(crate) use topology::{Side, SurfaceTopology};
pub(crate) use transmission::{Passage, Transmission};

/// A node of a quadtree: an index that is valid for the [`Mesh`] it came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct NodeId(pub(crate) u32);

#[derive(Clone, Copy, Debug)]
struct Node {
    triangle: u32,
    cell: Cell,
    first_element: u32,
    element_count: u32,
    /// First of four consecutive children, or `LEAF`.
    children: u32,
}

/// [`Node::children`] of an element.
const LEAF: u32 = u32::MAX;

impl Node {
    /// A node without children or elements yet.
    fn leaf(triangle: u32, cell: Cell) -> Node {
        Node { triangle, cell, first_element: 0, element_count: 0, children: LEAF }
    }
}

/// A scene cut into elements.
#[derive(Clone, Debug)]
pub struct Mesh {
    scene: Arc<Scene>,
    trees: Arc<Quadtrees>,
    facets: Arc<Facets>,
    /// Built on first use.
    clusters: Arc<OnceLock<Clusters>>,
    /// See [`Mesh::reflectance`]; empty without textures. Built on first use.
    textured_reflectances: Arc<OnceLock<Vec<Rgb>>>,
    /// See [`Mesh::solid_area`]; empty without holes. Built on first use.
    solid_shares: Arc<OnceLock<Vec<f64>>>,
}

/// The quadtrees on all triangles of a scene.
#[derive(Clone, Debug)]
struct Quadtrees {
    /// The roots, one a triangle, before all others.
    nodes: Vec<Node>,
    /// Node of each element.
    elements: Vec<NodeId>,
    /// Deepest level in each triangle.
    depths: Vec<u32>,
}

impl Quadtrees {
    /// The roots alone, without elements, for so many triangles.
    fn of_roots(triangles: usize) -> Quadtrees {
        Quadtrees {
            nodes: (0..triangles as u32).map(|t| Node::leaf(t, Cell::ROOT)).collect(),
            elements: Vec::with_capacity(triangles),
            depths: vec![0; triangles],
        }
    }

    /// Builds the subtree of node `n`, and numbers its elements. `children_of` returns the data
    /// known of a node's children, given the node and its own data; none if it has no children.
    fn build_subtree<T: Copy>(
        &mut self,
        n: usize,
        known: T,
        children_of: &impl Fn(&Node, T) -> Option<[T; 4]>,
    ) {
        let Node { triangle, cell, .. } = self.nodes[n];
        let first_element = self.elements.len() as u32;
        self.nodes[n].first_element = first_element;
        if let Some(known) = children_of(&self.nodes[n], known) {
            let children = self.nodes.len();
            self.nodes[n].children = children as u32;
            self.nodes.extend(cell.children().map(|child| Node::leaf(triangle, child)));
            for (child, known) in (children..).zip(known) {
                self.build_subtree(child, known, children_of);
            }
        } else {
            let depth = &mut self.depths[triangle as usize];
            *depth = cell.level.max(*depth);
            self.elements.push(NodeId(n as u32));
        }
        self.nodes[n].element_count = self.elements.len() as u32 - first_element;
    }
}

impl Mesh {
    /// Maximum number of levels of subdivision of a triangle: 4¹² elements.
    pub const MAX_DEPTH: u32 = 12;

    /// Maximum number of elements of a mesh: keeps element numbers within 32 bits, and all data per
    /// element within some gigabytes.
    pub const MAX_ELEMENTS: usize = 1 << 26;

    /// Angle between the normals of neighbouring triangles of one smoothing group, degrees, above
    /// which they meet in a crease: radiosity jumps there, whatever the shading. Neighbours without
    /// a known smoothing group use this angle or, in a bake to an error, one small enough that
    /// interpolation across the side stays within the error. Plain choice; no measurement was kept.
    pub const CREASE_DEGREES: f64 = 40.0;

    /// The same angle for all other neighbouring triangles, in two smoothing groups or in none: no
    /// crease between triangles of a polygon that is flat but for the rounding of its coordinates
    /// in a file.
    pub const COPLANAR_DEGREES: f64 = 1.0;

    /// Splits every triangle of `scene` until no element edge is longer than `element_size` (in
    /// the scene's length unit; infinity splits nothing).
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `element_size` is not above zero, or when it asks for more than
    /// [`Mesh::MAX_DEPTH`] splits of a triangle or [`Mesh::MAX_ELEMENTS`] elements.
    pub fn new(scene: impl Into<Arc<Scene>>, element_size: f64) -> Result<Mesh, Error> {
        let scene = scene.into();
        let place = || format!("element size {element_size}");
        if element_size.is_nan() || element_size <= 0.0 {
            let remedy = "must be a length above 0, in the scene's unit";
            return Err(Error::new(ErrorKind::Setting, place(), "not above 0", remedy));
        }
        let triangles = 0..scene.triangles().len();
        let longest = |t: usize| longest_edge(scene.corners(t));
        let depths: Vec<u32> = triangles
            .clone()
            .map(|t| {
                // Rounding must not cost a level where the edge is a power of two times the size.
                let splits = libm::log2(longest(t) / element_size * (1.0 - 1e-12)).ceil();
                splits.clamp(0.0, 64.0) as u32
            })
            .collect();
        let wanted: f64 = depths.iter().map(|&d| 4f64.powi(d as i32)).sum();
        let deepest = depths.iter().copied().max().unwrap_or(0);
        if deepest > Mesh::MAX_DEPTH || wanted > Mesh::MAX_ELEMENTS as f64 {
            let size = triangles.map(longest).fold(0.0, f64::max) / 64.0;
            return Err(Error::new(
                ErrorKind::Setting,
                place(),
                format!("asks for {wanted:.3e} elements and {deepest} splits of a triangle"),
                format!(
                    "at most {} and {}; {size:.3} would split 6 times at most",
                    Mesh::MAX_ELEMENTS,
                    Mesh::MAX_DEPTH
                ),
            ));
        }
        Ok(Mesh::refined_where(scene, |t, cell| cell.level < depths[t]))
    }

    /// Splits every triangle as long as `is_inner` returns true for the triangle and a cell of it.
    fn refined_where(scene: Arc<Scene>, is_inner: impl Fn(usize, Cell) -> bool) -> Mesh {
        let count = scene.triangles().len();
        let mut trees = Quadtrees::of_roots(count);
        for root in 0..count {
            trees.build_subtree(root, (), &|node, ()| {
                is_inner(node.triangle as usize, node.cell).then_some([(); 4])
            });
        }
        trees.nodes.shrink_to_fit();
        trees.elements.shrink_to_fit();
        Mesh {
            trees: Arc::new(trees),
            facets: scene.facets(),
            clusters: Arc::default(),
            textured_reflectances: Arc::default(),
            solid_shares: Arc::default(),
            scene,
        }
    }

    /// The same scene with each of `elements` split into four more.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when one of them is [`Mesh::MAX_DEPTH`] levels deep, or when there
    /// would be more than [`Mesh::MAX_ELEMENTS`].
    pub fn split(&self, elements: &[usize]) -> Result<Mesh, Error> {
        if elements.is_empty() {
            return Ok(self.clone());
        }
        let wanted = self.element_count() + 3 * elements.len();
        let deep = |&&e: &&usize| self.cell(self.element(e)).level >= Mesh::MAX_DEPTH;
        if wanted > Mesh::MAX_ELEMENTS || elements.iter().any(|e| deep(&e)) {
            let found =
                format!("{wanted} elements, or one with {} levels above it", Mesh::MAX_DEPTH);
            let remedy =
                format!("at most {} elements and {} splits", Mesh::MAX_ELEMENTS, Mesh::MAX_DEPTH);
            return Err(Error::new(ErrorKind::Setting, "mesh to be split", found, remedy));
        }
        let mut is_split = vec![false; self.element_count()];
        elements.iter().for_each(|&e| is_split[e] = true);
        let triangles = self.trees.depths.len();
        let mut split = Quadtrees::of_roots(triangles);
        split.nodes.reserve_exact(4 * elements.len() + self.trees.nodes.len() - triangles);
        split.elements.reserve_exact(wanted);
        for root in 0..triangles {
            // A cell of the old mesh is split as it was, or if requested; a new one is not.
            split.build_subtree(root, Some(root), &|_, old: Option<usize>| {
                let Node { children, first_element, .. } = self.trees.nodes[old?];
                if children != LEAF {
                    return Some([0, 1, 2, 3].map(|k| Some(children as usize + k)));
                }
                is_split[first_element as usize].then_some([None; 4])
            });
        }
        Ok(Mesh {
            trees: Arc::new(split),
            textured_reflectances: Arc::default(),
            solid_shares: Arc::default(),
            ..self.clone()
        })
    }

    /// The same elements in another `scene`: one whose materials, or positions of triangles, have
    /// changed. Clusters of triangles are kept.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when `scene` has another number of triangles.
    pub fn with_scene(&self, scene: impl Into<Arc<Scene>>) -> Result<Mesh, Error> {
        let scene = scene.into();
        let (count, wanted) = (scene.triangles().len(), self.scene.triangles().len());
        if count != wanted {
            let found = format!("{count} triangles with area");
            let remedy = format!("must be the {wanted} of the scene that it takes the place of");
            return Err(Error::new(ErrorKind::Scene, "changed scene", found, remedy));
        }
        self.clusters();
        let facets = scene.facets();
        let (textured_reflectances, solid_shares) = (Arc::default(), Arc::default());
        Ok(Mesh { scene, facets, textured_reflectances, solid_shares, ..self.clone() })
    }

    /// Clusters of triangles.
    pub(crate) fn clusters(&self) -> &Clusters {
        self.clusters.get_or_init(|| Clusters::new(&self.scene))
    }

    /// Whether elements of `other` have the same positions in the same triangles.
    pub(crate) fn has_elements_of(&self, other: &Mesh) -> bool {
        let places = |mesh: &Mesh, e: usize| {
            let node = mesh.node(mesh.element(e));
            (mesh.element(e), node.triangle, node.cell)
        };
        let count = self.element_count();
        count == other.element_count() && (0..count).all(|e| places(self, e) == places(other, e))
    }

    /// Whether `node` is one of this mesh.
    pub(crate) fn contains(&self, node: NodeId) -> bool {
        (node.0 as usize) < self.trees.nodes.len()
    }

    /// The scene of the mesh.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The same, to be shared.
    pub fn shared_scene(&self) -> Arc<Scene> {
        self.scene.clone()
    }

    /// Number of nodes of all quadtrees.
    pub(crate) fn node_count(&self) -> usize {
        self.trees.nodes.len()
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.trees.elements.len()
    }

    /// The quadtree leaf that is element `e`.
    pub fn element(&self, e: usize) -> NodeId {
        self.trees.elements[e]
    }

    /// The elements below `node`, as one range.
    pub fn elements_of(&self, node: NodeId) -> Range<usize> {
        let n = self.node(node);
        n.first_element as usize..(n.first_element + n.element_count) as usize
    }

    /// The root of triangle `t`'s quadtree.
    pub fn root(&self, t: usize) -> NodeId {
        debug_assert!(t < self.trees.depths.len());
        NodeId(t as u32)
    }

    /// The four parts of `node`, or `None` for an element.
    pub fn children(&self, node: NodeId) -> Option<[NodeId; 4]> {
        let first = self.node(node).children;
        (first != LEAF).then(|| [0, 1, 2, 3].map(|k| NodeId(first + k)))
    }

    /// The four parts of the node that `node` is a part of, itself among them; none of a root.
    pub(crate) fn siblings(&self, node: NodeId) -> Option<[NodeId; 4]> {
        let first = node.0 - self.place_in_parent(node)? as u32;
        Some([0, 1, 2, 3].map(|k| NodeId(first + k)))
    }

    /// Index of `node` among the four parts of its parent; none for a root.
    pub(crate) fn place_in_parent(&self, node: NodeId) -> Option<usize> {
        node.0.checked_sub(self.trees.depths.len() as u32).map(|k| (k % 4) as usize)
    }

    /// The element at corner `k` of `node`, whose own corner `k` it is.
    pub(crate) fn element_at_corner(&self, node: NodeId, k: usize) -> usize {
        let mut node = self.node(node);
        while node.children != LEAF {
            node = self.node(NodeId(node.children + k as u32));
        }
        node.first_element as usize
    }

    /// The scene triangle that `node` lies in.
    pub fn triangle(&self, node: NodeId) -> usize {
        self.node(node).triangle as usize
    }

    /// Area of `node`, holes included, length unit squared.
    pub fn area(&self, node: NodeId) -> f64 {
        let n = self.node(node);
        self.facets.areas[n.triangle as usize] / f64::from(1u32 << (2 * n.cell.level))
    }

    /// Area of all elements that scatter light, length unit squared.
    pub(crate) fn scattering_area(&self) -> f64 {
        let elements = self.trees.elements.iter().filter(|&&node| self.material(node).scatters());
        elements.map(|&node| self.solid_area(node)).sum()
    }

    /// Mean albedo by area of the elements that scatter light, per channel; 0 if none does. Black
    /// elements are left out, since a black sky around a scene does not make the scene darker.
    pub(crate) fn mean_albedo(&self) -> Rgb {
        let scattering = |(e, &node): (usize, &NodeId)| self.albedo(e) * self.solid_area(node);
        let area = self.scattering_area().max(f64::MIN_POSITIVE);
        self.trees.elements.iter().enumerate().map(scattering).sum::<Rgb>() / area
    }

    /// Unit normal of `node`, on its front.
    pub fn normal(&self, node: NodeId) -> DVec3 {
        self.facets.normals[self.triangle(node)]
    }

    /// Corners of `node`, counter-clockwise from the front.
    pub fn corners(&self, node: NodeId) -> [DVec3; 3] {
        let n = self.node(node);
        cell_corners(self.scene.corners(n.triangle as usize), n.cell)
    }

    /// Longest edge of `node`, scene unit.
    pub fn longest_edge(&self, node: NodeId) -> f64 {
        longest_edge(self.corners(node))
    }

    /// Centroid of `node`.
    pub fn centroid(&self, node: NodeId) -> DVec3 {
        let [a, b, c] = self.corners(node);
        a + ((b - a) + (c - a)) / 3.0
    }

    /// Material of `node`.
    pub fn material(&self, node: NodeId) -> &Material {
        self.scene.material(self.triangle(node))
    }

    /// Group of `node`, by its index in the scene.
    pub(crate) fn group(&self, node: NodeId) -> u32 {
        self.scene.triangles()[self.triangle(node)].group
    }

    /// The element at barycentric position (`u`, `v`), weights of the second and third corner, of
    /// triangle `t`, and the same position in the element. Positions outside the triangle go to the
    /// nearest element along the axes.
    pub fn element_at(&self, t: usize, u: f64, v: f64) -> (usize, [f64; 2]) {
        let mut node = self.node(self.root(t));
        let [mut u, mut v] = [u, v];
        while node.children != LEAF {
            (u, v) = (2.0 * u, 2.0 * v);
            let child = match (u > 1.0, v > 1.0, u + v > 1.0) {
                (true, ..) => 1,
                (_, true, _) => 2,
                (.., true) => 3,
                _ => 0,
            };
            (u, v) = match child {
                1 => (u - 1.0, v),
                2 => (u, v - 1.0),
                3 => (1.0 - u, 1.0 - v),
                _ => (u, v),
            };
            node = self.node(NodeId(node.children + child));
        }
        (node.first_element as usize, [u, v])
    }

    /// Deepest level of triangle `t`'s quadtree.
    pub(crate) fn depth(&self, t: usize) -> u32 {
        self.trees.depths[t]
    }

    /// The cell of `node` in its triangle.
    pub(crate) fn cell(&self, node: NodeId) -> Cell {
        self.node(node).cell
    }

    fn node(&self, id: NodeId) -> &Node {
        &self.trees.nodes[id.0 as usize]
    }
}

/// Corners of `cell` in the triangle with corners `a`, `b`, `c`, scene unit.
fn cell_corners([a, b, c]: [DVec3; 3], cell: Cell) -> [DVec3; 3] {
    // Weights that sum to one exactly, so that corners of the triangle are reproduced exactly.
    cell.corners().map(|[u, v]| a * (1.0 - u - v) + b * u + c * v)
}
