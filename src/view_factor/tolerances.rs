//! Geometric tolerances: thresholds for contact, coplanarity and equality.
//!
//! A scene is centred and divided by a power of two, its unit, so that coordinates are below 1 and
//! carry rounding of about 1e-16. Lengths below are in that unit unless they are shares. Each
//! tolerance must be above the rounding of the quantity compared with it, and above every tolerance
//! that this results from:
//!
//! | constant | value | of | above |
//! |---|---|---|---|
//! | [`COPLANARITY`] | 4e-15 | unit | rounding of coordinates |
//! | [`PLANE_TOLERANCE`] | 1e-13 | share of the extent | rounding of a few operations |
//! | [`CONTACT_HEIGHT`] | 1e-12 | unit | both: pieces may be off their own planes |
//! | [`SLIVER_WIDTH`] | 4e-12 | unit | contact heights on all sides |
//! | [`SAME_POSITION`] | 1e-9 | unit, or share of the extent | rounding of cut corners |
//! | [`SAME_DIRECTION_SQUARED`] | 1e-18 | squared sine | rounding of directions of short edges |
//! | [`MIN_LEANING_EDGE`] | 1e-4 | share of a shaft | 1e-16 / [`CONTACT_HEIGHT`] |
//!
//! [`PLANE_TOLERANCE`]: crate::geometry::polygon::PLANE_TOLERANCE

/// Corners at most this far from a plane, in units of the scene's size, are in it: above the
/// rounding of coordinates, and below [`CONTACT_HEIGHT`], so that no piece is in front of its own
/// plane.
pub(super) const COPLANARITY: f64 = 4e-15;

/// Heights over a plane up to this, in units of the scene's size, are contact: well above rounding,
/// and above the deviation of pieces from their own planes, [`COPLANARITY`].
pub(super) const CONTACT_HEIGHT: f64 = 1e-12;

/// The clipped part of a piece within a shaft is only contact if its area is at most its length
/// times this: clipping at contact heights may have put its edges out of order. In units of the
/// scene's size.
pub(super) const SLIVER_WIDTH: f64 = 4.0 * CONTACT_HEIGHT;

/// Positions closer than this are equal: as corners of a polygon, in shares of its extent, since
/// the line through both is too uncertain to cut by; as planes, in units of the scene's size; as
/// corners of a piece over the plane of another, in shares of its extent.
pub(super) const SAME_POSITION: f64 = 1e-9;

/// Directions are the same if the square of the sine of their angle is at most this.
pub(super) const SAME_DIRECTION_SQUARED: f64 = 1e-18;

/// Minimum length of an edge, as a share of a shaft, for a plane along it: rounding of the ends of
/// a shorter one, 1e-16, moves the plane by over [`CONTACT_HEIGHT`] at the far end.
pub(super) const MIN_LEANING_EDGE: f64 = 1e-4;

/// Maximum sine of the turn at a corner of an outline that counts as straight. Plain choice, above
/// the rounding of short edges; no recorded measurement.
pub(super) const STRAIGHT_SINE: f64 = 1e-9;
