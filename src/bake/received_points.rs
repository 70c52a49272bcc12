//! Where an element looks for the light that it receives before any is shot.
//!
//! Its middle stands for all of it, but for luminaires nearer than it is wide, whose light falls
//! off within it: it is then looked for in the middles of its parts.

use glam::DVec3;

use crate::gather::GatherPoint;
use crate::gather::gather_points::SurfaceOffset;
use crate::mesh::{Mesh, NodeId};
use crate::scene::{Luminaire, longest_edge};

/// Width of a part as a share of its distance from a luminaire, at most: at the foot of a point at
/// height h the middle of a triangle of width w is 3 w²/24 h² = 3 % brighter than its mean, and
/// elsewhere it is nearer to that.
const MAX_WIDTH: f64 = 0.5;

/// Times that an element is cut in four, at most.
const MAX_LEVELS: u32 = 5;

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
    let levels = (width / (MAX_WIDTH * distance)).log2().ceil().clamp(0.0, f64::from(MAX_LEVELS));
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
