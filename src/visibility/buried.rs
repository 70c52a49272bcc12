//! "Is this point inside a solid?": thresholds of the share of back faces that a point sees.
//!
//! A point in the open sees fronts; one within a closed body, or under an object that stands on its
//! surface, sees backs. The share is of the point's hemisphere, weighted by form factor. How sure
//! one must be depends on what follows from a wrong answer:
//!
//! | constant | share | asked of | consequence |
//! |---|---|---|---|
//! | [`VIEWPOINT`] | 0.5 | viewpoint of a shooting patch | another viewpoint is tried |
//! | [`NEAR_BACKS`] | 0.4 | sample of the error estimate | left out, if they are very near too |
//! | [`HIDDEN`] | 0.95 | sample of the error estimate | left out |
//! | [`OPEN`] | 0.99, of nothing | sample of the error estimate | left out |
//! | [`BURIED`] | 0.9 | gather point | replaced, if surfaces are near too |
//! | [`INSIDE`] | 0.995 | gather point | replaced, however far surfaces are |
//! | [`INSIDE`] | 0.995 | side of a contact | no cut along it |
//!
//! Why they differ: another viewpoint is cheap, and a left-out sample is guarded by a second
//! condition, so that more likely than not is enough for both. The sample of a gather point is
//! replaced by an extrapolation, so that a dark sample is rather kept; without the second condition
//! only what seams let through, a ray or two, may see a front. A cut costs some elements, and the
//! lack of one is an error that no element is small enough for.
//!
//! The values were chosen by hand; no measurement was kept. A share of 0.5 is what a point at the
//! foot of an inverted wall sees of it; [`NEAR_BACKS`] is less, by two standard deviations of what
//! 128 rays find there.

/// A patch's viewpoint that sees more than this share of backs is rejected.
pub(crate) const VIEWPOINT: f64 = 0.5;

/// A sample of the error estimate that sees more than this share of backs is left out if these are
/// nearer than [`NEAR_BACKS_DISTANCE`].
pub(crate) const NEAR_BACKS: f64 = 0.4;

/// Share of the diagonal of where the light is.
pub(crate) const NEAR_BACKS_DISTANCE: f64 = 0.002;

/// A sample of the error estimate whose mean of 1/distance is above one over this share of the
/// diagonal of where the light is lies in a crack that nobody looks into. Between parallel plates
/// that mean is 2/3 over their distance: in a room of five metres, cracks of a third of a
/// millimetre. Next to a wall it is so within less than half of this share.
pub(crate) const CRACK: f64 = 1e-4;

/// A sample of the error estimate that sees more than this share of backs lies inside a solid.
pub(crate) const HIDDEN: f64 = 0.95;

/// A sample of the error estimate that sees nothing in more than this share of its hemisphere is
/// in the open: what the sky gives it is exact. How many rays there are must not decide it, since
/// the further from a room one looks for places that see some of it, the more of them there are.
pub(crate) const OPEN: f64 = 0.99;

/// A gather point that sees more than this share of backs is buried, if they are near.
pub(crate) const BURIED: f64 = 0.9;

/// A gather point that sees more than this share of backs is inside a body of any size.
pub(crate) const INSIDE: f64 = 0.995;
