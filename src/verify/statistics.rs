//! From paths at points to errors with uncertainties.

use crate::scene::Rgb;

/// The paths of a point are in this many parts, each independent of the others.
pub(super) const PARTS: usize = 4;

/// Dark points count as no darker than this share of the mean reflected radiosity.
pub(super) const FLOOR: f64 = 0.05;

/// What was traced at a point, W/m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Reflected radiosity that the solution tells.
    pub told: Rgb,
    /// Reflected radiosity that each part of the paths found.
    pub parts: [Rgb; PARTS],
}

/// The square of the error at a point, estimated.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SquareError {
    /// Without bias; below zero at times.
    pub value: f64,
    /// The variance of it that comes from the noise of the paths; up to three times that where the
    /// error is far below the noise.
    pub noise: f64,
    /// About how much too large it is, because the true radiosity that divides it is noisy too.
    pub bias: f64,
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

impl Sample {
    /// The mean of all paths.
    pub fn found(&self) -> Rgb {
        mean(&self.parts)
    }

    /// The square of the length of the standard error of the mean.
    pub fn variance(&self) -> f64 {
        let found = self.found();
        let spread: f64 = self.parts.iter().map(|part| part.distance_squared(found)).sum();
        spread / (PARTS * (PARTS - 1)) as f64
    }

    /// The square of |told − true| / max(|true|, `floor`).
    pub fn square_error(&self, floor: f64) -> SquareError {
        let value = square_error(self.told, &self.parts, floor);
        // Jackknife (Tukey 1958): what the estimate is without each part.
        let without = |k: usize| {
            let mut rest = self.parts.to_vec();
            rest.remove(k);
            square_error(self.told, &rest, floor)
        };
        let without: [f64; PARTS] = std::array::from_fn(without);
        let middle = without.iter().sum::<f64>() / PARTS as f64;
        let spread: f64 = without.iter().map(|w| (w - middle).powi(2)).sum();
        let noise = spread * (PARTS - 1) as f64 / PARTS as f64;
        // E[1/t²] = (1 + 3 s²) / E[t]² to second order; half the paths are in it.
        let size = self.found().length_squared().max(floor * floor);
        let relative_variance = if size > 0.0 { 2.0 * self.variance() / size } else { 0.0 };
        SquareError { value, noise, bias: 3.0 * relative_variance * value.max(0.0) }
    }
}

/// Means over pairs of parts: two in the product (told − true)·(told − true), the others in the
/// length that divides it, so that no noise is multiplied with itself.
fn square_error(told: Rgb, parts: &[Rgb], floor: f64) -> f64 {
    let (mut sum, mut pairs) = (0.0, 0.0);
    for j in 0..parts.len() {
        for i in 0..j {
            let others = (0..parts.len()).filter(|&k| k != i && k != j).map(|k| parts[k]);
            let size = others.sum::<Rgb>() / (parts.len() - 2) as f64;
            let product = (told - parts[i]).dot(told - parts[j]);
            let size = size.length_squared().max(floor * floor);
            // In a scene without light no light is right.
            sum += if product == 0.0 { 0.0 } else { product / size };
            pairs += 1.0;
        }
    }
    sum / pairs
}

fn mean(parts: &[Rgb]) -> Rgb {
    parts.iter().sum::<Rgb>() / parts.len() as f64
}

/// The mean square error over an area, from points at random on it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct MeanSquare {
    pub value: f64,
    pub variance: f64,
    /// The part of the variance that comes from the noise of the paths.
    pub noise: f64,
    pub bias: f64,
}

impl MeanSquare {
    /// Over a group, from its points and the areas that they stand for; none from fewer than two.
    pub fn of_group(points: &[(f64, SquareError)]) -> Option<MeanSquare> {
        let count = points.len() as f64;
        if points.len() < 2 {
            return None;
        }
        let area: f64 = points.iter().map(|(area, _)| area).sum();
        let sum = |of: &dyn Fn(f64, &SquareError) -> f64| -> f64 {
            points.iter().map(|(part, point)| of(part / area, point)).sum()
        };
        let value = sum(&|share, p| share * p.value);
        // A ratio of two sums over random points (Cochran 1977, equation 6.13).
        let spread = sum(&|share, p| (share * (p.value - value)).powi(2));
        Some(MeanSquare {
            value,
            variance: spread * count / (count - 1.0),
            noise: sum(&|share, p| share * share * p.noise),
            bias: sum(&|share, p| share * p.bias),
        })
    }

    /// Over all groups, each with its share of the area.
    pub fn stratified(groups: impl Iterator<Item = (f64, MeanSquare)> + Clone) -> MeanSquare {
        let whole: f64 = groups.clone().map(|(share, _)| share).sum();
        groups.fold(MeanSquare::default(), |sum, (share, group)| {
            let share = share / whole;
            MeanSquare {
                value: sum.value + share * group.value,
                variance: sum.variance + share * share * group.variance,
                noise: sum.noise + share * share * group.noise,
                bias: sum.bias + share * group.bias,
            }
        })
    }

    /// The root: by the delta method, and near zero by what a variance of that size may hide.
    pub fn root(&self) -> Estimate {
        let (value, off) = (self.value.max(0.0).sqrt(), self.variance.sqrt());
        let standard_error = if off > 0.0 { off / (2.0 * value).max(off.sqrt()) } else { 0.0 };
        Estimate { value, standard_error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use fastrand::Rng;

    /// Samples of a true radiosity `truth` with noise of deviation `noise` in every part.
    fn samples(told: f64, truth: f64, noise: f64) -> Vec<Sample> {
        let mut rng = Rng::with_seed(1);
        let mut part = |_| {
            // Uniform, of the deviation asked for.
            let mut value = || truth + noise * 12f64.sqrt() * (rng.f64() - 0.5);
            Rgb::new(value(), value(), value())
        };
        let mut sample =
            |_| Sample { told: Rgb::splat(told), parts: std::array::from_fn(&mut part) };
        (0..20_000).map(&mut sample).collect()
    }

    fn measured(samples: &[Sample], floor: f64) -> MeanSquare {
        let squares: Vec<_> = samples.iter().map(|s| (1.0, s.square_error(floor))).collect();
        MeanSquare::of_group(&squares).unwrap()
    }

    #[test]
    fn noise_of_paths_is_no_error() {
        // Noise of 8 % in each part: an error of 3 % is found, and none where there is none.
        for told in [1.0, 1.03, 0.97] {
            let mean = measured(&samples(told, 1.0, 0.08), 0.05);
            let (truth, off) = ((told - 1.0).powi(2), mean.variance.sqrt());
            assert!((mean.value - mean.bias - truth).abs() < 4.0 * off, "{told}: {mean:?}");
            // All that varies here is noise: told right by a jackknife where the estimate is linear
            // in it, threefold where it is but a product of noise with noise (pairs of four parts).
            assert!((0.9..3.3).contains(&(mean.noise / mean.variance)), "{told}: {mean:?}");
        }
    }

    #[test]
    fn dark_points_count_by_the_floor() {
        let sample = Sample { told: Rgb::X, parts: [Rgb::ZERO; PARTS] };
        assert_eq!(sample.square_error(0.5).value, 4.0);
        let same = Sample { told: Rgb::ZERO, ..sample };
        assert_eq!(same.square_error(0.0).value, 0.0);
    }

    #[test]
    fn groups_count_by_their_area() {
        let group = |value| MeanSquare { value, variance: 0.01, noise: 0.005, bias: 0.0 };
        let groups = [(0.75, group(1.0)), (0.25, group(5.0))];
        let all = MeanSquare::stratified(groups.into_iter());
        assert!((all.value - 2.0).abs() < 1e-15);
        assert!((all.variance - 0.01 * (0.5625 + 0.0625)).abs() < 1e-15);
        let root = all.root();
        assert!((root.value - 2f64.sqrt()).abs() < 1e-15);
        assert!((root.standard_error - all.variance.sqrt() / 8f64.sqrt()).abs() < 1e-15);
    }
}
