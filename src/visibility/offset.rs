//! Offsets that keep rays and views from hitting the surface that they start from.
//!
//! A computed point lies off its surface by rounding, and neighbours of one plane lie off each
//! other's planes. A ray therefore skips a short distance at its start, or its origin is lifted off
//! the surface. If too small, surfaces shade themselves; if too large, contact is missed.
//!
//! | constant | value | in units of | used by |
//! |---|---|---|---|
//! | [`RAY_START`] | 1e-6 | √area of the patch, or the segment | rays from points on surfaces |
//! | [`COINCIDENCE_TOLERANCE`] | 1e-9 | the segment | end of a segment between two points |
//! | [`SURFACE_LIFT`] | 1e-4 | √area of the patch | near plane of hemicubes on a GPU |
//! | [`SURFACE_LIFT`] | 1e-4 | √area of the smallest element | gather points |
//! | [`min_lift`] | 1024 | steps of coordinates | gather points of tiny elements |
//! | [`NEAR_OF_LIFT`] | ¼ | lift of the gather point | nearest hit of a gather |
//! | [`path_contact`] | 1e-9 | the scene's diagonal | paths from points on triangles |
//! | [`path_contact`] | 64 | steps of coordinates | paths far from the origin |
//!
//! Reasons for the differences: rays in 64 bits need only be above rounding, 1e-6 of a patch in
//! scenes up to 1e9 patch sizes from the origin; at the end of a segment only the target itself is
//! excluded. Hemicubes have 32-bit coordinates, and skip the patch's own triangle anyway. Gather
//! points skip no triangle, and their lift must exceed the resolution of a device: a quarter of
//! 1024 steps is four times the 2⁻⁴⁸ of its split floats.
//!
//! Paths ignore the triangle that they start from, so that only rounding and coplanar surfaces
//! matter: plates 1e-5 of a scene apart stay separate.
//!
//! The shares are plain choices within these bounds; no recorded measurement.

use crate::geometry::COINCIDENCE_TOLERANCE;
use crate::scene::Scene;

/// Start distance of rays from a point on a surface, in units of the square root of the area of its
/// patch or triangle; share of a segment between two points that tests of occlusion skip at the
/// start.
pub(crate) const RAY_START: f64 = 1e-6;

/// Height of a gather point above its surface, in units of the square root of the area of the
/// smallest element there; distance of the near plane of a hemicube, in that of its patch.
pub(crate) const SURFACE_LIFT: f64 = 1e-4;

/// Minimum distance of hits from a gather point, as a share of its height.
pub(crate) const NEAR_OF_LIFT: f64 = 0.25;

/// Distance, scene unit, at which surfaces are in contact with the start of a path.
pub(crate) fn path_contact(scene: &Scene) -> f64 {
    (COINCIDENCE_TOLERANCE * scene.bounds().diagonal()).max(64.0 * scene.coordinate_ulp())
}

/// Minimum height of a gather point of `scene`, in its unit: steps between 64-bit coordinates.
pub(crate) fn min_lift(scene: &Scene) -> f64 {
    1024.0 * scene.coordinate_ulp()
}
