//! Low-discrepancy sequences: points that fill the unit interval and square more evenly than random
//! ones do.
//!
//! | function | dimensions | property |
//! |---|---|---|
//! | [`radical_inverse`] | 1 | van der Corput sequence in base 2; Hammersley's second coordinate |
//! | [`sobol_02_point`] | 2 | (0,2)-sequence: any aligned run of 2ᵐ points is a (0,m,2)-net |
//! | [`r2_point`] | 2 | additive recurrence of the plastic number: even for any number of points |
//! | [`golden_ratio_order`] | 1 | a permutation whose first few members are spread over all |

/// 1/p and 1/p² for the plastic number p, the real root of p³ = p + 1 (M. Roberts 2018, "The
/// unreasonable effectiveness of quasirandom sequences": R₂).
const PLASTIC: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053_2];

/// The van der Corput sequence in base 2: the bits of `k` mirrored at the binary point, in [0, 1).
pub(crate) fn radical_inverse(k: u32) -> f64 {
    f64::from(k.reverse_bits()) / 2f64.powi(32)
}

/// Point `k` of Sobol's (0,2)-sequence in base 2 (I. M. Sobol 1967), in (0, 1)²: any 2ᵐ consecutive
/// points from a multiple of 2ᵐ on are spread as evenly as Hammersley's. Each point is in the
/// middle of its cell of 2⁻³².
pub(crate) fn sobol_02_point(k: u32) -> [f64; 2] {
    // The second coordinate's generator matrix is Pascal's triangle modulo 2: its next column is
    // the one before it, added to itself shifted.
    let (mut remaining, mut column, mut bits) = (k, 1u32 << 31, 0);
    while remaining > 0 {
        if remaining & 1 == 1 {
            bits ^= column;
        }
        remaining >>= 1;
        column ^= column >> 1;
    }
    [k.reverse_bits(), bits].map(|b| (f64::from(b) + 0.5) / 2f64.powi(32))
}

/// Point `k` of Roberts's R₂ sequence that starts at (`offset`, `offset`), in [0, 1)².
pub(crate) fn r2_point(k: usize, offset: f64) -> [f64; 2] {
    PLASTIC.map(|step| (offset + k as f64 * step).fract())
}

/// Folds the unit square along its diagonal onto the triangle u + v ≤ 1, keeping areas in
/// proportion: barycentric weights of a triangle's second and third corner.
pub(crate) fn fold_to_triangle([u, v]: [f64; 2]) -> [f64; 2] {
    if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] }
}

/// The numbers below `count`, each once, any first few of them spread over the whole range:
/// multiples, modulo `count`, of the next number after `count` × golden section that has no
/// divisor in common with it (D. E. Knuth 1973, The Art of Computer Programming 3, section 6.4).
pub(crate) fn golden_ratio_order(count: usize) -> Vec<usize> {
    let mut step = (count as f64 * 0.618_033_988_749_895) as usize;
    while step < count && greatest_common_divisor(step, count) != 1 {
        step += 1;
    }
    (0..count).map(|k| k * step % count).collect()
}

/// By Euclid's algorithm.
fn greatest_common_divisor(mut a: usize, mut b: usize) -> usize {
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sobol_points_are_one_in_each_elementary_interval() {
        // A (0,4,2)-net has one of 16 points in each box of 2⁻ᵃ × 2⁻⁽⁴⁻ᵃ⁾.
        for start in [0, 16, 48] {
            for a in 0..=4 {
                let mut boxes: Vec<u32> = (start..start + 16)
                    .map(|k| {
                        let [x, y] = sobol_02_point(k);
                        let (columns, rows) = (1 << a, 1 << (4 - a));
                        (x * f64::from(columns)) as u32 * rows + (y * f64::from(rows)) as u32
                    })
                    .collect();
                boxes.sort_unstable();
                assert_eq!(boxes, (0..16).collect::<Vec<_>>(), "{start} {a}");
            }
        }
    }

    #[test]
    fn radical_inverse_mirrors_bits() {
        assert_eq!([0, 1, 2, 3, 4].map(radical_inverse), [0.0, 0.5, 0.25, 0.75, 0.125]);
    }

    #[test]
    fn plastic_number_solves_its_equation() {
        // p³ = p + 1 divided by p³, with x = 1/p: 1 = x² + x³, off by a few roundings.
        let [x, x2] = PLASTIC;
        assert!((x * x - x2).abs() < 1e-15 && (x2 + x2 * x - 1.0).abs() < 2e-15);
    }

    #[test]
    fn golden_ratio_order_is_a_spread_permutation() {
        for count in [0, 1, 2, 3, 10, 192, 1000, 1024] {
            let order = golden_ratio_order(count);
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            let mut first: Vec<usize> = order.into_iter().take(16).collect();
            first.push(count);
            first.sort_unstable();
            // By the three-gap theorem no gap is larger than the sum of the two others, which at
            // the golden section is below 2.7 times the mean; steps are rounded.
            let gap = first.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0);
            assert!(gap as f64 <= 3.0 * count as f64 / 16.0 + 1.0, "{count}: {gap}");
        }
    }
}
