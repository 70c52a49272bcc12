//! Barycentric weights.

use glam::DVec3;

/// The whole triangle, by the weights of its second and third corner at its corners.
pub(crate) const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// Weights of the second and third corner of a triangle with this unit `normal` at `position`, in
/// its plane; not finite where it has no area.
pub(crate) fn barycentric([a, b, c]: [DVec3; 3], normal: DVec3, position: DVec3) -> [f64; 2] {
    let [ab, ac, to] = [b - a, c - a, position - a];
    let double_area = ab.cross(ac).dot(normal);
    [to.cross(ac).dot(normal) / double_area, ab.cross(to).dot(normal) / double_area]
}
