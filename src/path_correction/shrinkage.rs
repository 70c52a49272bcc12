//! Means of many noisy points, each drawn towards the mean of all as far as it is noisier than
//! they differ.

use crate::scene::Rgb;

/// What the paths of a point found.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Missed {
    pub paths: usize,
    /// Their mean, W/m².
    mean: Rgb,
    /// Sum of squared deviations from it (Welford 1962).
    squares: Rgb,
}

impl Missed {
    /// With as many paths as to have `paths`; `sample` gives one by its number.
    pub fn more(&self, paths: usize, sample: &mut dyn FnMut(usize) -> Rgb) -> Missed {
        let mut more = *self;
        for path in self.paths..paths {
            let value = sample(path);
            let off = value - more.mean;
            more.paths += 1;
            more.mean += off / more.paths as f64;
            more.squares += off * (value - more.mean);
        }
        more
    }

    /// Variance of one path.
    fn path_variance(&self) -> Rgb {
        self.squares / (self.paths as f64 - 1.0).max(1.0)
    }
}

/// Mean and spread of what points miss.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shrinkage {
    /// μ and its variance.
    mean: Rgb,
    mean_variance: Rgb,
    /// τ².
    spread: Rgb,
    /// Mean variance of one path.
    path_variance: Rgb,
}

impl Shrinkage {
    /// Of all points. τ² is that of the method of moments (Hedges 1983) plus one standard error of
    /// it, since too small a one would hide errors.
    pub fn new(all: &[Missed]) -> Shrinkage {
        let count = (all.len() as f64).max(1.0);
        let mean_of = |of: &dyn Fn(&Missed) -> Rgb| all.iter().map(of).sum::<Rgb>() / count;
        let path_variance = mean_of(&Missed::path_variance);
        let unweighted = Shrinkage {
            mean: mean_of(&|point| point.mean),
            mean_variance: Rgb::ZERO,
            spread: Rgb::ZERO,
            path_variance,
        };
        let noise = mean_of(&|point| unweighted.noise(point));
        let squares = mean_of(&|point| (point.mean - unweighted.mean).map(|x| x * x));
        let scatter = squares * count / (count - 1.0).max(1.0);
        let uncertainty = scatter * (2.0 / (count - 1.0).max(1.0)).sqrt();
        Shrinkage {
            mean_variance: noise / count,
            spread: (scatter - noise).max(Rgb::ZERO) + uncertainty,
            ..unweighted
        }
    }

    /// s²: variance of the mean of the paths of `point`. Half of it is that of all points, since a
    /// rare bright path is missing from the scatter of most.
    fn noise(&self, point: &Missed) -> Rgb {
        0.5 * (point.path_variance() + self.path_variance) / (point.paths as f64).max(1.0)
    }

    /// w, per channel.
    fn weight(&self, point: &Missed) -> Rgb {
        let all = self.spread + self.noise(point);
        self.spread / all.max(Rgb::splat(f64::MIN_POSITIVE))
    }

    /// What `point` misses, W/m².
    pub fn missed(&self, point: &Missed) -> Rgb {
        self.mean + self.weight(point) * (point.mean - self.mean)
    }

    /// Variance of [`Shrinkage::missed`].
    pub fn variance(&self, point: &Missed) -> Rgb {
        let weight = self.weight(point);
        let rest = Rgb::ONE - weight;
        weight * self.noise(point) + rest * rest * self.mean_variance
    }

    /// Variance of what all points have in common: μ.
    pub fn common_variance(&self) -> Rgb {
        self.mean_variance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::random_numbers;

    /// A normal deviate by Box and Muller (1958).
    fn normal(rng: &mut fastrand::Rng) -> f64 {
        (-2.0 * (1.0 - rng.f64()).ln()).sqrt() * (std::f64::consts::TAU * rng.f64()).cos()
    }

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
                    (0..points).map(|_| 3.0 + spread * normal(&mut rng)).collect();
                let point = |truth: &f64| {
                    let mut sample = |_| Rgb::splat(truth + 8.0 * normal(&mut rng));
                    Missed::default().more(paths, &mut sample)
                };
                let all: Vec<Missed> = truth.iter().map(point).collect();
                let estimate = Shrinkage::new(&all);
                for (truth, point) in truth.iter().zip(&all) {
                    squares += (estimate.missed(point).x - truth).powi(2);
                    stated += estimate.variance(point).x;
                    raw += (point.mean.x - truth).powi(2);
                }
            }
            let ratio = (squares / stated).sqrt();
            // Of 4 000 deviations that are independent but for the mean of all: 3 %; τ² is stated
            // one standard error too large, 14 % of the scatter of 100 points.
            assert!(ratio > 0.7 && ratio < 1.05, "{spread} {paths}: {ratio}");
            assert!(squares < 1.02 * raw, "{spread} {paths}: {squares} {raw}");
            if spread < 0.5 {
                assert!(squares < 0.3 * raw, "{spread} {paths}: {squares} {raw}");
            }
        }
    }
}
