//! How many samples a row gets: as many as the light that goes along it is worth.
//!
//! What a row of an N × N hemicube sends wrong falls as N^-1.5: of some N² pixels those on the
//! outlines of what is seen err, some N of them, each by up to its weight of 1/N² or so, at random.
//! A patch that shoots a share s of the emitted light adds s² N⁻³ to the mean square of what goes
//! wrong in all, since rows err independently, and takes a time of N². The least of Σ s² N⁻³ for a
//! given Σ N² is where s² N⁻⁵ is the same for all patches:
//!
//! ```text
//! N ∝ s^0.4,  so half of N is enough for 2^2.5 times less light
//! ```
//!
//! N² rays in strata err alike. The share s is the row's weight.
//!
//! Rows are kept and shot along again; since the brightest shoots first, not by more than the first
//! time, and in all by some 1.2 times as much (the median in a Cornell box and in two rooms; five
//! times at most).

/// Times that the resolution is halved at most. Chosen by hand; no measurement kept.
pub(crate) const MAX_HALVINGS: u32 = 2;

/// Lowest resolution that is halved to, pixels along an edge: 768 pixels a hemicube. Fewer save no
/// time worth having.
pub(crate) const MIN_HALVED_RESOLUTION: u32 = 16;

/// How often the resolution is halved for a row of `weight`, when it is full from
/// `full_resolution_share` on: as often as leaves it no lower than N ∝ s^0.4 asks for.
pub(crate) fn halvings_for_importance(weight: f64, full_resolution_share: f64) -> u32 {
    // Half the resolution is enough for this many times less light.
    let fall = 2f64.powf(2.5);
    let is_enough = |&k: &u32| weight * fall.powi(k as i32) < full_resolution_share;
    (1..=MAX_HALVINGS).take_while(is_enough).last().unwrap_or(0)
}

/// An even `resolution` halved so often; even, and below [`MIN_HALVED_RESOLUTION`] only where
/// `resolution` is.
pub(crate) fn halved(resolution: u32, halvings: u32) -> u32 {
    ((resolution >> halvings) / 2 * 2).max(MIN_HALVED_RESOLUTION).min(resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_follows_law_from_above() {
        let mut before = MAX_HALVINGS;
        for k in 0..4000 {
            let share = 1e-8 * 1e9f64.powf(f64::from(k) / 4000.0);
            let halvings = halvings_for_importance(share, 4e-3);
            assert!(halvings <= before, "no coarser for more light: {share}");
            before = halvings;
            // In units of the full resolution, as it is and as the law has it.
            let (resolution, law) = (0.5f64.powi(halvings as i32), (share / 4e-3).powf(0.4));
            assert!(resolution >= law.min(1.0), "{share}: {resolution} {law}");
            // Another halving would be too much, or there is no more.
            assert!(
                resolution / 2.0 <= law || halvings == MAX_HALVINGS,
                "{share}: {resolution} {law}"
            );
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
            (1, 2, 2)
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
