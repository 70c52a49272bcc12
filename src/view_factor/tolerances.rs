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
//! | [`COINCIDENCE_TOLERANCE`] | 1e-9 | unit, share of the extent, sine | rounding of cut corners |
//!
//! [`PLANE_TOLERANCE`]: crate::geometry::polygon::PLANE_TOLERANCE
//! [`COINCIDENCE_TOLERANCE`]: crate::geometry::COINCIDENCE_TOLERANCE

/// Corners at most this far from a plane, in units of the scene's size, are in it: above the
/// rounding of coordinates, and below [`CONTACT_HEIGHT`], so that no piece is in front of its own
/// plane.
pub(super) const COPLANARITY: f64 = 4e-15;

/// Heights over a plane up to this, in units of the scene's size, are contact: well above rounding,
/// and above the deviation of pieces from their own planes, [`COPLANARITY`].
pub(super) const CONTACT_HEIGHT: f64 = 1e-12;
