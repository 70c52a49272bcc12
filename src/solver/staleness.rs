//! What a session does about rows that are stale: made before objects were moved, and kept.
//!
//! A stale row sends at most its *stale fraction* of light the wrong way. Over all rows that gives
//! an upper bound of the misplaced flux, [`SolveSession::stale_flux_bound`]: a share of the emitted
//! flux, as the unshot share is. The policy has two halves:
//!
//! 1. When objects move, rows are made anew, those with most misplaced flux first, until the bound
//!    is at most [`MAX_BOUND_OVER_UNSHOT`] × the unshot share that is asked for. A row that stays
//!    goes on being used only if its stale fraction is at most [`MAX_STALE_FRACTION`].
//! 2. While solving, the error expected of stale rows, [`EXPECTED_SHARE_OF_BOUND`] × the bound, is
//!    taken off the unshot share that is asked for, down to [`MIN_SHARE_OF_UNSHOT`] of it.
//!
//! A vase and a chair that were moved in a furnished room misplaced a sixth to a half of the bound.
//!
//! [`SolveSession::stale_flux_bound`]: super::SolveSession::stale_flux_bound

/// Highest bound of misplaced flux that is left when objects have moved, over the unshot share that
/// is asked for.
pub(super) const MAX_BOUND_OVER_UNSHOT: f64 = 2.0;

/// Highest stale fraction of a row that light is still sent along. Chosen by hand; no measurement
/// kept.
pub(super) const MAX_STALE_FRACTION: f64 = 0.1;

/// Misplaced flux that is expected, over its bound: within the range of a sixth to a half that
/// was measured (see the module).
const EXPECTED_SHARE_OF_BOUND: f64 = 0.25;

/// What is left of the unshot share that is asked for, at least, when the error expected of stale
/// rows is taken off. With [`MAX_BOUND_OVER_UNSHOT`] = 2 and [`EXPECTED_SHARE_OF_BOUND`] = ¼ both
/// errors get half each.
const MIN_SHARE_OF_UNSHOT: f64 = 0.5;

/// The unshot share to solve to, so that it and the error of stale rows together stay within
/// `unshot`.
pub(super) fn tightened_unshot(unshot: f64, stale_flux_bound: f64) -> f64 {
    let expected = stale_flux_bound * EXPECTED_SHARE_OF_BOUND;
    (unshot - expected).max(unshot * MIN_SHARE_OF_UNSHOT)
}
