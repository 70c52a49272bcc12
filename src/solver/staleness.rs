//! Policy of a session for stale rows: rows made before objects were moved, and kept.
//!
//! A stale row misplaces at most its *stale fraction* of light. Summed over all rows, this gives an
//! upper bound of the misplaced flux, [`SolveSession::stale_flux_bound`]: a share of the emitted
//! flux, like the unshot share. The policy has two parts:
//!
//! 1. When objects move, rows are recomputed, those with most misplaced flux first, until the bound
//!    is at most [`MAX_BOUND_OVER_UNSHOT`] × the requested unshot share. A remaining row stays in
//!    use only if its stale fraction is at most [`MAX_STALE_FRACTION`].
//! 2. While solving, the expected error of stale rows, [`EXPECTED_SHARE_OF_BOUND`] × the bound, is
//!    subtracted from the requested unshot share, down to [`MIN_SHARE_OF_UNSHOT`] of it.
//!
//! A vase and a chair moved in a furnished room misplaced a sixth to a half of the bound.
//!
//! [`SolveSession::stale_flux_bound`]: super::SolveSession::stale_flux_bound

/// Maximum bound of misplaced flux that remains when objects have moved, over the requested unshot
/// share.
pub(super) const MAX_BOUND_OVER_UNSHOT: f64 = 2.0;

/// Maximum stale fraction of a row that is still used. Plain choice; no recorded measurement.
pub(super) const MAX_STALE_FRACTION: f64 = 0.1;

/// Expected misplaced flux over its bound: within the range of a sixth to a half that was measured
/// (see the module).
const EXPECTED_SHARE_OF_BOUND: f64 = 0.25;

/// Minimum share of the requested unshot share that remains when the expected error of stale rows
/// is subtracted. With [`MAX_BOUND_OVER_UNSHOT`] = 2 and [`EXPECTED_SHARE_OF_BOUND`] = ¼ each error
/// gets half.
const MIN_SHARE_OF_UNSHOT: f64 = 0.5;

/// The unshot share to solve to, so that its sum with the error of stale rows stays within
/// `unshot`.
pub(super) fn tightened_unshot(unshot: f64, stale_flux_bound: f64) -> f64 {
    let expected = stale_flux_bound * EXPECTED_SHARE_OF_BOUND;
    (unshot - expected).max(unshot * MIN_SHARE_OF_UNSHOT)
}
