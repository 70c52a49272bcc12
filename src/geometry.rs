//! Geometry that knows nothing of light.

pub(crate) mod aabb;
pub(crate) mod rounding;
pub(crate) mod union_find;
pub(crate) mod weld;
