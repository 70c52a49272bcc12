//! From paths at points to errors with uncertainties.

use crate::accuracy::mean_square::{SPLITS, Split, SquareError};
use crate::scene::Rgb;

/// The paths of a point are in this many parts, each independent of the others.
pub(super) const PARTS: usize = 4;

/// What was traced at a point, W/m².
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// Reflected radiosity of the solution.
    pub solution: Rgb,
    /// Mean reflected radiosity by each part of the paths.
    pub parts: [Rgb; PARTS],
}

impl Sample {
    /// The mean of all paths.
    pub fn measured(&self) -> Rgb {
        mean(&self.parts)
    }

    /// The square of the length of the standard error of the mean.
    pub fn variance(&self) -> f64 {
        let mean = self.measured();
        let spread: f64 = self.parts.iter().map(|part| part.distance_squared(mean)).sum();
        spread / (PARTS * (PARTS - 1)) as f64
    }

    /// The square of |solution − true| / max(|true|, `floor`).
    pub fn square_error(&self, floor: f64) -> SquareError {
        let mut splits = [Split::default(); SPLITS];
        splits
            .iter_mut()
            .zip(splits_of(self.solution, &self.parts, floor))
            .for_each(|(s, of)| *s = of);
        let value = splits.iter().map(|split| split.value).sum::<f64>() / SPLITS as f64;
        // Jackknife (Tukey 1958): what the estimate is without each part.
        let without = |k: usize| {
            let mut rest = self.parts.to_vec();
            rest.remove(k);
            square_error(self.solution, &rest, floor)
        };
        let without: [f64; PARTS] = std::array::from_fn(without);
        let middle = without.iter().sum::<f64>() / PARTS as f64;
        let spread: f64 = without.iter().map(|w| (w - middle).powi(2)).sum();
        let noise = spread * (PARTS - 1) as f64 / PARTS as f64;
        // E[1/t²] = (1 + 3 s²) / E[t]² to second order; half the paths are in it.
        let size = self.measured().length_squared().max(floor * floor);
        let relative_variance = if size > 0.0 { 2.0 * self.variance() / size } else { 0.0 };
        SquareError { splits, value, noise, bias: 3.0 * relative_variance * value.max(0.0) }
    }
}

/// The squares by all pairs of `parts`, of any number from three on: two parts in the product
/// (solution − true)·(solution − true), the others in the length that divides it, so that no noise
/// is multiplied with itself.
fn splits_of(solution: Rgb, parts: &[Rgb], floor: f64) -> impl Iterator<Item = Split> {
    let count = parts.len();
    let pairs = (0..count).flat_map(|j| (0..j).map(move |i| (i, j)));
    pairs.map(move |(i, j)| {
        let others = (0..count).filter(|&k| k != i && k != j).map(|k| parts[k]);
        let other = others.sum::<Rgb>() / (count - 2) as f64;
        let size = other.length_squared().max(floor * floor);
        let product = (solution - parts[i]).dot(solution - parts[j]);
        // In a scene without light no light is right.
        let ratio = |square: f64| if square == 0.0 { 0.0 } else { square / size };
        Split { value: ratio(product), rank: ratio(solution.distance_squared(other)) }
    })
}

/// The mean over all pairs of `parts`.
fn square_error(solution: Rgb, parts: &[Rgb], floor: f64) -> f64 {
    let values = splits_of(solution, parts, floor).map(|split| split.value);
    let (sum, pairs) = values.fold((0.0, 0.0), |(sum, pairs), value| (sum + value, pairs + 1.0));
    sum / pairs
}

fn mean(parts: &[Rgb]) -> Rgb {
    parts.iter().sum::<Rgb>() / parts.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::mean_square::{MeanSquare, MeasuredPoint, TrimmedSquare};
    use fastrand::Rng;

    /// Samples of a true radiosity `truth` with noise of deviation `noise` in every part.
    fn samples(solution: f64, truth: f64, noise: f64) -> Vec<Sample> {
        let mut rng = Rng::with_seed(1);
        let mut part = |_| {
            // Uniform, of the deviation asked for.
            let mut value = || truth + noise * 12f64.sqrt() * (rng.f64() - 0.5);
            Rgb::new(value(), value(), value())
        };
        let mut sample =
            |_| Sample { solution: Rgb::splat(solution), parts: std::array::from_fn(&mut part) };
        (0..20_000).map(&mut sample).collect()
    }

    fn points(samples: &[Sample], floor: f64) -> Vec<MeasuredPoint> {
        let point =
            |s: &Sample| MeasuredPoint { stratum: 0, area: 1.0, error: s.square_error(floor) };
        samples.iter().map(point).collect()
    }

    fn measured(samples: &[Sample], floor: f64) -> MeanSquare {
        TrimmedSquare::new(&points(samples, floor), 0.0).unwrap().mean
    }

    #[test]
    fn trim_takes_the_largest_errors_and_no_noise() {
        // A point in fifty is off by 60 %, the others by 3 %, with noise of 8 % in each part.
        let mut all = samples(1.03, 1.0, 0.08);
        let large = Rgb::splat(1.6);
        all.iter_mut().step_by(50).for_each(|sample| sample.solution = large);
        let (usual, tail): (f64, f64) = (0.03 * 0.03, 0.6 * 0.6);
        for (trim, mean, rest) in [
            // Without a tail; a tail of half of the large ones; of all of them; of twice as many,
            // half of which are like those that are kept.
            (0.0, 0.98 * usual + 0.02 * tail, 0.0),
            (0.01, (0.98 * usual + 0.01 * tail) / 0.99, tail),
            (0.02, usual, tail),
            (0.04, usual, (tail + usual) / 2.0),
        ] {
            let found = TrimmedSquare::new(&points(&all, 0.05), trim).unwrap();
            let (value, off) = (found.mean.value - found.mean.bias, found.mean.variance.sqrt());
            // The bias is known to a tenth of itself.
            let close = 4.0 * off + 0.1 * found.mean.bias;
            assert!((value - mean).abs() < close, "{trim}: {value} for {mean}, {found:?}");
            // The half that chooses divides by its own length: noise of 6 % there makes those that
            // it chooses among equals too large by about as much.
            assert!((found.tail - rest).abs() < 0.08 * rest + 1e-12, "{trim}: {}", found.tail);
            let area: f64 = found.in_tail.iter().sum();
            assert!((area - trim * all.len() as f64).abs() < 1e-6);
        }
    }

    #[test]
    fn noise_of_paths_is_no_error() {
        // Noise of 8 % in each part: an error of 3 % is found, and none where there is none.
        for solution in [1.0, 1.03, 0.97] {
            let mean = measured(&samples(solution, 1.0, 0.08), 0.05);
            let (truth, off) = ((solution - 1.0).powi(2), mean.variance.sqrt());
            assert!((mean.value - mean.bias - truth).abs() < 4.0 * off, "{solution}: {mean:?}");
            // All that varies here is noise: right by a jackknife where the estimate is linear
            // in it, threefold where it is but a product of noise with noise (pairs of four parts).
            assert!((0.9..3.3).contains(&(mean.noise / mean.variance)), "{solution}: {mean:?}");
        }
    }

    #[test]
    fn dark_points_count_by_the_floor() {
        let sample = Sample { solution: Rgb::X, parts: [Rgb::ZERO; PARTS] };
        assert_eq!(sample.square_error(0.5).value, 4.0);
        let same = Sample { solution: Rgb::ZERO, ..sample };
        assert_eq!(same.square_error(0.0).value, 0.0);
    }
}
