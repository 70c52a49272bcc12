//! Rounding to integers with an exact sum, and to keys that are stable under rounding errors.
//!
//! [`Apportion`] deals out whole units in proportion to real shares. Rounding each share would
//! leave a remainder; instead the running sum is rounded, and every part is its increase:
//!
//! ```text
//! shares of 5 units       0.3   0.3   0.3   0.1
//! running sum, in units   1.5   3.0   4.5   5.0
//! rounded                 2     3     5     5
//! parts                   2     1     2     0     they sum to 5; any run is off by less than 1
//! ```

/// Deals out whole units so that parts sum to the rounded total: each part is the difference of a
/// running sum that was rounded.
#[derive(Debug, Default)]
pub(crate) struct Apportion {
    /// Units dealt out so far.
    given: u32,
}

impl Apportion {
    /// The next part, if all parts up to this one make `running_sum` units, rounded by the caller.
    /// Running sums must not decrease.
    pub fn part_up_to(&mut self, running_sum: u32) -> u32 {
        let part = running_sum - self.given;
        self.given = running_sum;
        part
    }

    /// Units of `total` that are not dealt out yet.
    pub fn remainder(&self, total: u32) -> u32 {
        total - self.given
    }
}

/// A sort key for positive numbers in which numbers that differ only by rounding tie: their upper
/// bits, with 24 significant ones, rounded.
///
/// Computed values that are equal in exact arithmetic, as in symmetric scenes, then tie, and ties
/// are broken by index: the order does not depend on the position or size of the scene.
pub(crate) fn tie_stable_key(x: f64) -> u64 {
    // The bits of positive floats are in the order of their values. Half of a step is added, since
    // tied values are often round numbers.
    (x.to_bits() + (1 << 28)) >> 29
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn apportioned_parts_sum_to_the_total() {
        let (mut parts, mut sum) = (Apportion::default(), 0.0);
        let dealt = [0.3, 0.3, 0.3, 0.1].map(|share: f64| {
            sum += share;
            parts.part_up_to((sum * 5.0).round() as u32)
        });
        assert_eq!((dealt, parts.remainder(5), parts.remainder(7)), ([2, 1, 2, 0], 0, 2));
    }

    #[test]
    fn tie_stable_key_ignores_rounding_but_not_a_millionth() {
        for x in [1e-300, 1e-9, 0.25, 1.0, 1.0 / 3.0, 7e200] {
            let next = |x: f64, steps: i64| f64::from_bits((x.to_bits() as i64 + steps) as u64);
            for steps in [-100, -1, 1, 100] {
                assert_eq!(tie_stable_key(next(x, steps)), tie_stable_key(x), "{x:e}");
            }
            assert!(tie_stable_key(x * (1.0 + 1e-6)) > tie_stable_key(x));
            assert!(tie_stable_key(x * (1.0 - 1e-6)) < tie_stable_key(x));
            assert!(tie_stable_key(x * 0.25) < tie_stable_key(x));
        }
        assert_eq!(tie_stable_key(0.0), 0);
    }
}
