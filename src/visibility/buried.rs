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
//! | [`NEAR_BACKS`] | 0.4 | sample of the error estimate | left out, if they are very near too |
//! | [`HIDDEN`] | 0.95 | sample of the error estimate | left out |
//! | [`OPEN`] | 0.99, empty | sample of the error estimate | left out |
//! | [`BURIED`] | 0.9 | gather point | replaced, if surfaces are near too |
//! | [`INSIDE`] | 0.995 | gather point | replaced, at any distance of surfaces |
//! | [`INSIDE`] | 0.995 | side of a contact | no cut along it |
//!
//! Reasons for the differences: another viewpoint is cheap, and a left-out sample must meet a
//! second condition, so that about one half suffices for both. The sample of a gather point is
//! replaced by an extrapolation, so that a dark sample is kept when in doubt; without the second
//! condition only a ray or two, through seams, may see a front. A cut costs some elements, and a
//! missing cut is an error that refinement does not reduce.
//!
//! Plain choices; no recorded measurement. A point at the foot of an inverted wall sees a share of
//! 0.5 of its back; [`NEAR_BACKS`] is less, by two standard deviations of that share with 128 rays.

/// A patch's viewpoint with a back-face share above this is rejected.
pub(crate) const VIEWPOINT: f64 = 0.5;

/// A sample of the error estimate with a back-face share above this is left out if the backs are
/// nearer than [`NEAR_BACKS_DISTANCE`].
pub(crate) const NEAR_BACKS: f64 = 0.4;

/// Share of the diagonal of the lit region.
pub(crate) const NEAR_BACKS_DISTANCE: f64 = 0.002;

/// A sample of the error estimate whose mean of 1/distance is above 1 over this share of the
/// diagonal of the lit region is in an invisible crack. Between parallel plates that mean is 2/3
/// over their distance: in a room of five metres, cracks of a third of a millimetre. Next to a wall
/// the threshold is reached within less than half of this share.
pub(crate) const CRACK: f64 = 1e-4;

/// A sample of the error estimate with a back-face share above this is inside a solid.
pub(crate) const HIDDEN: f64 = 0.95;

/// A sample of the error estimate whose hemisphere is empty by more than this share is in the open:
/// its light from the sky is exact. The result must not depend on the number of rays, since the
/// number of points that see some part of a room grows with the distance from it.
pub(crate) const OPEN: f64 = 0.99;

/// A gather point with a back-face share above this is buried, if the backs are near.
pub(crate) const BURIED: f64 = 0.9;

/// A gather point with a back-face share above this is inside a body of any size.
pub(crate) const INSIDE: f64 = 0.995;
