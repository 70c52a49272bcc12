//! The estimated error of a result: statistics of what random points observe.
//!
//! At each point the radiosity that the vertices interpolate to is compared with two independent
//! gathers there, `a` and `b`, and with a gather `c` of the result itself (one more bounce):
//!
//! ```text
//! interpolated − (a+b)/2   mesh + sampling + noise of the two gathers
//!     a − b                noise of one gather, twice: sampling
//!     c − a                what one more sweep would change: truncation
//! ```
//!
//! All are relative to the radiosity, and averaged over the points as squares. The squared error of
//! mesh and sampling is the first, plus one standard error of that mean, less half the noise; that of
//! truncation continues the change as a geometric series in the mean reflectance. Light not shot is
//! added as if it fell like the ambient term. This file does no gathering: see
//! [`estimator`](super::estimator).

use glam::DVec3;

use crate::bake::model;
use crate::scene::Rgb;
use crate::visibility::buried;

/// An estimate of the error of vertex radiosity: root mean square over the area, relative to the
/// radiosity. The squares of the parts add up to that of the total.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Radiosity is linear over the faces of the mesh, and light is not.
    pub mesh: f64,
    /// Gathers take a finite number of pixels or rays: half the mean squared difference of two
    /// independently rotated gathers.
    pub sampling: f64,
    /// Gathering stops after some sweeps: the change under one more, extrapolated by the geometric
    /// series in the mean reflectance.
    pub truncation: f64,
    /// Light that was not shot, if it fell as evenly as the ambient term.
    pub unshot: f64,
    /// An exact upper bound: no more than this share of all radiosity times area is missing because it
    /// was not shot, in the worst channel.
    pub unshot_bound: f64,
    /// Random points that were used.
    pub samples: usize,
}

/// What was found at a random point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Radiosity that the vertices interpolate to, W/m².
    pub interpolated: Rgb,
    /// The part of it that is emitted, W/m².
    pub emitted: Rgb,
    /// Radiosity by two gathers there, rotated independently, W/m².
    pub gathered: [Rgb; 2],
    /// Radiosity by a gather of the result itself, with the rays of the first, W/m².
    pub next: Rgb,
    /// What the middle of the element may be off by, up to a common factor, W/m².
    pub element_residual: f64,
    /// Whether the surface reflects nothing there, or the point is buried under another surface: the
    /// error there is none, or cannot be known.
    pub excluded: bool,
    /// Share of the hemisphere in which nothing is seen.
    pub escaped: f64,
    /// Share in which back faces are seen.
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, per scene unit.
    pub inverse_distance: f64,
}

/// What is known of the scene and of the solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conditions {
    /// See [`radiosity_floor`], W/m².
    pub radiosity_floor: f64,
    /// Mean distance below which a dim or hidden point is in a gap, scene unit.
    pub gap: f64,
    /// Mean reflectance over the area, of the channel in which it is highest.
    pub mean_reflectance: f64,
    /// Times that all vertices have gathered; none if the light is that of the elements.
    pub sweeps: Option<u32>,
    /// Root mean square of the ambient term over the radiosity it falls on.
    pub ambient: f64,
    /// See [`ErrorEstimate::unshot_bound`].
    pub unshot_bound: f64,
}

/// How the error is spread over the vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ErrorSpread {
    /// Error of the mesh per element residual.
    pub per_residual: f64,
    /// Relative error of all other parts, the same everywhere.
    pub even: f64,
}

/// A point's observation, relative to the radiosity there.
struct Deviation {
    /// Of the interpolated radiosity from the gathered one.
    interpolation: DVec3,
    /// Squared noise of one gather.
    noise: f64,
    /// Change under one more sweep.
    next: DVec3,
    /// Squared element residual.
    residual: f64,
}

/// Radiosity below which errors are relative to this instead, W/m²: a share of the mean reflected
/// radiosity. What is darker is not worth most of the elements.
pub(super) fn radiosity_floor(reflected: impl ExactSizeIterator<Item = Rgb>) -> f64 {
    let count = reflected.len().max(1) as f64;
    let sum = reflected.map(|reflected| reflected.length()).sum::<f64>();
    (model::RADIOSITY_FLOOR * sum / count).max(f64::MIN_POSITIVE)
}

/// The error by what was observed at random points, spread evenly over the area.
pub(super) fn estimate(
    observations: &[Observation],
    conditions: &Conditions,
) -> (ErrorEstimate, ErrorSpread) {
    let deviations: Vec<Deviation> =
        observations.iter().filter_map(|o| o.deviation(conditions)).collect();
    let used = deviations.len().max(1) as f64;
    // Of points that reflect nothing all is known: their error is none.
    let share = used / observations.len().max(1) as f64;
    let (interpolation, sampling) = interpolation_and_sampling(&deviations);
    let mesh = interpolation - sampling;
    let unshot = unshot(observations, conditions) / share.max(1e-30);
    // Light that was not shot is a part of what one more sweep would change.
    let truncation = (truncation(&deviations, conditions) - unshot).max(0.0);
    let residual = mean(&deviations, |d| d.residual);
    let estimate = ErrorEstimate {
        total: ((interpolation + truncation + unshot) * share).sqrt(),
        mesh: (mesh * share).sqrt(),
        sampling: (sampling * share).sqrt(),
        truncation: (truncation * share).sqrt(),
        unshot: (unshot * share).sqrt(),
        unshot_bound: conditions.unshot_bound,
        samples: observations.len(),
    };
    let spread = ErrorSpread {
        per_residual: (mesh / residual.max(1e-30)).sqrt(),
        even: (sampling + truncation + unshot).sqrt(),
    };
    (estimate, spread)
}

impl Observation {
    /// The observation relative to the radiosity; none where there is no judging it.
    fn deviation(&self, conditions: &Conditions) -> Option<Deviation> {
        if self.excluded {
            return None;
        }
        let floor = conditions.radiosity_floor;
        let [first, second] = self.gathered;
        let truth = (first + second) / 2.0;
        let dim_or_behind = truth.length() < floor || self.backface > buried::HIDDEN_SAMPLE;
        if dim_or_behind && self.inverse_distance * conditions.gap > 1.0 {
            return None;
        }
        let scale = truth.length().max(self.interpolated.length()).max(floor);
        Some(Deviation {
            interpolation: (self.interpolated - truth) / scale,
            noise: ((first - second) / scale).length_squared() / 2.0,
            next: (self.next - first) / scale,
            residual: (self.element_residual / scale).powi(2),
        })
    }
}

fn mean(deviations: &[Deviation], value: impl Fn(&Deviation) -> f64) -> f64 {
    deviations.iter().map(value).sum::<f64>() / deviations.len().max(1) as f64
}

/// Squared error of mesh and sampling together, and of sampling alone.
fn interpolation_and_sampling(deviations: &[Deviation]) -> (f64, f64) {
    let count = deviations.len().max(1) as f64;
    let noise = mean(deviations, |d| d.noise);
    let squares = mean(deviations, |d| d.interpolation.length_squared());
    // The largest errors are at rare points: one standard error of the mean is added to it.
    let variance = mean(deviations, |d| (d.interpolation.length_squared() - squares).powi(2));
    let squares = squares + (variance / count).sqrt();
    let interpolation = (squares - model::HALF * noise).max(model::MIN_ERROR_SHARE * squares);
    let sampling = (model::HALF * noise).min(model::MAX_SAMPLING_SHARE * interpolation);
    (interpolation, sampling)
}

/// Squared error of stopping after some sweeps.
fn truncation(deviations: &[Deviation], conditions: &Conditions) -> f64 {
    let gathered = conditions.sweeps.is_some();
    // The elements' own light is changed by a first sweep to what was gathered at the points.
    let change = |d: &Deviation| if gathered { d.next } else { -d.interpolation };
    let count = deviations.len().max(1) as f64;
    let bias = deviations.iter().map(change).sum::<DVec3>() / count;
    let reflectance = conditions.mean_reflectance;
    let series = bias.length() / (1.0 - reflectance);
    if gathered {
        // Both gathers cast the same rays, so that their difference has little noise.
        mean(deviations, |d| (change(d) - bias).length_squared()) + series * series
    } else {
        (series * reflectance).powi(2)
    }
}

/// Squared error of light that was not shot, over all points: each sweep passes on the share of it
/// that is reflected and does not escape.
fn unshot(observations: &[Observation], conditions: &Conditions) -> f64 {
    let escaped = observations.iter().map(|o| o.escaped).sum::<f64>();
    let escaped = escaped / observations.len().max(1) as f64;
    let passed = match conditions.sweeps {
        Some(sweeps) => (conditions.mean_reflectance * (1.0 - escaped)).powi(sweeps as i32),
        None => 1.0,
    };
    (conditions.ambient * passed).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::split_mix64;

    const COUNT: usize = 1000;

    const CONDITIONS: Conditions = Conditions {
        radiosity_floor: 0.05,
        gap: 0.1,
        mean_reflectance: 0.5,
        sweeps: Some(1),
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
    fn what_is_exact_has_no_error() {
        let found = estimate_of(|_| exact());
        assert_eq!(found, ErrorEstimate { samples: COUNT, ..ErrorEstimate::default() });
        let none = estimate(&[], &CONDITIONS).0;
        assert_eq!(none, ErrorEstimate::default());
    }

    #[test]
    fn normal_noise_is_found_as_sampling_and_gathers_are_not_charged_with_it() {
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
    fn a_known_bias_is_found_as_the_error_of_the_mesh() {
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
        // Exact vertices: the noise of the two gathers is taken off again. What is measured is
        // bias² + σ²/2 = 4.5e-4, whose mean over 1000 points scatters by σ/√2 · bias · 2/√1000 = 9e-6
        // along the one direction of the bias, or 2 %; four times that in the square is 4 % in the root,
        // and one more is added.
        assert!((found.total / bias - 1.0).abs() < 0.05, "{found:?}");
        // The noise of a gather, of which vertices would have half, squared: 2.6 % off, four times.
        assert!((found.sampling / (sigma * model::HALF.sqrt()) - 1.0).abs() < 0.06, "{found:?}");
    }

    #[test]
    fn rare_large_errors_count_with_one_standard_error_more() {
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
    fn what_one_more_sweep_changes_goes_on_as_a_geometric_series() {
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
    fn light_not_shot_is_passed_on_by_every_sweep_and_not_counted_twice() {
        let ambient = 0.08;
        for (sweeps, passed) in [(None, 1.0), (Some(1), 0.375), (Some(2), 0.375 * 0.375)] {
            let conditions = Conditions { ambient, sweeps, ..CONDITIONS };
            let all = [Observation { escaped: 0.25, ..exact() }; 10];
            let found = estimate(&all, &conditions).0;
            assert!((found.unshot / (ambient * passed) - 1.0).abs() < 1e-12, "{found:?}");
            assert_eq!(found.truncation, 0.0);
        }
    }

    #[test]
    fn points_that_reflect_nothing_are_exact_and_points_in_gaps_are_left_out() {
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
}
