//! An order of numbers that rounding does not change.

/// The order of a positive number among others, to 24 bits: what differs by rounding alone is equal,
/// so that symmetric scenes have ties, decided by their order, however large they are and wherever
/// they stand.
pub(crate) fn rank(x: f64) -> u64 {
    // The bits of positive floats are in the order of their values. Half of a step is added, since
    // what ties is often a round number.
    (x.to_bits() + (1 << 28)) >> 29
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_is_no_difference_and_a_millionth_is() {
        for x in [1e-300, 1e-9, 0.25, 1.0, 1.0 / 3.0, 7e200] {
            let next = |x: f64, steps: i64| f64::from_bits((x.to_bits() as i64 + steps) as u64);
            for steps in [-100, -1, 1, 100] {
                assert_eq!(rank(next(x, steps)), rank(x), "{x:e}");
            }
            assert!(rank(x * (1.0 + 1e-6)) > rank(x) && rank(x * (1.0 - 1e-6)) < rank(x));
            assert_eq!(rank(x * 0.25) < rank(x), x > 0.0);
        }
        assert_eq!(rank(0.0), 0);
    }
}
