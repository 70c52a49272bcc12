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
