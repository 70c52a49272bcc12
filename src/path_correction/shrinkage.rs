//! Means of many noisy points, each drawn towards the mean of all as far as it is noisier than
//! they differ.

use crate::scene::Rgb;

/// What the paths of a point found: `N` numbers a channel.
#[derive(Clone, Copy, Debug)]
pub(super) struct Missed<const N: usize> {
    pub paths: usize,
    /// Their mean, W/m².
    mean: [Rgb; N],
    /// Sum of squared deviations from it (Welford 1962).
    squares: [Rgb; N],
}

impl<const N: usize> Default for Missed<N> {
    fn default() -> Missed<N> {
        Missed { paths: 0, mean: [Rgb::ZERO; N], squares: [Rgb::ZERO; N] }
    }
}

impl<const N: usize> Missed<N> {
    /// With as many paths as to have `paths`; `sample` gives one by its number.
    pub fn more(&self, paths: usize, mut sample: impl FnMut(usize) -> [Rgb; N]) -> Missed<N> {
        let mut more = *self;
        for path in self.paths..paths {
            more.paths += 1;
            let share = 1.0 / more.paths as f64;
            for (j, value) in sample(path).into_iter().enumerate() {
                let off = value - more.mean[j];
                more.mean[j] += off * share;
                more.squares[j] += off * (value - more.mean[j]);
            }
        }
        more
    }

    /// Variance of one path.
    fn path_variance(&self) -> [Rgb; N] {
        self.squares.map(|squares| squares / (self.paths as f64 - 1.0).max(1.0))
    }
}

/// Mean and spread of what points miss.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shrinkage<const N: usize> {
    /// μ and its variance.
    mean: [Rgb; N],
    mean_variance: [Rgb; N],
    /// τ².
    spread: [Rgb; N],
    /// Mean variance of one path.
    path_variance: [Rgb; N],
}

impl<const N: usize> Shrinkage<N> {
    /// Of all points. τ² is that of the method of moments (Hedges 1983) plus one standard error of
    /// it, since too small a one would hide errors.
    pub fn new(all: &[Missed<N>]) -> Shrinkage<N> {
        let count = (all.len() as f64).max(1.0);
        let mean_of = |of: &dyn Fn(&Missed<N>) -> [Rgb; N]| {
            let mut sum = [Rgb::ZERO; N];
            for values in all.iter().map(of) {
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
            sum.map(|sum| sum / count)
        };
        let zero = [Rgb::ZERO; N];
        let mut estimate = Shrinkage {
            mean: mean_of(&|point| point.mean),
            mean_variance: zero,
            spread: zero,
            path_variance: mean_of(&Missed::path_variance),
        };
        let noise = mean_of(&|point| estimate.noise(point));
        let squares = mean_of(&|point| {
            std::array::from_fn(|j| (point.mean[j] - estimate.mean[j]).map(|x| x * x))
        });
        let others = (count - 1.0).max(1.0);
        for j in 0..N {
            let scatter = squares[j] * count / others;
            let uncertainty = scatter * (2.0 / others).sqrt();
            estimate.mean_variance[j] = noise[j] / count;
            estimate.spread[j] = (scatter - noise[j]).max(Rgb::ZERO) + uncertainty;
        }
        estimate
    }

    /// s²: variance of the mean of the paths of `point`. Half of it is that of all points, since a
    /// rare bright path is missing from the scatter of most.
    fn noise(&self, point: &Missed<N>) -> [Rgb; N] {
        let own = point.path_variance();
        let share = 0.5 / (point.paths as f64).max(1.0);
        std::array::from_fn(|j| share * (own[j] + self.path_variance[j]))
    }

    /// w of number `j`, per channel, where the noise is `noise`.
    fn weight(&self, j: usize, noise: Rgb) -> Rgb {
        self.spread[j] / (self.spread[j] + noise).max(Rgb::splat(f64::MIN_POSITIVE))
    }

    /// What `point` misses, W/m².
    pub fn missed(&self, point: &Missed<N>) -> [Rgb; N] {
        let noise = self.noise(point);
        std::array::from_fn(|j| {
            self.mean[j] + self.weight(j, noise[j]) * (point.mean[j] - self.mean[j])
        })
    }

    /// Variance of [`Shrinkage::missed`].
    pub fn variance(&self, point: &Missed<N>) -> [Rgb; N] {
        let noise = self.noise(point);
        std::array::from_fn(|j| {
            let weight = self.weight(j, noise[j]);
            let rest = Rgb::ONE - weight;
            weight * noise[j] + rest * rest * self.mean_variance[j]
        })
    }

    /// Variance of what all points have in common: μ.
    pub fn common_variance(&self) -> [Rgb; N] {
        self.mean_variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::{normal_deviate, random_numbers};

    /// Points that miss a normal with mean 3 and deviation `spread`, by paths that scatter by 8:
    /// estimates are as far off as they say, and no further than means of paths, or than the mean
    /// of all points.
    #[test]
    fn errors_are_those_that_are_stated() {
        for (spread, paths) in [(0.0, 64), (0.3, 64), (1.0, 64), (4.0, 64), (1.0, 4096)] {
            let (mut squares, mut stated, mut raw) = (0.0, 0.0, 0.0);
            let (trials, points) = (40, 100);
            for trial in 0..trials {
                let mut rng = random_numbers(&[trial, paths as u64]);
                let truth: Vec<f64> =
                    (0..points).map(|_| 3.0 + spread * normal_deviate(&mut rng)).collect();
                let point = |truth: &f64| {
                    let sample = |_| [Rgb::splat(truth + 8.0 * normal_deviate(&mut rng))];
                    Missed::default().more(paths, sample)
                };
                let all: Vec<Missed<1>> = truth.iter().map(point).collect();
                let estimate = Shrinkage::new(&all);
                for (truth, point) in truth.iter().zip(&all) {
                    squares += (estimate.missed(point)[0].x - truth).powi(2);
                    stated += estimate.variance(point)[0].x;
                    raw += (point.mean[0].x - truth).powi(2);
                }
            }
            let ratio = (squares / stated).sqrt();
            // Of 4 000 deviations that are independent but for the mean of all: 3 %; τ² is stated
            // one standard error too large, 14 % of the scatter of 100 points:
            // that is more than all of the error where points do not differ.
            let least = if spread > 0.0 { 0.7 } else { 0.4 };
            assert!(ratio > least && ratio < 1.05, "{spread} {paths}: {ratio}");
            assert!(squares < 1.02 * raw, "{spread} {paths}: {squares} {raw}");
            if spread < 0.5 {
                assert!(squares < 0.3 * raw, "{spread} {paths}: {squares} {raw}");
            }
        }
    }
}
