//! Sample points, directions and hashes that know nothing of light.
//!
//! | module | gives |
//! |---|---|
//! | [`hash`] | pseudo-random bits from an index |
//! | [`low_discrepancy`] | evenly spread points of the unit interval and square |
//! | [`hemisphere`] | cosine-weighted directions |
//! | [`octaves`] | parts of wide triangles, as fine as they are near |
//! | [`random`] | random numbers from words |
//! | [`rotation`] | how far to rotate them from point to point |
//! | [`surface`] | points in proportion to area |

pub(crate) mod hash;
pub(crate) mod hemisphere;
pub(crate) mod low_discrepancy;
pub(crate) mod octaves;
pub(crate) mod random;
pub(crate) mod rotation;
pub(crate) mod surface;
