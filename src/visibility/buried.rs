//! Thresholds of the share of back faces seen from a point, above which it counts as inside a
//! solid.
//!
//! A point in free space sees fronts; one within a closed body, or under an object that stands on
//! its surface, sees backs. The share is of the point's hemisphere, weighted by form factor. The
//! required certainty depends on the consequence:
//!
//! | constant | share | tested point | consequence |
//! |---|---|---|---|
//! | [`VIEWPOINT`] | 0.5 | viewpoint of a shooting patch | another viewpoint is tried |
//! | [`BURIED`] | 0.9 | gather point | replaced, if surfaces are near too |
//! | [`INSIDE`] | 0.995 | gather point | replaced, at any distance of surfaces |
//! | [`INSIDE`] | 0.995 | side of a contact | no cut along it |
//!
//! Reasons for the differences: another viewpoint is cheap. The sample of a gather point is
//! replaced by an extrapolation, so that a dark sample is kept when in doubt; without the second
//! condition only a ray or two, through seams, may see a front. A cut costs some elements, and a
//! missing cut is an error that refinement does not reduce. Points at which no error is counted
//! have thresholds of their own: [`accuracy::hidden`](crate::accuracy::hidden).
//!
//! Plain choices; no recorded measurement. A point at the foot of an inverted wall sees a share of
//! 0.5 of its back.

/// A patch's viewpoint with a back-face share above this is rejected.
pub(crate) const VIEWPOINT: f64 = 0.5;

/// A gather point that sees more than this share of backs is buried, if they are near.
pub(crate) const BURIED: f64 = 0.9;

/// A gather point with a back-face share above this is inside a body of any size.
pub(crate) const INSIDE: f64 = 0.995;
