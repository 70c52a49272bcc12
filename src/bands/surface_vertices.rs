//! Extends values at the vertices of a mesh to the additional vertices of its surface: hanging
//! nodes and the centres of fans, each the mean of others.

use crate::mesh::{Mesh, SurfaceTopology};
use crate::vertex::hanging_nodes::HangingNodes;
use crate::vertex::keys::Vertices;

/// The vertices of a mesh and, in the order of [`VertexMesh`](crate::VertexMesh), the additional
/// ones.
pub(super) struct SurfaceVertices {
    pub vertices: Vertices,
    /// For each additional vertex the preceding vertices whose mean it is.
    beside: Vec<Vec<u32>>,
}

impl SurfaceVertices {
    pub fn new(mesh: &Mesh) -> SurfaceVertices {
        let topology = SurfaceTopology::of_scene(mesh.scene());
        let vertices = Vertices::new(mesh, &topology);
        let hanging = HangingNodes::new(mesh, &topology, &vertices);
        let nodes = hanging.nodes.iter().map(|node| node.between.to_vec());
        let fans = hanging.outlines.iter().filter(|(_, outline)| outline.len() != 3);
        let centres = fans.map(|(e, _)| vertices.corners[e].to_vec());
        let beside = nodes.chain(centres).collect();
        SurfaceVertices { vertices, beside }
    }

    /// Number of vertices of the surface.
    pub fn count(&self) -> usize {
        self.vertices.positions.len() + self.beside.len()
    }

    /// Appends to `values` of the mesh's vertices, `count` of each side by side, those of
    /// additional ones.
    pub fn extend(&self, values: &mut Vec<f64>, count: usize) {
        for others in &self.beside {
            for k in 0..count {
                let sum: f64 = others.iter().map(|&v| values[v as usize * count + k]).sum();
                values.push(sum / others.len() as f64);
            }
        }
    }
}
