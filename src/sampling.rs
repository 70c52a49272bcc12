//! Sample sets and hashes that know nothing of light.

pub(crate) mod hash;
pub(crate) mod hemisphere;
pub(crate) mod rotation;
