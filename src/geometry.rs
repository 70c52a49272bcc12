//! Geometry, independent of light.

pub(crate) mod aabb;
pub(crate) mod barycentric;
pub(crate) mod bvh;
pub(crate) mod incidence;
pub(crate) mod plane;
pub(crate) mod polygon;
pub(crate) mod quadrature;
pub(crate) mod rectangle;
pub(crate) mod rounding;
pub(crate) mod triangulation;
pub(crate) mod union_find;
pub(crate) mod weld;

/// Relative difference up to which lengths, areas and positions are equal: well above the rounding
/// of sums and intersections with 64 bits, some 1e-13, and below any difference in a file.
pub(crate) const COINCIDENCE_TOLERANCE: f64 = 1e-9;

/// The same for what comes from a file of six digits, such as the corners of a flat polygon.
pub(crate) const FILE_TOLERANCE: f64 = 1e-4;
