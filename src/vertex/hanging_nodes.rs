//! Hanging nodes where surfaces meet in a crease.
//!
//! Vertices of one smooth surface are shared (see [`keys`](super::keys)), so a finer neighbour's
//! vertices are on the outline of a coarser element. Across a crease each surface has vertices of
//! its own, and where their subdivisions differ, the finer one has vertices inside sides of the
//! coarser: T-junctions, which crack under interpolation. Each surface therefore gets a vertex
//! wherever another one has one on an edge that they share, so that the mesh is watertight wherever
//! the scene is.

use glam::DVec3;
use rustc_hash::FxHashSet;

use super::keys::{ElementLoops, MissingVertex, VertexKey, Vertices};
use crate::mesh::{Mesh, SurfaceTopology};

/// The vertices that creases need beside those of the smooth surfaces.
pub(crate) struct HangingNodes {
    /// All vertices around each element, hanging nodes included.
    pub outlines: ElementLoops,
    /// The hanging nodes. Their indices follow those of the vertices of the smooth surfaces.
    pub nodes: Vec<HangingNode>,
}

/// A vertex half-way between two others. Its value is their mean, which interpolation has there.
pub(crate) struct HangingNode {
    /// Vertices or hanging nodes before it.
    pub between: [u32; 2],
    /// Position, scene unit; the same bits as on the other surfaces.
    pub position: DVec3,
}

impl HangingNodes {
    /// Finds the hanging nodes of `mesh`, with smooth surfaces `topology` and their `vertices`.
    pub fn new(mesh: &Mesh, topology: &SurfaceTopology, vertices: &Vertices) -> HangingNodes {
        // An edge of the scene, and steps along it: the same for all surfaces that meet there.
        let on_edge = |key: &VertexKey| match *key {
            VertexKey::Side { id, step } => {
                Some((topology.edges[id as usize / 3][id as usize % 3], step))
            }
            _ => None,
        };
        let occupied: FxHashSet<(u32, u32)> = vertices.keys.iter().filter_map(on_edge).collect();
        let mut outlines = ElementLoops::default();
        let mut nodes = vec![];
        let mut add_node = |missing: &MissingVertex| {
            if !on_edge(&missing.key).is_some_and(|point| occupied.contains(&point)) {
                return None;
            }
            nodes.push(HangingNode { between: missing.between, position: (missing.position)() });
            Some((vertices.positions.len() + nodes.len() - 1) as u32)
        };
        for e in 0..mesh.element_count() {
            outlines.push(|outline| {
                vertices.add_outline(mesh, topology, e, outline, &mut add_node);
            });
        }
        HangingNodes { outlines, nodes }
    }
}
