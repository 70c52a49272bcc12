use super::assert_near;
use radiosity::heat::share_below;

/// 15/π⁴ ∫ t³/(e^t − 1) dt from `z` on, by Simpson's rule over [z, z + 60]: what is
/// left out is below e^−60.
fn integral(z: f64) -> f64 {
    let intervals = 200_000;
    let step = 60.0 / f64::from(intervals);
    let at = |k: u32| {
        let t: f64 = z + step * f64::from(k);
        if t == 0.0 { 0.0 } else { t.powi(3) / t.exp_m1() }
    };
    let weight = |k: u32| if k == 0 || k == intervals { 1.0 } else { [2.0, 4.0][k as usize % 2] };
    let sum: f64 = (0..=intervals).map(|k| weight(k) * at(k)).sum();
    15.0 / std::f64::consts::PI.powi(4) * sum * step / 3.0
}

#[test]
fn share_below_is_plancks_integral() {
    // On both sides of the change from one series to the other at z = 1.5, and far from it.
    for z in [30.0, 10.0, 4.965, 2.0, 1.51, 1.49, 1.0, 0.3, 0.01] {
        let product = 14387.76877 / z;
        // Simpson's rule errs by step⁴/180 times a fourth derivative of about 1: 5e-17, and by the
        // rounding of 2e5 summands, up to 1e-13 of the sum.
        assert_near(share_below(product / 300.0, 300.0), integral(z), 1e-12);
    }
}

#[test]
fn share_below_as_in_tables() {
    // Modest, "Radiative Heat Transfer", appendix C, five decimals and their rounding.
    for (product, share) in [(1000.0, 0.00032), (3000.0, 0.27323), (6000.0, 0.73779)] {
        assert!((share_below(product, 1.0) - share).abs() < 1e-5, "{product}");
    }
}

#[test]
fn share_below_at_the_ends() {
    assert_eq!(share_below(1.0, 0.0), 0.0);
    assert_eq!(share_below(1e-300, 1e-10), 0.0);
    assert_eq!(share_below(1e300, 1e300), 1.0);
    // The long waves' share is z³/3 of π⁴/15 and falls off to 1 without a step back.
    let mut before = 0.0;
    for k in -40..40 {
        let share = share_below(10f64.powf(f64::from(k) / 4.0), 300.0);
        assert!(share >= before && share <= 1.0, "1e{k}/4 µm: {share}");
        before = share;
    }
}
