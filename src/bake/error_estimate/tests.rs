//! The estimate on synthetic observations of known error.

use super::*;
use crate::sampling::hash::split_mix64;

const COUNT: usize = 1000;

const STRATUM: Stratum = Stratum { group: Some(0), area: 3.0, ambient: 0.0 };

const CONDITIONS: Conditions = Conditions {
    strata: &[STRATUM],
    floor: 0.05,
    tail: 0.0,
    radiosity_floor: 0.05,
    mean_albedo: 0.5,
    bounces: Some(1.0),
    unshot_bound: 0.0,
};

/// A point at which all is known: radiosity is `Rgb::ONE`, so that a deviation of x in every
/// channel is a relative error of x.
fn exact() -> Observation {
    Observation {
        stratum: 0,
        weight: 1.0,
        interpolated: Rgb::ONE,
        gathered: [Rgb::ONE; 2],
        next: Rgb::ONE,
        later: Rgb::ZERO,
        element_residual: 0.1,
        excluded: false,
        escaped: 0.0,
    }
}

fn estimate_of(make: impl FnMut(usize) -> Observation) -> ErrorEstimate {
    estimate(&(0..COUNT).map(make).collect::<Vec<_>>(), &CONDITIONS).whole
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
    let none = estimate(&[], &CONDITIONS).whole;
    assert_eq!(none, ErrorEstimate::default());
}

#[test]
fn noise_counts_as_sampling_error_only() {
    for sigma in [0.001, 0.01] {
        for seed in 0..4u64 {
            let mut normal = Normal(seed << 32);
            // Vertices gather as the points do; half of their squared noise is left between them.
            let found = estimate_of(|_| Observation {
                interpolated: Rgb::ONE + sigma * AVERAGED_VARIANCE.sqrt() * normal.rgb(),
                gathered: [0, 1].map(|_| Rgb::ONE + sigma * normal.rgb()),
                next: Rgb::ZERO,
                ..exact()
            });
            // Lengths over three channels, relative to |(1, 1, 1)|: sigma again.
            let truth = sigma * AVERAGED_VARIANCE.sqrt();
            let spread = found.mesh.hypot(found.sampling);
            // |x|² of three normal numbers has a relative deviation of √(2/3): its mean over 1000
            // points is off by s = 2.6 %, plus the s that is added. Twice the mean square is
            // measured, and once the noise, s again, taken off: within 4 s each, the square is
            // right to 2 (4 + 1) s + 4 s = 14 s, its root to 7 s.
            let s = (2.0 / 3.0 / COUNT as f64).sqrt();
            assert!((spread / truth - 1.0).abs() < 7.0 * s, "{spread} {truth}");
            // All of it is noise, of which a part is called the mesh's.
            let most = 0.7f64.sqrt() * spread;
            assert!((found.sampling - most).abs() < 1e-12, "{found:?}");
        }
    }
}

#[test]
fn known_bias_counts_as_mesh_error() {
    for bias in [-0.1, 0.003, 0.2] {
        let found =
            estimate_of(|_| Observation { interpolated: (1.0 + bias) * Rgb::ONE, ..exact() });
        assert!((found.mesh / bias.abs() - 1.0).abs() < 1e-12, "{found:?}");
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
    assert!((found.sampling / (sigma * AVERAGED_VARIANCE.sqrt()) - 1.0).abs() < 0.06, "{found:?}");
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
fn a_change_grows_by_what_later_bounces_add_to_it() {
    // A change of c that each bounce multiplies by λ is c/(1 − λ) in the end. Noise of the later
    // ones that is as large as they are, and that has nothing to do with the change, does nothing.
    for (change, factor) in [(-0.01, 0.5), (0.03, 0.8)] {
        let later = change * factor / (1.0 - factor);
        let found = estimate_of(|k| {
            let (sign, noise) = ([1.0, -1.0][k % 2], [1.0, 1.0, -1.0, -1.0][k % 4]);
            Observation {
                next: (1.0 + sign * change) * Rgb::ONE,
                later: (sign + noise) * later * Rgb::ONE,
                ..exact()
            }
        });
        let expected = change.abs() / (1.0 - factor);
        assert!((found.truncation / expected - 1.0).abs() < 1e-12, "{found:?} for {expected}");
        // Later bounces that go against the next one do not make it smaller.
        let next = (1.0 + change) * Rgb::ONE;
        let found = estimate_of(|_| Observation { next, later: -later * Rgb::ONE, ..exact() });
        assert!((found.truncation / change.abs() - 1.0).abs() < 1e-12, "{found:?}");
    }
}

#[test]
fn unshot_light_is_counted_once() {
    let ambient = 0.08;
    for (bounces, passed) in
        [(None, 1.0), (Some(1.0), 0.375), (Some(2.0), 0.375 * 0.375), (Some(f64::INFINITY), 0.0)]
    {
        let strata = [Stratum { ambient: ambient * ambient, ..STRATUM }];
        let conditions = Conditions { strata: &strata, bounces, ..CONDITIONS };
        let all = [Observation { escaped: 0.25, ..exact() }; 10];
        let found = estimate(&all, &conditions).whole;
        assert!((found.unshot - ambient * passed).abs() < 1e-12 * ambient, "{found:?}");
        assert_eq!(found.truncation, 0.0);
    }
}

#[test]
fn hidden_points_have_neither_error_nor_weight() {
    let off = Observation { interpolated: 0.9 * Rgb::ONE, ..exact() };
    let hidden = Observation { excluded: true, interpolated: Rgb::ZERO, ..off };
    let found = estimate_of(|k| if k % 4 == 0 { off } else { hidden });
    assert!((found.total - 0.1).abs() < 1e-12, "{found:?}");
    assert_eq!(found.samples, COUNT / 4);
}

#[test]
fn floor_bounds_errors_of_what_is_dark() {
    let dark = Observation {
        interpolated: 0.01 * Rgb::X,
        gathered: [Rgb::ZERO; 2],
        next: Rgb::ZERO,
        ..exact()
    };
    let found = estimate_of(|_| dark);
    assert!((found.mesh - 0.01 / CONDITIONS.radiosity_floor).abs() < 1e-12, "{found:?}");
}

#[test]
fn groups_have_their_own_error_and_their_area_as_weight() {
    let strata = [(Some(4), 9.0), (Some(2), 1.0), (None, 2.0)].map(|(group, area)| Stratum {
        group,
        area,
        ambient: 0.0,
    });
    let conditions = Conditions { strata: &strata, ..CONDITIONS };
    let biases = [0.01, 0.2, 0.05];
    // As many points on each, however small.
    let point = |k: usize| Observation {
        stratum: k % 3,
        interpolated: (1.0 + biases[k % 3]) * Rgb::ONE,
        ..exact()
    };
    let all: Vec<Observation> = (0..300).map(point).collect();
    let Estimate { whole, groups, .. } = estimate(&all, &conditions);
    let square = (9.0 * 1e-4 + 1.0 * 0.04 + 2.0 * 0.0025) / 12.0;
    assert!((whole.total - f64::sqrt(square)).abs() < 1e-12, "{whole:?}");
    let found: Vec<(u32, f64)> = groups.iter().map(|g| (g.group, g.estimate.total)).collect();
    assert!(found[0].0 == 4 && (found[0].1 - 0.01).abs() < 1e-12, "{found:?}");
    assert!(found[1].0 == 2 && (found[1].1 - 0.2).abs() < 1e-12, "{found:?}");
    assert_eq!(found.len(), 2, "the small ones are judged as a part of the whole");
    assert!((groups[0].area_share - 0.75).abs() < 1e-12);
}

#[test]
fn weights_undo_uneven_densities() {
    // One point in ten where the error is in truth on one hundredth of the area.
    let found = estimate_of(|k| match k % 10 {
        0 => Observation { weight: 0.1, interpolated: 2.0 * Rgb::ONE, ..exact() },
        _ => Observation { weight: 1.1, ..exact() },
    });
    let mean_square = 0.01;
    // One standard error of a ratio is added: 100 of 1000 points have each 1e-4 of the weight.
    let standard_error =
        (100.0 * (1e-4f64 * 0.99).powi(2) + 900.0 * (1.1e-3f64 * 0.01).powi(2)).sqrt();
    let expected = (mean_square + standard_error).sqrt();
    assert!((found.total - expected).abs() < 1e-6, "{found:?} {expected}");
    assert!((found.uncertainty - standard_error / (2.0 * found.total)).abs() < 1e-6);
}

#[test]
fn residuals_are_scaled_to_the_error_of_the_mesh() {
    let off = Observation { interpolated: 0.9 * Rgb::ONE, ..exact() };
    let Estimate { whole: found, spread, .. } = estimate(&[off; 10], &CONDITIONS);
    // The residual of 0.1 is relative to |(1, 1, 1)|.
    assert!((spread.per_residual * 0.1 / 3f64.sqrt() - found.mesh).abs() < 1e-12);
    assert_eq!(spread.even, 0.0);
}

#[test]
fn by_light_a_dark_plane_changes_nothing() {
    let off = |k: usize| Observation {
        stratum: 0,
        interpolated: (1.0 + if k.is_multiple_of(2) { 0.1 } else { 0.02 }) * Rgb::ONE,
        ..exact()
    };
    let dim = 1e-9 * Rgb::ONE;
    let dark =
        Observation { stratum: 1, interpolated: dim, gathered: [dim; 2], next: dim, ..exact() };
    let strata = [STRATUM, Stratum { group: Some(1), area: 1e6 * STRATUM.area, ambient: 0.0 }];
    let conditions = Conditions { strata: &strata, radiosity_floor: 1e-7, ..CONDITIONS };
    let room: Vec<Observation> = (0..100).map(off).collect();
    let both: Vec<Observation> = room.iter().copied().chain([dark; 100]).collect();
    let alone = estimate(&room, &CONDITIONS);
    let with_plane = estimate(&both, &conditions);
    assert!(with_plane.whole.total < 1e-3, "{:?}", with_plane.whole);
    let (found, expected) = (with_plane.by_light.total, alone.whole.total);
    // The plane reflects 1e-9 of the light of each place, and has 1e6 times the area.
    assert!((found / expected - 1.0).abs() < 0.02, "{found} {expected}");
    assert!((alone.by_light.total / expected - 1.0).abs() < 1e-9, "{:?}", alone.by_light);
}

#[test]
fn a_change_at_one_point_is_as_uncertain_as_it_is_large() {
    // One of a thousand would change by all of itself: the square of the error is 1/1000, and so is
    // its standard error; that of the error is half of it, relative.
    let one = |k: usize| Observation { next: Rgb::splat(1.0 + f64::from(k == 7)), ..exact() };
    let found = estimate_of(one);
    assert!(found.truncation > 0.99 * found.total && found.mesh == 0.0, "{found:?}");
    assert!((found.uncertainty / found.total - 0.5).abs() < 0.01, "{found:?}");
}

#[test]
fn where_nothing_is_judged_there_is_no_error() {
    let hidden = estimate_of(|_| Observation { excluded: true, ..exact() });
    let ErrorEstimate { total, mesh, sampling, truncation, unshot, samples, .. } = hidden;
    let parts = [total, mesh, sampling, truncation, unshot];
    assert_eq!((parts.map(f64::to_bits), samples), ([0; 5], 0), "{parts:?}");
}
