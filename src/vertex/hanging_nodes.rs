//! Where surfaces meet in a crease: each takes the places that the others have on the edge they
//! share, so that the mesh is watertight wherever the scene is.

use glam::DVec3;
use rustc_hash::FxHashSet;

use super::keys::{ElementLoops, VertexKey, Vertices};
use crate::mesh::{Mesh, SurfaceTopology};

/// The vertices that creases ask for beside those of the smooth surfaces.
pub(crate) struct HangingNodes {
    /// All around each element.
    pub rims: ElementLoops,
    /// Numbered after the vertices of the smooth surfaces, in this order.
    pub vertices: Vec<HangingNode>,
}

/// A vertex half-way between two others: what it has is their mean, so the surface stays as it is.
pub(crate) struct HangingNode {
    pub between: [u32; 2],
    /// Scene unit; the same bits as on the other surfaces.
    pub position: DVec3,
}

impl HangingNodes {
    pub fn new(mesh: &Mesh, smooth: &SurfaceTopology, vertices: &Vertices) -> HangingNodes {
        let edge = |id: u32| smooth.edges[id as usize / 3][id as usize % 3];
        let on_edge = |key: &VertexKey| match *key {
            VertexKey::Side { id, step } => Some((edge(id), step)),
            _ => None,
        };
        let places: FxHashSet<(u32, u32)> = vertices.keys.iter().filter_map(on_edge).collect();
        let (mut rims, mut seams) = (ElementLoops::default(), vec![]);
        for e in 0..mesh.element_count() {
            let mut add = |key: VertexKey, position: &dyn Fn() -> DVec3, between: [u32; 2]| {
                let taken = on_edge(&key).is_some_and(|place| places.contains(&place));
                taken.then(|| {
                    seams.push(HangingNode { between, position: position() });
                    (vertices.positions.len() + seams.len() - 1) as u32
                })
            };
            rims.push(|rim| vertices.outline(mesh, smooth, e, rim, &mut add));
        }
        HangingNodes { rims, vertices: seams }
    }
}
