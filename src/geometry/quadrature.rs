//! Quadrature rules: on an interval, over triangles and over parallelograms.
//!
//! | rule | points | for |
//! |---|---|---|
//! | Gauss–Legendre | 2, 3, 4, 6 | smooth integrands on [0, 1]; exact to degree 2n − 1 |
//! | Gauss–Jacobi, weight u | 2, 3 | the direction from the tip of a triangle, see below |
//! | tanh–sinh | until convergence | integrands that are singular at the ends of an interval |
//! | Radon | 7 | a triangle, exact to degree 5, with a rule of degree 2 on the same points |
//!
//! A triangle abc is the square of (u, v) collapsed towards its tip a,
//! x = a + u ((b − a) + v (c − b)), dx = 2 · area · u du dv: a product of two rules on [0, 1], the
//! factor u being part of the integrand or of the weights.
//!
//! The number of Gauss points for an integrand depends on the distance of its singularities. On an
//! interval of half length 1 with the nearest singularity at imaginary distance z, n points err by
//! about ρ^(−2n) of the integral, where ρ = z + √(z² + 1) is the sum of the half axes of the
//! largest ellipse with foci ±1 in which the integrand is analytic (L. N. Trefethen, Approximation
//! Theory and Approximation Practice, 2013, chapter 19). Form factors of polygons are singular
//! where the polygons touch, so that z is the gap between two of them in radii of the one
//! integrated over:
//!
//! | gap, radii | points a direction | ρ^(−2n) | constant |
//! |---|---|---|---|
//! | 8 | 6 | 16^(−12) = 4e-15 | [`SIX_POINT_MIN_GAP`] |
//! | 64 | 4 | 128^(−8) = 1e-17 | [`FOUR_POINT_MIN_GAP`] |
//! | 8 | 3 | 16^(−6) = 6e-8 | [`THREE_POINT_MIN_GAP`] |
//! | 40 | 2 | 80^(−4) = 2e-8 | [`TWO_POINT_MIN_GAP`] |
//!
//! The first two rows serve closed forms, exact up to rounding; the last two serve view factors,
//! whose error is reported with them.

use std::f64::consts::{FRAC_PI_4, PI};
use std::sync::LazyLock;

use glam::DVec3;

/// Gap, in radii of the polygon integrated over, from which six Gauss points per direction err by
/// at most 4e-15 of the integral.
pub(crate) const SIX_POINT_MIN_GAP: f64 = 8.0;

/// Gap, in radii of the polygon integrated over, from which four Gauss points per direction err by
/// at most 1e-17 of the integral. Six would do as well; four are cheaper.
pub(crate) const FOUR_POINT_MIN_GAP: f64 = 64.0;

/// Gap, in radii of the larger polygon, from which three Gauss points per direction err by at most
/// 6e-8 of the integral.
pub(crate) const THREE_POINT_MIN_GAP: f64 = 8.0;

/// Gap, in radii of the larger polygon, from which two Gauss points per direction err by at most
/// 2e-8 of the integral.
pub(crate) const TWO_POINT_MIN_GAP: f64 = 40.0;

/// A point of a rule on [0, 1].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    /// Position in [0, 1].
    pub x: f64,
    /// Weight; those of a rule add up to the integral of its weight function over [0, 1].
    pub weight: f64,
}

const fn node(x: f64, weight: f64) -> Node {
    Node { x, weight }
}

/// Gauss–Legendre rule of two points on [0, 1]: (1 ∓ 1/√3)/2.
pub(crate) const GAUSS_LEGENDRE_2: [Node; 2] =
    [node(0.211_324_865_405_187_1, 0.5), node(0.788_675_134_594_812_9, 0.5)];

/// Gauss–Legendre rule of three points on [0, 1]: (1 ∓ √(3/5))/2 and 1/2, weights 5/18, 8/18, 5/18.
pub(crate) const GAUSS_LEGENDRE_3: [Node; 3] = [
    node(0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    node(0.5, 0.444_444_444_444_444_4),
    node(0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];

/// Gauss–Legendre rule of four points on [0, 1] (M. Abramowitz, I. A. Stegun, Handbook of
/// Mathematical Functions, 1964, table 25.4, moved from [−1, 1]).
const GAUSS_LEGENDRE_4: [Node; 4] = [
    node(0.069_431_844_202_973_71, 0.173_927_422_568_726_92),
    node(0.330_009_478_207_571_87, 0.326_072_577_431_273_05),
    node(0.669_990_521_792_428_1, 0.326_072_577_431_273_05),
    node(0.930_568_155_797_026_3, 0.173_927_422_568_726_92),
];

/// Gauss–Legendre rule of six points on [0, 1] (the same table).
const GAUSS_LEGENDRE_6: [Node; 6] = [
    node(0.033_765_242_898_423_99, 0.085_662_246_189_585_18),
    node(0.169_395_306_766_867_73, 0.180_380_786_524_069_3),
    node(0.380_690_406_958_401_56, 0.233_956_967_286_345_52),
    node(0.619_309_593_041_598_5, 0.233_956_967_286_345_52),
    node(0.830_604_693_233_132_2, 0.180_380_786_524_069_3),
    node(0.966_234_757_101_576, 0.085_662_246_189_585_18),
];

/// Gauss–Jacobi rule of two points on [0, 1] with weight u, from the tip of a triangle: (6 ∓ √6)/10
/// (the same book, table 25.8, k = 1).
pub(crate) const GAUSS_JACOBI_2: [Node; 2] = [
    node(0.355_051_025_721_682_2, 0.181_958_618_256_022_83),
    node(0.844_948_974_278_317_8, 0.318_041_381_743_977_17),
];

/// Gauss–Jacobi rule of three points on [0, 1] with weight u (the same table).
pub(crate) const GAUSS_JACOBI_3: [Node; 3] = [
    node(0.212_340_538_239_152_94, 0.069_826_979_901_454_12),
    node(0.590_533_135_559_265_3, 0.229_241_106_359_586_24),
    node(0.911_412_040_487_296_1, 0.200_931_913_738_959_63),
];

/// The Gauss–Legendre rule for an integrand that is singular `gap` radii away, at least
/// [`SIX_POINT_MIN_GAP`]; error at most 4e-15 of the integral.
pub(crate) fn gauss_legendre_for_gap(gap: f64) -> &'static [Node] {
    if gap < FOUR_POINT_MIN_GAP { &GAUSS_LEGENDRE_6 } else { &GAUSS_LEGENDRE_4 }
}

/// The point (u, v) of a triangle collapsed towards its first corner: u = 0 there, 1 on the side
/// opposite; v goes along that side.
pub(crate) fn collapsed_point([a, b, c]: [DVec3; 3], u: f64, v: f64) -> DVec3 {
    a + u * ((b - a) + v * (c - b))
}

/// Nodes of the tanh–sinh rule in the nearer half of [0, 1]: `x` is the distance from either end.
/// Level k has the nodes that step 2^−(k+1) adds to those of twice that step.
static TANH_SINH: LazyLock<Vec<Vec<Node>>> = LazyLock::new(|| {
    let node_at = |s: f64| {
        let x = 1.0 / (1.0 + libm::exp(PI * libm::sinh(s)));
        node(x, PI * libm::cosh(s) * x * (1.0 - x))
    };
    let level = |k: u32| {
        let step = 0.5_f64.powi(k as i32 + 1);
        let stride = if k == 0 { 1 } else { 2 };
        let nodes = (1..).step_by(stride).map(move |i: u32| node_at(f64::from(i) * step));
        // Less changes no sum of terms near 1.
        nodes.take_while(|node| node.weight > 1e-18).collect()
    };
    // The finest step is 2⁻⁷.
    (0..7).map(level).collect()
});

/// ∫ f over [from, to], f analytic inside but perhaps singular at the ends: the tanh–sinh rule
/// (H. Takahasi, M. Mori, "Double exponential formulas for numerical integration", Publ. RIMS 9,
/// 1974), refined until two levels agree to 1e-13.
pub(crate) fn tanh_sinh(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let length = to - from;
    let mut sum = FRAC_PI_4 * f(from + 0.5 * length);
    let mut step = 1.0;
    let mut value = f64::INFINITY;
    for level in TANH_SINH.iter() {
        let both_ends = |x: f64| f(from + x * length) + f(to - x * length);
        sum += level.iter().map(|node| node.weight * both_ends(node.x)).sum::<f64>();
        step *= 0.5;
        let coarser = std::mem::replace(&mut value, step * sum);
        // In units of the integrand, which callers keep near 1. The error about squares with each
        // level, so that only rounding is left.
        if (value - coarser).abs() <= 1e-13 {
            break;
        }
    }
    length * value
}

/// A point of Radon's rule over a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleNode {
    /// The point.
    pub point: DVec3,
    /// Weight in the rule of degree five; all add up to 1.
    pub degree_5: f64,
    /// Weight in the rule of degree two on the same points; all add up to 1.
    pub degree_2: f64,
}

/// The seven points over a triangle of Radon's rule, exact to degree five (J. Radon, 1948;
/// A. H. Stroud, Approximate Calculation of Multiple Integrals, 1971, T2:5-1).
///
/// Four of the points with other weights are exact to degree two: the difference of the two sums
/// estimates the smoothness of the integrand.
pub(crate) fn radon_nodes([a, b, c]: [DVec3; 3]) -> [TriangleNode; 7] {
    // The weights of the rule of degree two have seven digits only, so that it errs by 3e-8 for
    // polynomials of degree two: accurate enough for the difference that estimates an error.
    let (degree_5, degree_2) = (0.225, 0.484_123_183_164);
    // (6 ∓ √15)/21 and (155 ∓ √15)/1200.
    let orbits = [
        (0.101_286_507_323_456_34, 0.125_939_180_544_827_15, 0.171_958_938_945),
        (0.470_142_064_105_115_1, 0.132_394_152_788_506_2, 0.0),
    ];
    let mut nodes = [TriangleNode { point: (a + b + c) / 3.0, degree_5, degree_2 }; 7];
    let mut at = 1;
    for (share, degree_5, degree_2) in orbits {
        for (p, q, r) in [(a, b, c), (b, c, a), (c, a, b)] {
            let point = share * (p + q) + (1.0 - 2.0 * share) * r;
            nodes[at] = TriangleNode { point, degree_5, degree_2 };
            at += 1;
        }
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Largest error of a rule with weight u^`power` over the monomials that it integrates exactly.
    fn moment_error(rule: &[Node], power: i32) -> f64 {
        let error = |degree: i32| {
            let sum: f64 = rule.iter().map(|node| node.weight * node.x.powi(degree)).sum();
            (sum - 1.0 / f64::from(degree + power + 1)).abs()
        };
        (0..2 * rule.len() as i32).map(error).fold(0.0, f64::max)
    }

    #[test]
    fn gauss_rules_integrate_degree_2n_minus_1() {
        // Terms below 1, each rounded to 1e-16 a few times.
        for rule in [&GAUSS_LEGENDRE_2[..], &GAUSS_LEGENDRE_3, &GAUSS_LEGENDRE_4, &GAUSS_LEGENDRE_6]
        {
            assert!(moment_error(rule, 0) < 4e-16, "{} points", rule.len());
        }
        for rule in [&GAUSS_JACOBI_2[..], &GAUSS_JACOBI_3] {
            assert!(moment_error(rule, 1) < 4e-16, "{} points", rule.len());
        }
    }

    #[test]
    fn gauss_rule_errors_match_table() {
        // 1/(z² + x²) on [−1, 1] is singular at ±iz and integrates to 2 atan(1/z)/z.
        let cases = [
            (SIX_POINT_MIN_GAP, &GAUSS_LEGENDRE_6[..]),
            (FOUR_POINT_MIN_GAP, &GAUSS_LEGENDRE_4),
            (THREE_POINT_MIN_GAP, &GAUSS_LEGENDRE_3),
            (TWO_POINT_MIN_GAP, &GAUSS_LEGENDRE_2),
        ];
        for (z, rule) in cases {
            let f = |x: f64| 1.0 / (z * z + x * x);
            let sum: f64 = rule.iter().map(|node| 2.0 * node.weight * f(2.0 * node.x - 1.0)).sum();
            let right = 2.0 * (1.0 / z).atan() / z;
            let rho = z + (z * z + 1.0).sqrt();
            // For the finest rule only rounding is left.
            let bound = 2.0 * rho.powi(-2 * rule.len() as i32) + 1e-15;
            assert!((sum / right - 1.0).abs() < bound, "{z}: {sum} for {right}");
        }
    }

    #[test]
    fn tanh_sinh_bears_singular_ends() {
        // Both ends singular: ∫ (ln x + √(1 − x)) = −1/3; smooth: ∫ cos = sin 2 − sin 1.
        let log = tanh_sinh(0.0, 1.0, |x| x.ln() + (1.0 - x).sqrt());
        assert!((log + 1.0 / 3.0).abs() < 1e-13, "{log}");
        let smooth = tanh_sinh(1.0, 2.0, f64::cos);
        assert!((smooth - (2f64.sin() - 1f64.sin())).abs() < 1e-13, "{smooth}");
    }

    #[test]
    fn radon_rule_integrates_degree_five() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let nodes = radon_nodes([DVec3::ZERO, DVec3::X, DVec3::Y]);
        for (i, j) in (0..=5).flat_map(|i| (0..=5 - i).map(move |j| (i, j))) {
            // Mean of xⁱyʲ over the triangle (0,0), (1,0), (0,1).
            let right = 2.0 * factorial(i) * factorial(j) / factorial(i + j + 2);
            let term = |node: &TriangleNode| node.point.x.powi(i) * node.point.y.powi(j);
            let five: f64 = nodes.iter().map(|node| node.degree_5 * term(node)).sum();
            assert!((five - right).abs() < 1e-15, "{i} {j}: {five} for {right}");
            let two: f64 = nodes.iter().map(|node| node.degree_2 * term(node)).sum();
            // The weights of the inner rule have seven digits.
            assert!(i + j > 2 || (two - right).abs() < 1e-7, "{i} {j}: {two} for {right}");
        }
    }
}
