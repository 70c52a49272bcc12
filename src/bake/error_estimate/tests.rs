//! The estimate on synthetic observations of known error.

use super::*;
use crate::sampling::hash::split_mix64;

const COUNT: usize = 1000;

const CONDITIONS: Conditions = Conditions {
    radiosity_floor: 0.05,
    gap: 0.1,
    mean_reflectance: 0.5,
    gather_passes: Some(1),
    ambient: 0.0,
    unshot_bound: 0.0,
};

/// A point at which all is known: radiosity is `Rgb::ONE`, so that a deviation of x in every
/// channel is a relative error of x.
fn exact() -> Observation {
    Observation {
        interpolated: Rgb::ONE,
        emitted: Rgb::ZERO,
        gathered: [Rgb::ONE; 2],
        next: Rgb::ONE,
        element_residual: 0.1,
        excluded: false,
        escaped: 0.0,
        backface: 0.0,
        inverse_distance: 1.0,
    }
}

fn estimate_of(make: impl FnMut(usize) -> Observation) -> ErrorEstimate {
    estimate(&(0..COUNT).map(make).collect::<Vec<_>>(), &CONDITIONS).0
}

/// Standard normal numbers (Box and Muller 1958).
struct Normal(u64);

impl Normal {
    fn uniform(&mut self) -> f64 {
        self.0 += 1;
        ((split_mix64(self.0) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
    }

    fn next(&mut self) -> f64 {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }

    fn rgb(&mut self) -> Rgb {
        Rgb::new(self.next(), self.next(), self.next())
    }
}

#[test]
fn exact_light_has_no_error() {
    let found = estimate_of(|_| exact());
    assert_eq!(found, ErrorEstimate { samples: COUNT, ..ErrorEstimate::default() });
    let none = estimate(&[], &CONDITIONS).0;
    assert_eq!(none, ErrorEstimate::default());
}

#[test]
fn noise_counts_as_sampling_error_only() {
    for sigma in [0.001, 0.01] {
        for seed in 0..4u64 {
            let mut normal = Normal(seed << 32);
            // Vertices gather as the points do; half of their squared noise is left between them.
            let found = estimate_of(|_| Observation {
                interpolated: Rgb::ONE + sigma * model::HALF.sqrt() * normal.rgb(),
                gathered: [0, 1].map(|_| Rgb::ONE + sigma * normal.rgb()),
                next: Rgb::ZERO,
                ..exact()
            });
            // Lengths over three channels, relative to |(1, 1, 1)|: sigma again.
            let truth = sigma * model::HALF.sqrt();
            let spread = found.mesh.hypot(found.sampling);
            // |x|² of three normal numbers has a relative deviation of √(2/3): its mean over 1000
            // points is off by s = 2.6 %, plus the s that is added. Twice the mean square is
            // measured, and once the noise, s again, taken off: within 4 s each, the square is
            // right to 2 (4 + 1) s + 4 s = 14 s, its root to 7 s.
            let s = (2.0 / 3.0 / COUNT as f64).sqrt();
            assert!((spread / truth - 1.0).abs() < 7.0 * s, "{spread} {truth}");
            // All of it is noise, of which a part is called the mesh's.
            let most = model::MAX_SAMPLING_SHARE.sqrt() * spread;
            assert!((found.sampling - most).abs() < 1e-12, "{found:?}");
        }
    }
}

#[test]
fn known_bias_counts_as_mesh_error() {
    for bias in [-0.1, 0.003, 0.2] {
        let found =
            estimate_of(|_| Observation { interpolated: (1.0 + bias) * Rgb::ONE, ..exact() });
        // Relative to the larger of the two.
        let truth = bias.abs() / (1.0 + bias).max(1.0);
        assert!((found.mesh / truth - 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!((found.sampling, found.truncation, found.unshot), (0.0, 0.0, 0.0));
        assert!((found.total - found.mesh).abs() < 1e-15);
    }
}

#[test]
fn bias_and_noise_add_up_as_squares() {
    let (bias, sigma) = (0.02, 0.01);
    let mut normal = Normal(7);
    let found = estimate_of(|_| {
        let gathered = [0, 1].map(|_| Rgb::ONE + sigma * normal.rgb());
        let interpolated = (1.0 - bias) * Rgb::ONE;
        Observation { interpolated, gathered, next: gathered[0], ..exact() }
    });
    // Exact vertices: the noise of the two gathers is taken off again. What is measured is bias² +
    // σ²/2 = 4.5e-4, whose mean over 1000 points scatters by σ/√2 · bias · 2/√1000 = 9e-6 along the
    // one direction of the bias, or 2 %; four times that in the square is 4 % in the root, and one
    // more is added.
    assert!((found.total / bias - 1.0).abs() < 0.05, "{found:?}");
    // The noise of a gather, of which vertices would have half, squared: 2.6 % off, four times.
    assert!((found.sampling / (sigma * model::HALF.sqrt()) - 1.0).abs() < 0.06, "{found:?}");
}

#[test]
fn rare_large_errors_add_a_standard_error() {
    let outliers = 10;
    let found = estimate_of(|k| match k % (COUNT / outliers) {
        0 => Observation { interpolated: 0.5 * Rgb::ONE, ..exact() },
        _ => exact(),
    });
    let p = outliers as f64 / COUNT as f64;
    let square = 0.25 * (p + (p * (1.0 - p) / COUNT as f64).sqrt());
    assert!((found.total / square.sqrt() - 1.0).abs() < 1e-12, "{found:?}");
}

#[test]
fn change_of_pass_extrapolates_geometrically() {
    for change in [-0.01, 0.03] {
        let next = (1.0 + change) * Rgb::ONE;
        let found = estimate_of(|_| Observation { next, ..exact() });
        // change (1 + ½ + ¼ + …)
        assert!((found.truncation / (2.0 * change.abs()) - 1.0).abs() < 1e-12, "{found:?}");
        // A change that differs from point to point and is none on the average is not passed on.
        let found = estimate_of(|k| match k % 2 {
            0 => Observation { next, ..exact() },
            _ => Observation { next: 2.0 * Rgb::ONE - next, ..exact() },
        });
        assert!((found.truncation / change.abs() - 1.0).abs() < 1e-12, "{found:?}");
    }
}

#[test]
fn unshot_light_is_counted_once() {
    let ambient = 0.08;
    for (gather_passes, passed) in [(None, 1.0), (Some(1), 0.375), (Some(2), 0.375 * 0.375)] {
        let conditions = Conditions { ambient, gather_passes, ..CONDITIONS };
        let all = [Observation { escaped: 0.25, ..exact() }; 10];
        let found = estimate(&all, &conditions).0;
        assert!((found.unshot / (ambient * passed) - 1.0).abs() < 1e-12, "{found:?}");
        assert_eq!(found.truncation, 0.0);
    }
}

#[test]
fn black_points_are_exact_and_gaps_left_out() {
    let off = Observation { interpolated: 0.9 * Rgb::ONE, ..exact() };
    let black = Observation { excluded: true, ..off };
    let found = estimate_of(|k| if k % 4 == 0 { off } else { black });
    assert!((found.total - 0.1 / 2.0).abs() < 1e-12, "a quarter of the area: {found:?}");
    let gap = Observation { backface: 0.6, inverse_distance: 11.0, ..black };
    let gap = Observation { excluded: false, ..gap };
    let found = estimate_of(|k| if k % 4 == 0 { exact() } else { gap });
    assert_eq!(found.total, 0.0, "{found:?}");
    let open = Observation { inverse_distance: 9.0, ..gap };
    assert!(estimate_of(|_| open).total > 0.0);
}

#[test]
fn residuals_are_scaled_to_the_error_of_the_mesh() {
    let off = Observation { interpolated: 0.9 * Rgb::ONE, ..exact() };
    let (found, spread) = estimate(&[off; 10], &CONDITIONS);
    // The residual of 0.1 is relative to |(1, 1, 1)|.
    assert!((spread.per_residual * 0.1 / 3f64.sqrt() - found.mesh).abs() < 1e-12);
    assert_eq!(spread.even, 0.0);
}
