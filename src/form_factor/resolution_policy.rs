//! Number of samples of a row, by the light that it distributes.
//!
//! The error of a row of an N × N hemicube falls as N^-1.5: of some N² pixels those on the outlines
//! of visible surfaces are wrong, some N of them, each by up to its weight of 1/N² or so, at
//! random. A patch that shoots a share s of the emitted light adds s² N⁻³ to the mean square error
//! in total, since errors of rows are independent, and takes a time of N². Σ s² N⁻³ for a given Σ
//! N² is minimal where s² N⁻⁵ is the same for all patches:
//!
//! ```text
//! N ∝ s^0.4,  so half of N suffices for light less by a factor of 2^2.5
//! ```
//!
//! The error of N² stratified rays falls alike. The share s is the row's weight.
//!
//! Rows are cached and used again; since the brightest patch shoots first, later shots carry no
//! more than the first, and all shots together some 1.2 times as much (the median in a Cornell box
//! and in two rooms; five times at most).

/// Minimum halved resolution, pixels along an edge: 768 pixels per hemicube. Fewer save no
/// significant time.
pub(crate) const MIN_HALVED_RESOLUTION: u32 = 16;

/// Number of halvings of the resolution for a row of `weight`, with full resolution from
/// `full_resolution_share` on: the largest that keeps it at or above N ∝ s^0.4.
pub(crate) fn halvings_for_importance(weight: f64, full_resolution_share: f64) -> u32 {
    // Below 0, and where both are 0, none.
    (0.4 * libm::log2(full_resolution_share / weight)) as u32
}

/// An even `resolution` halved this number of times; even, and below [`MIN_HALVED_RESOLUTION`] only
/// if `resolution` is.
pub(crate) fn halved(resolution: u32, halvings: u32) -> u32 {
    ((resolution >> halvings) / 2 * 2).max(MIN_HALVED_RESOLUTION).min(resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_follows_law_from_above() {
        let mut before = u32::MAX;
        for k in 0..4000 {
            let share = 1e-8 * 1e9f64.powf(f64::from(k) / 4000.0);
            let halvings = halvings_for_importance(share, 4e-3);
            assert!(halvings <= before, "no coarser for more light: {share}");
            before = halvings;
            // In units of the full resolution: the actual one, and the one by the law.
            let (resolution, law) = (0.5f64.powi(halvings as i32), (share / 4e-3).powf(0.4));
            assert!(resolution >= law.min(1.0), "{share}: {resolution} {law}");
            // Another halving would be too much.
            assert!(resolution / 2.0 <= law, "{share}: {resolution} {law}");
        }
        assert_eq!(
            (before, halvings_for_importance(4e-3, 4e-3), halvings_for_importance(1.0, 4e-3)),
            (0, 0, 0)
        );
        assert_eq!(
            (
                halvings_for_importance(7e-4, 4e-3),
                halvings_for_importance(1e-4, 4e-3),
                halvings_for_importance(0.0, 4e-3)
            ),
            (1, 2, u32::MAX)
        );
    }

    #[test]
    fn zero_full_share_halves_nothing() {
        for share in [0.0, 1e-300, 1e-3, 1.0, f64::NAN] {
            assert_eq!(halvings_for_importance(share, 0.0), 0);
        }
    }

    #[test]
    fn halved_resolution_is_even_and_not_below_the_minimum() {
        let all = |n: u32| [0, 1, 2].map(|k| halved(n, k));
        assert_eq!(all(128), [128, 64, 32]);
        assert_eq!(all(70), [70, 34, 16]);
        assert_eq!(all(30), [30, 16, 16]);
        assert_eq!(all(16), [16, 16, 16]);
        assert_eq!(all(2), [2, 2, 2]);
    }
}
