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

use super::keys::{ElementLoops, MissingVertex, VertexKey, Vertices, by_task};
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
        let first = vertices.positions.len() as u32;
        // Numbered from the first of each task's own.
        let found = by_task(mesh.element_count(), |elements| {
            let (mut outlines, mut nodes) = (ElementLoops::default(), vec![]);
            let mut add_node = |missing: &MissingVertex| {
                if !on_edge(&missing.key).is_some_and(|point| occupied.contains(&point)) {
                    return None;
                }
                let (between, position) = (missing.between, (missing.position)());
                nodes.push(HangingNode { between, position });
                Some(first + nodes.len() as u32 - 1)
            };
            for e in elements {
                outlines.push(|outline| {
                    vertices.add_outline(mesh, topology, e, outline, &mut add_node);
                });
            }
            (outlines, nodes)
        });
        let mut all = HangingNodes { outlines: ElementLoops::default(), nodes: vec![] };
        for (outlines, nodes) in found {
            let before = all.nodes.len() as u32;
            let number = |v: u32| if v < first { v } else { before + v };
            all.outlines.append(&outlines.renumbered(number));
            all.nodes.extend(
                nodes
                    .into_iter()
                    .map(|node| HangingNode { between: node.between.map(number), ..node }),
            );
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::scene::{Material, Scene, Triangle};

    #[test]
    fn nodes_are_numbered_from_task_to_task() {
        // Walls along two sides of a ground; all three are surfaces of their own.
        let positions = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 1.0],
            [0.0, 1.0, 1.0],
        ];
        let square = |group: u32, [a, b, c, d]: [u32; 4]| {
            let smoothing = Some(group + 1);
            let triangle = |corners| Triangle { corners, group, smoothing, ..Default::default() };
            [triangle([a, b, c]), triangle([a, c, d])]
        };
        let triangles =
            [square(0, [0, 1, 2, 3]), square(1, [0, 4, 5, 1]), square(2, [3, 2, 6, 7])].concat();
        let scene = Scene::new(
            positions.map(DVec3::from_array).to_vec(),
            triangles,
            ["ground", "wall", "other wall"].map(String::from).to_vec(),
            vec![Material::grey("grey", 0.5)],
        );
        // Diagonals of 1.4 in 64: 4^6 elements a triangle. The ground is twice as fine.
        let mesh = Mesh::new(Arc::new(scene.unwrap()), 1.5 / 64.0).unwrap();
        let elements = 0..mesh.element_count();
        let of_ground: Vec<usize> =
            elements.filter(|&e| mesh.group(mesh.element(e)) == 0).collect();
        let mesh = mesh.split(&of_ground).unwrap();
        let topology = SurfaceTopology::new(mesh.scene());
        let vertices = Vertices::new(&mesh, &topology);
        let HangingNodes { outlines, nodes } = HangingNodes::new(&mesh, &topology, &vertices);
        assert_eq!(nodes.len(), 2 * 64);
        let first = vertices.positions.len();
        let position = |v: u32| match (v as usize).checked_sub(first) {
            Some(k) => nodes[k].position,
            None => vertices.positions[v as usize],
        };
        for node in &nodes {
            let [a, b] = node.between.map(position);
            assert_eq!(node.position, (a + b) / 2.0);
        }
        // Each is on the outline of one element, between its ends.
        let on_outlines = outlines.iter().flat_map(|(_, outline)| outline.iter().copied());
        let mut found: Vec<u32> = on_outlines.filter(|&v| v as usize >= first).collect();
        found.sort_unstable();
        assert!(found.into_iter().eq(first as u32..(first + nodes.len()) as u32));
        for (_, outline) in outlines.iter() {
            for (k, &v) in outline.iter().enumerate().filter(|(_, v)| **v as usize >= first) {
                let beside = [
                    outline[(k + outline.len() - 1) % outline.len()],
                    outline[(k + 1) % outline.len()],
                ];
                let [a, b] = beside.map(position);
                assert_eq!(position(v), (a + b) / 2.0);
            }
        }
    }
}
