//! The mean square error over an area, from points at random on it.

use super::tail::trimmed;

/// Independent ways to decide whether a point is in the tail, and its square error by each.
pub(crate) const SPLITS: usize = 6;

/// The square of the error at a point, estimated.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SquareError {
    pub splits: [Split; SPLITS],
    /// Their mean: without bias; below zero at times.
    pub value: f64,
    /// The variance of it that comes from the noise of the paths; up to three times that where the
    /// error is far below the noise.
    pub noise: f64,
    /// About how much too large it is, because the true radiosity that divides it is noisy too.
    pub bias: f64,
}

/// The square of the error at a point by one split of the paths into halves that are independent.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Split {
    /// By both halves, without bias; below zero at times.
    pub value: f64,
    /// By one half alone, with its noise: decides whether the point is in the tail, so that noise
    /// of the other half has no part in that.
    pub rank: f64,
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub standard_error: f64,
}

/// The mean square error over an area.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MeanSquare {
    pub value: f64,
    pub variance: f64,
    /// The part of the variance that comes from the noise of the paths.
    pub noise: f64,
    pub bias: f64,
}

/// A point of a stratum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeasuredPoint {
    pub stratum: usize,
    /// Area that it stands for, in any unit.
    pub area: f64,
    pub error: SquareError,
}

/// The mean square error over the area that counts, and what is in the tail.
#[derive(Clone, Debug, Default)]
pub(crate) struct TrimmedSquare {
    pub mean: MeanSquare,
    /// Mean square over the tail; below zero at times, and 0 without a tail.
    pub tail: f64,
    /// Share of each point that is in the tail.
    pub in_tail: Vec<f64>,
    /// Squared error times area that each point has in the tail.
    pub tail_squares: Vec<f64>,
}

impl TrimmedSquare {
    /// Over `points`, whose area is known stratum by stratum, less a `tail` of their area. None if
    /// there are no points.
    ///
    /// The tail is chosen by one half of the paths, and squares are those of both: the mean over
    /// what is kept has no bias by the choice, and is at most as good as by the true tail. Its
    /// variance is that of the squares winsorised at the cut, over (1 − tail)² (Tukey and
    /// McLaughlin 1963), as a ratio of two sums over random points of each stratum (Cochran 1977,
    /// equation 6.13).
    pub fn new(points: &[MeasuredPoint], tail: f64) -> Option<TrimmedSquare> {
        let area: f64 = points.iter().map(|p| p.area).sum();
        if area <= 0.0 {
            return None;
        }
        let mut kept = vec![0.0; points.len()];
        let mut squares = vec![0.0; points.len()];
        let mut winsorised = vec![0.0; points.len()];
        for split in 0..SPLITS {
            let ranks: Vec<(f64, f64)> =
                points.iter().map(|p| (p.area, p.error.splits[split].rank)).collect();
            let shares = trimmed(&ranks, tail).kept;
            let value = |k: usize| points[k].error.splits[split].value;
            // The error at the cut, without noise: the mean over as much area around it.
            let [above, below] = [0.5, 1.5].map(|share| trimmed(&ranks, share * tail).kept);
            let at_cut = |k: usize| points[k].area * (above[k] - below[k]);
            let area_at_cut: f64 = (0..points.len()).map(at_cut).sum();
            let cut = (0..points.len()).map(|k| at_cut(k) * value(k)).sum::<f64>()
                / area_at_cut.max(f64::MIN_POSITIVE);
            for (k, share) in shares.into_iter().enumerate() {
                let value = value(k);
                kept[k] += share / SPLITS as f64;
                squares[k] += share * value / SPLITS as f64;
                let rest = if share < 1.0 { (1.0 - share) * cut.max(0.0) } else { 0.0 };
                winsorised[k] += (share * value + rest) / SPLITS as f64;
            }
        }
        let counted = (1.0 - tail) * area;
        let sum = |of: &dyn Fn(usize) -> f64| (0..points.len()).map(of).sum::<f64>();
        let mean = MeanSquare {
            value: sum(&|k| points[k].area * squares[k]) / counted,
            variance: variance_of_mean(points, &winsorised, counted),
            noise: sum(&|k| (points[k].area * kept[k] / counted).powi(2) * points[k].error.noise),
            bias: sum(&|k| points[k].area * kept[k] * points[k].error.bias) / counted,
        };
        let tail_squares: Vec<f64> = (0..points.len())
            .map(|k| points[k].area * (points[k].error.value - squares[k]))
            .collect();
        let in_tail: Vec<f64> = kept.iter().map(|kept| 1.0 - kept).collect();
        let tail = if tail > 0.0 { tail_squares.iter().sum::<f64>() / (tail * area) } else { 0.0 };
        Some(TrimmedSquare { mean, tail, in_tail, tail_squares })
    }
}

/// Variance of the mean of `squares` at `points` over the area `counted`: a ratio of two sums over
/// random points of each stratum (Cochran 1977, equation 6.13).
fn variance_of_mean(points: &[MeasuredPoint], squares: &[f64], counted: f64) -> f64 {
    let strata = points.iter().map(|p| p.stratum + 1).max().unwrap_or(0);
    let mut sums = vec![(0, 0.0, 0.0); strata];
    for (point, square) in points.iter().zip(squares) {
        let sum = &mut sums[point.stratum];
        *sum = (sum.0 + 1, sum.1 + point.area, sum.2 + point.area * square);
    }
    let mut variance = 0.0;
    for (point, square) in points.iter().zip(squares) {
        let (count, area, sum) = sums[point.stratum];
        let count = f64::from(count);
        let off = point.area * (square - sum / area) / counted;
        variance += off * off * count / (count - 1.0).max(1.0);
    }
    variance
}

impl MeanSquare {
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

    /// A point of this square error, known without noise.
    fn point(stratum: usize, area: f64, value: f64) -> MeasuredPoint {
        let splits = [Split { value, rank: value }; SPLITS];
        let error = SquareError { splits, value, noise: 0.005, bias: 0.0 };
        MeasuredPoint { stratum, area, error }
    }

    #[test]
    fn variance_is_that_of_many_trials() {
        let mut rng = Rng::with_seed(5);
        // Errors of a heavy tail: square 1/u, cut off at 1e4.
        let mut trial = |tail: f64| {
            let mut next = |_| point(0, 1.0, 1.0 / rng.f64().max(1e-4));
            let points: Vec<MeasuredPoint> = (0..1000).map(&mut next).collect();
            TrimmedSquare::new(&points, tail).unwrap().mean
        };
        let trials: Vec<MeanSquare> = (0..400).map(|_| trial(0.05)).collect();
        let mean = trials.iter().map(|t| t.value).sum::<f64>() / 400.0;
        // The mean of 1/u over u from 0.05 to 1.
        let truth = 20f64.ln() / 0.95;
        let variance = trials.iter().map(|t| (t.value - mean).powi(2)).sum::<f64>() / 399.0;
        let told = trials.iter().map(|t| t.variance).sum::<f64>() / 400.0;
        assert!((mean - truth).abs() < 4.0 * (variance / 400.0).sqrt() + 0.01, "{mean} {truth}");
        // A variance from 400 trials is known to 7 %.
        assert!((told / variance - 1.0).abs() < 0.25, "{told} for {variance}");
    }

    #[test]
    fn groups_count_by_their_area() {
        // Two groups of 0.75 and 0.25, points of squares 1 ± 0.5 and 5 ± 0.5.
        let points = [
            point(0, 0.375, 0.5),
            point(0, 0.375, 1.5),
            point(1, 0.125, 4.5),
            point(1, 0.125, 5.5),
        ];
        let all = TrimmedSquare::new(&points, 0.0).unwrap().mean;
        assert!((all.value - 2.0).abs() < 1e-15);
        // Each group's mean of two points has the variance 0.5²: 2 · 2 · (0.5 / 2)².
        assert!((all.variance - 0.25 * (0.5625 + 0.0625)).abs() < 1e-15);
        let root = all.root();
        assert!((root.value - 2f64.sqrt()).abs() < 1e-15);
        assert!((root.standard_error - all.variance.sqrt() / 8f64.sqrt()).abs() < 1e-15);
    }
}
