//! Scales with round numbers, for axes and for colours.

use plotters::prelude::RGBColor;

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

/// A range of values, even or logarithmic, with round numbers in it.
pub struct Scale {
    low: f64,
    high: f64,
    /// Ascending.
    round: Vec<f64>,
    is_logarithmic: bool,
}

impl Scale {
    /// From 0 to `high`, which is above 0.
    pub fn up_to(high: f64) -> Scale {
        let step = round_step(high / 6.0);
        let count = (high / step * (1.0 + 1e-9)) as u32;
        let round = (0..=count).map(|k| f64::from(k) * step).collect();
        Scale { low: 0.0, high, round, is_logarithmic: false }
    }

    /// For colours of values from `low` to `high`: from a round number below to one above.
    pub fn of_colours(low: f64, high: f64) -> Scale {
        // Logarithmic where values differ by a factor of 20, as where the sun shines on a part.
        if high > 0.0 && low * 20.0 < high {
            return Scale::logarithmic(low.max(1e-4 * high), high);
        }
        // Where all is alike the scale still has a width.
        let span = (high - low).max(1e-3 * high.abs()).max(f64::MIN_POSITIVE.sqrt());
        let step = round_step(span / 12.0);
        let first = (low / step).floor();
        let last = (high / step).ceil().max(first + 1.0);
        let round = (0..=(last - first) as u32).map(|k| (first + f64::from(k)) * step).collect();
        Scale::between(round, false)
    }

    /// From 1, 2 or 5 times a power of ten, `low` or below, to one that is `high` or above; both
    /// are above 0.
    pub fn logarithmic(low: f64, high: f64) -> Scale {
        let powers = libm::log10(low).floor() as i32..=libm::log10(high).ceil() as i32;
        let all = powers.flat_map(|p| [1.0, 2.0, 5.0].map(|digit| digit * 10f64.powi(p)));
        let all: Vec<f64> = all.collect();
        let first = all.partition_point(|v| *v <= low).max(1) - 1;
        let last = all.partition_point(|v| *v < high).clamp(first + 1, all.len() - 1);
        Scale::between(all[first..=last].to_vec(), true)
    }

    fn between(round: Vec<f64>, is_logarithmic: bool) -> Scale {
        Scale { low: round[0], high: round[round.len() - 1], round, is_logarithmic }
    }

    /// The round numbers, each with the digits that it takes.
    pub fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let step = |value: f64| match self.is_logarithmic {
            true => value,
            false => self.round.get(1).map_or(self.high, |second| second - self.round[0]),
        };
        self.round.iter().map(move |&value| (value, text(value, step(value))))
    }

    /// Where a value is on the scale, from 0 at its low end to 1 at its high one.
    pub fn share(&self, value: f64) -> f64 {
        let share = match self.is_logarithmic {
            true => libm::log(value.max(self.low) / self.low) / libm::log(self.high / self.low),
            false => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }

    /// The colour at a share of the scale.
    pub fn colour(share: f64) -> RGBColor {
        let place = share * (COLOURS.len() - 1) as f64;
        let first = (place as usize).min(COLOURS.len() - 2);
        let [from, to] = [COLOURS[first], COLOURS[first + 1]];
        let mixed = |c: usize| (from[c] + (place - first as f64) * (to[c] - from[c])).round() as u8;
        RGBColor(mixed(0), mixed(1), mixed(2))
    }
}

/// The next of 1, 2 and 5 times powers of ten that is no less than `step`.
fn round_step(step: f64) -> f64 {
    let power = libm::pow(10f64, libm::log10(step).floor());
    let all = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    all.into_iter().find(|round| *round >= step * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// A multiple of `step` with the digits that it takes.
fn text(value: f64, step: f64) -> String {
    let digits = (-libm::log10(step * (1.0 + 1e-9)).floor()).clamp(0.0, 12.0) as usize;
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
        let texts = [text(0.30000001, 0.1), text(-1e-17, 0.1), text(150.0, 50.0)];
        assert_eq!(texts, ["0.3", "0.0", "150"]);
        let metres: Vec<String> = Scale::up_to(3.0).ticks().map(|(_, text)| text).collect();
        assert_eq!(metres, ["0.0", "0.5", "1.0", "1.5", "2.0", "2.5", "3.0"]);
    }

    #[test]
    fn scales_of_colours_reach_beyond_what_they_show() {
        let scale = Scale::of_colours(103.0, 490.0);
        assert_eq!(scale.round, [100.0, 150.0, 200.0, 250.0, 300.0, 350.0, 400.0, 450.0, 500.0]);
        assert!((scale.share(125.0) - 0.5 / 8.0).abs() < 1e-12);
        let sunny = Scale::of_colours(990.0, 49000.0);
        assert_eq!(sunny.round, [500.0, 1e3, 2e3, 5e3, 1e4, 2e4, 5e4]);
        assert!((sunny.share(5e3) - 0.5).abs() < 1e-12);
        assert_eq!([sunny.share(0.0), sunny.share(1e9)], [0.0, 1.0]);
        for [low, high] in [[0.0, 0.0], [3.0, 3.0], [0.0, 5.0], [1e-30, 1e-30]] {
            let scale = Scale::of_colours(low, high);
            assert!(scale.round.len() > 1 && scale.round.is_sorted(), "{low} {high}");
            assert!(scale.round.iter().all(|value| value.is_finite()) && scale.high >= high);
            assert!(scale.ticks().count() == scale.round.len() && scale.share(high).is_finite());
        }
    }

    #[test]
    fn colours_go_from_dark_to_bright() {
        let sum = |share| {
            let RGBColor(r, g, b) = Scale::colour(share);
            u32::from(r) + u32::from(g) + u32::from(b)
        };
        let sums: Vec<u32> = (0..=7).map(|k| sum(f64::from(k) / 7.0)).collect();
        assert!(sums.is_sorted() && sum(0.0) == 153 && sum(1.0) == 521, "{sums:?}");
    }
}
