//! "Is this point inside a solid?": thresholds of the share of back faces that a point sees.
//!
//! A point in the open sees fronts; one within a closed body, or under an object that stands on its
//! surface, sees backs. The share is of the point's hemisphere, weighted by form factor. How sure
//! one must be depends on what follows from a wrong answer:
//!
//! | constant | share | asked of | if it is exceeded | why not another value |
//! |---|---|---|---|---|
//! | [`VIEWPOINT`] | 0.5 | viewpoint of a shooting patch | try another viewpoint of the patch | another try is cheap, so more likely than not is enough |
//! | [`HIDDEN_SAMPLE`] | 0.5 | sample of the error estimate | leave it out, if surfaces are near as well | few samples are at stake, and a second condition guards |
//! | [`ENCLOSED`] | 0.75 | sample of the winding check | its back hits do not count against the winding | above a half, so that inverted walls of a room are still reported |
//! | [`BURIED`] | 0.9 | gather point | its sample is replaced, if surfaces are near as well | the replacement is extrapolated, so a dark sample is rather kept |
//! | [`INSIDE`] | 0.995 | gather point | its sample is replaced, however far surfaces are | no second condition; seams still let a ray or two through |
//!
//! The values were chosen by hand; no measurement was kept. A share of 0.5 is what a point at the
//! foot of an inverted wall sees of it.

/// A patch's viewpoint that sees more than this share of backs is rejected.
pub(crate) const VIEWPOINT: f64 = 0.5;

/// A sample of the error estimate that sees more than this share of backs is behind something.
pub(crate) const HIDDEN_SAMPLE: f64 = 0.5;

/// A sample of the winding check that meets more than this share of backs is enclosed.
pub(crate) const ENCLOSED: f64 = 0.75;

/// A gather point that sees more than this share of backs is buried, if they are near.
pub(crate) const BURIED: f64 = 0.9;

/// A gather point that sees more than this share of backs is inside a body of any size.
pub(crate) const INSIDE: f64 = 0.995;
