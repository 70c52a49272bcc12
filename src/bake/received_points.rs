//! Points at which an element gathers the light that it receives before any is shot: its centroid,
//! or those of its parts where luminaires are nearer than twice its width.

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::gather_points::SurfaceOffset;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Luminaire, longest_edge};

/// The points for `node` of `mesh`: one, or one for each of as many parts of equal area.
pub(super) fn received_points(
    above: &SurfaceOffset,
    mesh: &Mesh,
    node: NodeId,
) -> Vec<GatherPoint> {
    let (middle, corners) = (mesh.centroid(node), mesh.corners(node));
    let width = longest_edge(corners);
    let nearest = |luminaire: &Luminaire| luminaire.distance_to_box(middle) - width / 2.0;
    let distances = mesh.scene().luminaires().iter().map(nearest);
    let distance = distances.fold(f64::INFINITY, f64::min).max(f64::MIN_POSITIVE);
    // Parts of width w at most half of their distance h: at the foot of a point light, the middle
    // of one is 3 w²/24 h² = 3 % brighter than its mean.
    let levels = (width / (0.5 * distance)).log2().ceil().clamp(0.0, 5.0);
    if levels == 0.0 {
        return vec![above.above_element(mesh, node)];
    }
    let (normal, size) = (mesh.normal(node), mesh.area(node).sqrt() / levels.exp2());
    let middles = middles(corners, levels as u32);
    middles.into_iter().map(|middle| above.gather_point(middle, normal, size)).collect()
}

/// The middles of the triangles that cutting one in four makes, `levels` times.
fn middles([a, b, c]: [DVec3; 3], levels: u32) -> Vec<DVec3> {
    if levels == 0 {
        return vec![(a + b + c) / 3.0];
    }
    let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    parts.into_iter().flat_map(|part| middles(part, levels - 1)).collect()
}
