//! Geometry that knows nothing of light.

pub(crate) mod rounding;
