//! The solid area of elements and patches: without holes.
//!
//! The solid area of a patch is the sum over its elements, so that no light is lost or added
//! between patches and the elements that they shoot for.

use glam::DVec3;

use super::{Mesh, NodeId};
use crate::sampling::low_discrepancy::{fold_to_triangle, r2_point};

impl Mesh {
    /// Area of `node` without its holes, length unit squared: the area used for light.
    pub fn solid_area(&self, node: NodeId) -> f64 {
        match self.solid_shares() {
            [] => self.area(node),
            shares => shares[node.0 as usize] * self.area(node),
        }
    }

    /// The fraction of `node` that is solid, in [0, 1].
    pub(crate) fn solid_share(&self, node: NodeId) -> f64 {
        self.solid_shares().get(node.0 as usize).copied().unwrap_or(1.0)
    }

    /// Whether light that arrives at `node` is scattered: it is neither a hole nor black.
    pub(crate) fn scatters(&self, node: NodeId) -> bool {
        self.material(node).scatters() && self.solid_share(node) > 0.0
    }

    /// Weight of `node` in means over elements around a vertex: its solid area, and nearly 0 for a
    /// hole.
    pub(crate) fn weight(&self, node: NodeId) -> f64 {
        // Gives normals to vertices in holes, and does not affect others.
        self.solid_area(node).max(1e-12 * self.area(node))
    }

    /// Whether `position` on `node` is in no hole.
    pub(crate) fn is_solid(&self, node: NodeId, position: DVec3) -> bool {
        let (scene, t) = (self.scene(), self.triangle(node));
        !scene.has_cut_outs() || scene.is_solid(t, scene.barycentric(t, position))
    }

    /// A point of `node` outside of holes: its centroid, or the nearest to it of the test points.
    /// The centroid if all of these are in holes.
    pub(crate) fn viewpoint(&self, node: NodeId) -> DVec3 {
        let centroid = self.centroid(node);
        if self.is_solid(node, centroid) {
            return centroid;
        }
        let [a, b, c] = self.corners(node);
        let point = |k: usize| {
            let [u, v] = fold_to_triangle(r2_point(k, 0.5));
            a + u * (b - a) + v * (c - a)
        };
        let solid = (0..64).map(point).filter(|&p| self.is_solid(node, p));
        let distance = |p: &DVec3| p.distance_squared(centroid);
        solid.min_by(|p, q| distance(p).total_cmp(&distance(q))).unwrap_or(centroid)
    }

    /// The solid fraction of every node; empty in a scene without holes.
    fn solid_shares(&self) -> &[f64] {
        self.solid_shares.get_or_init(|| {
            if !self.scene().has_cut_outs() {
                return vec![];
            }
            let elements = (0..self.element_count()).map(|e| self.element(e));
            let piece = |node: NodeId| (self.triangle(node), self.cell(node).corners());
            let pieces: Vec<_> = elements.clone().map(piece).collect();
            let mut shares = vec![0.0; self.node_count()];
            for (node, share) in elements.zip(self.scene().solid_shares(&pieces)) {
                shares[node.0 as usize] = share;
            }
            // Children come after their parents.
            for k in (0..shares.len()).rev() {
                if let Some(children) = self.children(NodeId(k as u32)) {
                    let sum: f64 = children.iter().map(|child| shares[child.0 as usize]).sum();
                    shares[k] = sum / 4.0;
                }
            }
            shares
        })
    }
}
