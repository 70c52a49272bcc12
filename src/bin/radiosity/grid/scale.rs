//! The scale of a picture: round values, and colours between them.

use plotters::prelude::RGBColor;

/// Lines of equal value, at most, where their values are evenly spaced.
const LINES: f64 = 12.0;

/// Shades between two lines.
const SHADES: f64 = 4.0;

/// From this ratio of the largest to the least value on the scale is logarithmic, as where the sun
/// shines on a part.
const LOGARITHMIC_FROM: f64 = 20.0;

/// Share of the largest value that a logarithmic scale goes down to.
const DARKEST: f64 = 1e-4;

/// Viridis (S. van der Walt and N. Smith 2015) at eight even places, from dark to bright.
const COLOURS: [[f64; 3]; 8] = [
    [68.0, 1.0, 84.0],
    [70.0, 50.0, 127.0],
    [54.0, 92.0, 141.0],
    [39.0, 127.0, 142.0],
    [31.0, 161.0, 135.0],
    [74.0, 194.0, 109.0],
    [159.0, 218.0, 58.0],
    [253.0, 231.0, 37.0],
];

/// Round values, each as far from the next on the scale.
pub struct Scale {
    /// Two or more, ascending.
    values: Vec<f64>,
    is_logarithmic: bool,
}

impl Scale {
    /// From `low` or a round value below to `high` or one above.
    pub fn over([low, high]: [f64; 2]) -> Scale {
        let is_logarithmic = high > 0.0 && low * LOGARITHMIC_FROM < high;
        let values = match is_logarithmic {
            true => one_two_five(low.max(DARKEST * high), high),
            false => even(low, high),
        };
        Scale { values, is_logarithmic }
    }

    /// The round values, the ends of the scale first and last.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Round value `k` with the digits that it takes.
    pub fn text(&self, k: usize) -> String {
        let step = match self.is_logarithmic {
            true => self.values[k],
            false => self.values[1] - self.values[0],
        };
        round(self.values[k], step)
    }

    /// Where a value is on the scale, from 0 at its low end to 1 at its high one.
    pub fn share(&self, value: f64) -> f64 {
        let intervals = self.values.len() - 1;
        let first = self.values.partition_point(|v| *v <= value).clamp(1, intervals) - 1;
        let [low, high] = [self.values[first], self.values[first + 1]];
        let within = match self.is_logarithmic {
            true => (value.max(self.values[0]) / low).ln() / (high / low).ln(),
            false => (value - low) / (high - low),
        };
        ((first as f64 + within) / intervals as f64).clamp(0.0, 1.0)
    }

    /// Shades of the whole scale.
    pub fn shades(&self) -> f64 {
        (self.values.len() - 1) as f64 * SHADES
    }

    /// The colour at a share of the scale: that of its shade.
    pub fn colour(&self, share: f64) -> RGBColor {
        let shades = self.shades();
        let shade = (share * shades).floor().clamp(0.0, shades - 1.0);
        let place = shade / (shades - 1.0) * (COLOURS.len() - 1) as f64;
        let first = (place as usize).min(COLOURS.len() - 2);
        let [from, to] = [COLOURS[first], COLOURS[first + 1]];
        let mixed = |c: usize| (from[c] + (place - first as f64) * (to[c] - from[c])).round() as u8;
        RGBColor(mixed(0), mixed(1), mixed(2))
    }
}

/// Multiples of a round step from `low` or below to `high` or above.
fn even(low: f64, high: f64) -> Vec<f64> {
    // Where all is alike the scale still has a width.
    let span = (high - low).max(1e-3 * high.abs()).max(f64::MIN_POSITIVE.sqrt());
    let step = round_step(span / LINES);
    let first = (low / step).floor();
    let last = (high / step).ceil().max(first + 1.0);
    (0..=(last - first) as u32).map(|k| (first + f64::from(k)) * step).collect()
}

/// 1, 2 and 5 times powers of ten from `low` or below to `high` or above, both above 0.
fn one_two_five(low: f64, high: f64) -> Vec<f64> {
    let powers = low.log10().floor() as i32..=high.log10().ceil() as i32;
    let all = powers.flat_map(|p| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(p)));
    let all: Vec<f64> = all.collect();
    let first = all.partition_point(|v| *v <= low).max(1) - 1;
    let last = all.partition_point(|v| *v < high).min(all.len() - 1);
    all[first..=last].to_vec()
}

/// The next of 1, 2 and 5 times powers of ten that is no less than `step`.
pub fn round_step(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let all = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    all.into_iter().find(|round| *round >= step * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// A multiple of `step` with the digits that it takes.
pub fn round(value: f64, step: f64) -> String {
    let digits = (-(step * (1.0 + 1e-9)).log10().floor()).clamp(0.0, 12.0) as usize;
    let value = if value.abs() < step / 2.0 { 0.0 } else { value };
    format!("{value:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_and_numbers_are_round() {
        for (step, want) in [(0.7, 1.0), (1.0, 1.0), (1.1, 2.0), (33.0, 50.0), (0.0021, 0.005)] {
            assert!((round_step(step) / want - 1.0).abs() < 1e-12, "{step}");
        }
        let texts = [round(0.30000001, 0.1), round(-1e-17, 0.1), round(150.0, 50.0)];
        assert_eq!(texts, ["0.3", "0.0", "150"]);
    }

    #[test]
    fn scales_reach_beyond_what_they_show() {
        let scale = Scale::over([103.0, 490.0]);
        assert_eq!(scale.values(), [100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0]);
        assert!((scale.share(125.0) - 0.5 / 8.0).abs() < 1e-12 && scale.text(1) == "150");
        let sunny = Scale::over([990.0, 49000.0]);
        assert_eq!(sunny.values(), [500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4]);
        assert!((sunny.share(1e3 * 2f64.sqrt()) - 1.5 / 6.0).abs() < 1e-12);
        assert_eq!([sunny.share(0.0), sunny.share(1e9)], [0.0, 1.0]);
        for range in [[0.0, 0.0], [3.0, 3.0], [0.0, 5.0], [1e-30, 1e-30]] {
            let values = Scale::over(range).values;
            assert!(values.len() > 1 && values.is_sorted(), "{range:?}: {values:?}");
            assert!(values.iter().all(|value| value.is_finite()));
            assert!(*values.last().unwrap() >= range[1]);
        }
        assert_eq!(Scale::over([0.0, 5.0]).text(0), "0.0005");
    }
}
