//! Policy of a session for stale rows: rows made before objects were moved, and kept.
//!
//! A stale row misplaces at most its *stale fraction* of light. Summed over all rows, this gives an
//! upper bound of the misplaced flux, [`SolveSession::stale_flux_bound`]: a share of the emitted
//! flux, like the unshot share. The policy has two parts:
//!
//! 1. When objects move, rows are recomputed, those with most misplaced flux first, until the bound
//!    is at most twice the requested unshot share. A remaining row stays in use only if its stale
//!    fraction is at most 0.1.
//! 2. While solving, the expected error of stale rows, a quarter of the bound, is subtracted from
//!    the requested unshot share, down to half of it: with twice that share each error gets half.
//!
//! A vase and a chair moved in a furnished room misplaced a sixth to a half of the bound; a quarter
//! is within that range.
//!
//! [`SolveSession::stale_flux_bound`]: super::SolveSession::stale_flux_bound

/// Maximum bound of misplaced flux that remains when objects have moved, for a requested `unshot`
/// share.
pub(super) fn max_stale_flux_bound(unshot: f64) -> f64 {
    2.0 * unshot
}

/// Whether a row of this stale fraction is still used. Plain choice.
pub(super) fn is_usable(stale_fraction: f64) -> bool {
    stale_fraction <= 0.1
}

/// The unshot share to solve to, so that its sum with the error of stale rows stays within
/// `unshot`.
pub(super) fn tightened_unshot(unshot: f64, stale_flux_bound: f64) -> f64 {
    (unshot - stale_flux_bound * 0.25).max(unshot * 0.5)
}
