//! How fine a row is made: as fine as the light that goes along it is worth.
//!
//! What a row of an N × N hemicube sends wrong falls as N^-1.5: of some N² pixels those on the
//! outlines of what is seen err, some N of them, each by up to its weight of 1/N² or so, at random.
//! A patch that shoots a share s of the emitted light adds s² N⁻³ to the mean square of what goes
//! wrong in all, since rows err independently, and takes a time of N². The least of Σ s² N⁻³ for a
//! given Σ N² is where s² N⁻⁵ is the same for all patches: N ∝ s^0.4. A fan of N² rays errs alike.
//!
//! Rows are kept and shot along again; since the brightest shoots first, not by more than the first
//! time, and in all by some 1.2 times as much (the median in a Cornell box and in two rooms; five
//! times at most).

/// Times that the resolution is halved at most.
pub(crate) const HALVINGS: u32 = 2;

/// The least resolution that is halved to, 768 pixels a hemicube: fewer save no time worth having.
pub(crate) const LEAST: u32 = 16;

/// How often the resolution is halved for a row along which `unshot_share` of the emitted flux goes,
/// when it is full from `full_share` on: as often as leaves it no lower than the law has it.
pub(crate) fn halvings(unshot_share: f64, full_share: f64) -> u32 {
    // Half the resolution is enough for this many times less light.
    let fall = 2f64.powf(2.5);
    let enough = |&k: &u32| unshot_share * fall.powi(k as i32) < full_share;
    (1..=HALVINGS).take_while(enough).last().unwrap_or(0)
}

/// An even `resolution` halved so often; even, and below [`LEAST`] only where `resolution` is.
pub(crate) fn halved(resolution: u32, halvings: u32) -> u32 {
    ((resolution >> halvings) / 2 * 2).max(LEAST).min(resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolution_follows_law_from_above() {
        let mut before = HALVINGS;
        for k in 0..4000 {
            let share = 1e-8 * 1e9f64.powf(f64::from(k) / 4000.0);
            let halvings = halvings(share, 4e-3);
            assert!(halvings <= before, "no coarser for more light: {share}");
            before = halvings;
            // In units of the full resolution, as it is and as the law has it.
            let (resolution, law) = (0.5f64.powi(halvings as i32), (share / 4e-3).powf(0.4));
            assert!(resolution >= law.min(1.0), "{share}: {resolution} {law}");
            // Another halving would be too much, or there is no more.
            assert!(resolution / 2.0 <= law || halvings == HALVINGS, "{share}: {resolution} {law}");
        }
        assert_eq!((before, halvings(4e-3, 4e-3), halvings(1.0, 4e-3)), (0, 0, 0));
        assert_eq!((halvings(7e-4, 4e-3), halvings(1e-4, 4e-3), halvings(0.0, 4e-3)), (1, 2, 2));
    }

    #[test]
    fn zero_full_share_halves_nothing() {
        for share in [0.0, 1e-300, 1e-3, 1.0, f64::NAN] {
            assert_eq!(halvings(share, 0.0), 0);
        }
    }

    #[test]
    fn halved_resolutions_are_even_and_not_too_small() {
        let all = |n: u32| [0, 1, 2].map(|k| halved(n, k));
        assert_eq!(all(128), [128, 64, 32]);
        assert_eq!(all(70), [70, 34, 16]);
        assert_eq!(all(30), [30, 16, 16]);
        assert_eq!(all(16), [16, 16, 16]);
        assert_eq!(all(2), [2, 2, 2]);
    }
}
