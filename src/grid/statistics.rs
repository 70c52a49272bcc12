//! Statistics over the points of a grid.

/// Mean, extremes and uniformity over the points of a grid, in the unit of the values.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct GridStatistics {
    /// Points that were measured.
    pub points: usize,
    /// Their mean.
    pub mean: f64,
    /// Standard error of the mean, without the error of the finite number of points.
    pub mean_error: f64,
    /// The lowest value.
    pub minimum: f64,
    /// The highest value.
    pub maximum: f64,
    /// U₀ = minimum / mean (EN 12464-1), in [0, 1]; 0 in the dark.
    pub uniformity: f64,
}

impl GridStatistics {
    /// Of values, whose mean has this standard error; `None` if there are none.
    pub fn of(values: impl Iterator<Item = f64>, mean_error: f64) -> Option<GridStatistics> {
        let (mut points, mut sum) = (0, 0.0);
        let (mut minimum, mut maximum) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values {
            points += 1;
            sum += value;
            minimum = value.min(minimum);
            maximum = value.max(maximum);
        }
        let mean = sum / f64::from(points);
        let uniformity = if mean > 0.0 { minimum / mean } else { 0.0 };
        let points = points as usize;
        (points > 0).then_some(GridStatistics {
            points,
            mean,
            mean_error,
            minimum,
            maximum,
            uniformity,
        })
    }
}
