//! Surfaces that are nearer than their elements are wide: the field does not resolve their light.

use crate::mesh::Mesh;
use crate::visibility::ray_scene::Hit;

/// Whether `hit` is nearer than the element of `mesh` there is wide.
pub(crate) fn is_near(mesh: &Mesh, hit: &Hit) -> bool {
    is_near_element(mesh, mesh.element_at(hit.triangle, hit.u, hit.v).0, hit)
}

/// The same for a hit on `element`.
pub(crate) fn is_near_element(mesh: &Mesh, element: usize, hit: &Hit) -> bool {
    // A right triangle with two sides of this width has the area.
    let square = 2.0 * mesh.area(mesh.element(element));
    hit.distance * hit.distance < square
}
