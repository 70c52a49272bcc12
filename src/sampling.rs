//! Sample points, directions and hashes, independent of light.
//!
//! | module | gives |
//! |---|---|
//! | [`hash`] | pseudo-random bits from an index |
//! | [`low_discrepancy`] | evenly spread points of the unit interval and square |
//! | [`hemisphere`] | cosine-weighted directions |
//! | [`octaves`] | parts of wide triangles, with sizes in proportion to their distance |
//! | [`random`] | seeded random number generators |
//! | [`rotation`] | rotations of direction sets from point to point |
//! | [`surface`] | points in proportion to area |

pub(crate) mod hash;
pub(crate) mod hemisphere;
pub(crate) mod low_discrepancy;
pub(crate) mod octaves;
pub(crate) mod random;
pub(crate) mod rotation;
pub(crate) mod surface;
