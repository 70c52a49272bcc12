//! Bit mixers: pseudo-random bits from an index, the same on every run and machine.
//!
//! A mixer is a bijection of integers that flips each output bit with probability ½ when any one
//! input bit flips, so that hashes of consecutive patch ids, cells or seeds look independent.
//!
//! | function | bits | used for |
//! |---|---|---|
//! | [`split_mix64`] | 64 | rotations per cell, of hemicubes, and seeds of cubature cells |
//! | [`low_bias32`] | 32 | rotations of ray-cast rows |

/// Step of the state of SplitMix64: 2⁶⁴ over the golden ratio, rounded to an odd number.
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

/// The output of SplitMix64 from `state` (Steele, Lea and Flood 2014, "Fast splittable pseudorandom
/// number generators", with the variant 13 mixer of D. Stafford).
pub(crate) fn split_mix64(state: u64) -> u64 {
    let z = state.wrapping_add(GOLDEN_GAMMA);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Output number `index`, from 0, of the SplitMix64 generator that starts at state 0.
pub(crate) fn split_mix64_nth(index: u64) -> u64 {
    split_mix64(index.wrapping_mul(GOLDEN_GAMMA))
}

/// Mixes 32 bits (C. Wellons 2018, "Prospecting for hash functions": lowbias32).
pub(crate) fn low_bias32(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// The number in [0, 1) of the upper 53 bits: the precision of an f64.
pub(crate) fn unit_interval(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_mix64_gives_the_published_sequence() {
        // The first outputs from seed 0 of S. Vigna's splitmix64.c.
        let expected = [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f];
        assert_eq!([0, 1, 2].map(split_mix64_nth), expected);
        assert_eq!(split_mix64(0), expected[0]);
    }

    #[test]
    fn one_input_bit_flips_half_of_the_output() {
        // 256 · 64 · 64 fair bits: six standard errors of their mean are 0.003.
        let (mut flipped, mut trials) = (0u32, 0u32);
        for k in 0..256u64 {
            for bit in 0..64 {
                flipped += (split_mix64(k) ^ split_mix64(k ^ 1 << bit)).count_ones();
                trials += 64;
            }
        }
        assert!((f64::from(flipped) / f64::from(trials) - 0.5).abs() < 0.003);
    }

    #[test]
    fn unit_interval_excludes_one() {
        assert_eq!(unit_interval(0), 0.0);
        assert_eq!(unit_interval(u64::MAX), 1.0 - f64::EPSILON / 2.0);
    }
}
