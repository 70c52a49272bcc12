//! Means of values over cells within cells, by few noisy samples.
//!
//! ```text
//!   ┌───────────────┐   the value of a cell differs from that of the cell around it with variance
//!   │       ┌───┬───┤   τ², one for each level (a random-effects model on a tree: Chou, Willsky
//!   │       ├───┼─┬─┤   and Benveniste 1994). What samples say of a cell goes up to the cells
//!   │       │   ├─┼─┤   around it, by weights 1/(s² + τ²), and what these say comes down again, so
//!   └───────┴───┴─┴─┘   that a cell takes from its surroundings what its own samples lack.
//! ```
//!
//! Variances s² and τ² are estimated from the samples: s² by their scatter within cells, τ² by the
//! scatter of cells within the cell around them beyond that (analysis of variance: Searle, Casella
//! and McCulloch 1992).

use glam::DVec3 as Value;
use rustc_hash::FxHashMap;

/// One sample of the value at an item.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub item: u32,
    pub value: [f32; 3],
}

/// Items in cells within cells, the last of which has all.
pub(super) struct NestedCells {
    /// The finest cell of each item.
    pub cells: Vec<u32>,
    /// Level by level from the finest, the cell of the next level around each.
    parents: Vec<Vec<u32>>,
}

/// An estimate and its variance, a sum over the channels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    pub value: Value,
    pub variance: f64,
}

/// Sums over the samples of a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    samples: f64,
    sum: Value,
    /// Of squared lengths.
    squares: f64,
    /// Of the items of the cell.
    area: f64,
}

/// Sums for τ² of one level.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SpreadSums {
    excess: f64,
    weight: f64,
    /// Of `excess`.
    variance: f64,
}

impl NestedCells {
    /// Cells with edges of 2⁻ᵈ, d = `depth`, and of twice that, and so on up to 1, around items at
    /// these points of `N` dimensions, moved by `shift`.
    pub fn new<const N: usize>(points: &[[f32; N]], depth: i32, shift: [f32; N]) -> NestedCells {
        let scale = 2f32.powi(depth);
        let key = |point: &[f32; N]| -> [i32; N] {
            std::array::from_fn(|k| ((point[k] + shift[k]) * scale).floor() as i32)
        };
        let (cells, mut keys) = numbered(points.iter().map(key));
        let mut parents = vec![];
        for _ in 0..depth {
            let (parent, above) = numbered(keys.iter().map(|key| key.map(|k| k >> 1)));
            parents.push(parent);
            keys = above;
        }
        parents.push(vec![0; keys.len()]);
        NestedCells { cells, parents }
    }

    /// Number of cells of `level`, from the finest.
    pub fn count(&self, level: usize) -> usize {
        self.parents[level].len()
    }

    /// Without the finest `levels`.
    pub fn coarsened(&self, levels: usize) -> NestedCells {
        let mut cells = self.cells.clone();
        for parent in &self.parents[..levels] {
            cells.iter_mut().for_each(|cell| *cell = parent[*cell as usize]);
        }
        NestedCells { cells, parents: self.parents[levels..].to_vec() }
    }

    /// Number of levels below that of the cell around all items.
    pub fn levels(&self) -> usize {
        self.parents.len()
    }

    /// The items in an order that has those of each cell of each level together.
    pub fn order(&self) -> Vec<u32> {
        let mut order: Vec<u32> = (0..self.cells.len() as u32).collect();
        let mut cells = self.cells.clone();
        for parent in &self.parents {
            order.sort_by_key(|&item| cells[item as usize]);
            cells.iter_mut().for_each(|cell| *cell = parent[*cell as usize]);
        }
        order
    }

    /// Sums over samples, level by level from the finest.
    fn sums(&self, samples: &[Sample], areas: &[f64]) -> Vec<Vec<Sums>> {
        let mut finest = vec![Sums::default(); self.count(0)];
        for (&cell, area) in self.cells.iter().zip(areas) {
            finest[cell as usize].area += area;
        }
        for sample in samples {
            let value = Value::from_array(sample.value.map(f64::from));
            let sums = &mut finest[self.cells[sample.item as usize] as usize];
            sums.samples += 1.0;
            sums.sum += value;
            sums.squares += value.length_squared();
        }
        let mut levels = vec![finest];
        for (l, parent) in self.parents.iter().enumerate() {
            let count = self.parents.get(l + 1).map_or(1, Vec::len);
            let mut above = vec![Sums::default(); count];
            for (sums, &cell) in levels[l].iter().zip(parent) {
                above[cell as usize].add(sums);
            }
            levels.push(above);
        }
        levels
    }
}

/// Numbers for `keys`, the same for the same key, and the keys by number.
fn numbered<const N: usize>(keys: impl Iterator<Item = [i32; N]>) -> (Vec<u32>, Vec<[i32; N]>) {
    let (mut numbers, mut distinct) = (FxHashMap::default(), vec![]);
    let number = |key| {
        *numbers.entry(key).or_insert_with(|| {
            distinct.push(key);
            distinct.len() as u32 - 1
        })
    };
    (keys.map(number).collect(), distinct)
}

impl Sums {
    fn add(&mut self, other: &Sums) {
        self.samples += other.samples;
        self.sum += other.sum;
        self.squares += other.squares;
        self.area += other.area;
    }

    fn mean(&self) -> Value {
        self.sum / self.samples.max(1.0)
    }

    /// The sum of squared distances from the mean.
    fn scatter(&self) -> f64 {
        (self.squares - self.samples * self.mean().length_squared()).max(0.0)
    }
}

/// What samples say of nested cells.
pub(super) struct CellSamples<'a> {
    nested: &'a NestedCells,
    sums: Vec<Vec<Sums>>,
    /// Variance of a sample within a cell, level by level from the finest: one for all cells. Those
    /// of single cells would favour cells that miss the rare bright samples, and with them values
    /// that are too low.
    variances: Vec<f64>,
}

impl<'a> CellSamples<'a> {
    /// Of items with these `areas`.
    pub fn new(nested: &'a NestedCells, samples: &[Sample], areas: &[f64]) -> CellSamples<'a> {
        let sums = nested.sums(samples, areas);
        let variance = |cells: &Vec<Sums>| {
            let freedom: f64 = cells.iter().map(|cell| (cell.samples - 1.0).max(0.0)).sum();
            cells.iter().map(Sums::scatter).sum::<f64>() / freedom.max(1.0)
        };
        let variances = sums.iter().map(variance).collect();
        CellSamples { nested, sums, variances }
    }

    /// Adds the sums for τ² of each level to `spreads`, from the finest.
    pub fn add_spreads(&self, spreads: &mut [SpreadSums]) {
        for (l, spread) in spreads.iter_mut().enumerate() {
            let mut own = vec![SpreadSums::default(); self.sums[l + 1].len()];
            let variance = self.variances[l];
            for (sums, &cell) in self.sums[l].iter().zip(&self.nested.parents[l]) {
                let around = &self.sums[l + 1][cell as usize];
                let (off, share) = (sums.mean() - around.mean(), sums.samples / around.samples);
                if sums.samples > 0.0 {
                    let own = &mut own[cell as usize];
                    own.excess += sums.samples * off.length_squared() - variance * (1.0 - share);
                    own.weight += sums.samples * (1.0 - share);
                    own.variance += 2.0 * variance * variance * (1.0 - share);
                }
            }
            for (own, around) in own.iter().zip(&self.sums[l + 1]) {
                spread.add(around, own.excess, own.weight, own.variance);
            }
        }
    }

    /// Estimates of the finest cells, where cells of each level differ by `spreads`, τ².
    pub fn estimates(&self, spreads: &[f64]) -> Vec<Estimate> {
        let filtered = self.filtered(spreads);
        let mut estimates = filtered[self.nested.levels()].clone();
        for (l, parent) in self.nested.parents.iter().enumerate().rev() {
            let smoothed = |(own, &cell): (&Estimate, &u32)| {
                let around = estimates[cell as usize];
                own.smoothed(around, spreads[l])
            };
            estimates = filtered[l].iter().zip(parent).map(smoothed).collect();
        }
        estimates
    }

    /// What the samples of each cell alone say of it, level by level from the finest; of infinite
    /// variance without a sample.
    fn filtered(&self, spreads: &[f64]) -> Vec<Vec<Estimate>> {
        let finest = |sums: &Sums| Estimate {
            value: sums.mean(),
            variance: match sums.samples > 0.0 {
                true => self.variances[0] / sums.samples,
                false => f64::INFINITY,
            },
        };
        let mut levels: Vec<Vec<Estimate>> = vec![self.sums[0].iter().map(finest).collect()];
        for (l, parent) in self.nested.parents.iter().enumerate() {
            let mut sums = vec![(Value::ZERO, 0.0); self.sums[l + 1].len()];
            for (own, &cell) in levels[l].iter().zip(parent) {
                // Without any scatter all weights would be infinite.
                let weight = 1.0 / (own.variance + spreads[l]).max(f64::MIN_POSITIVE);
                sums[cell as usize].0 += weight * own.value;
                sums[cell as usize].1 += weight;
            }
            let mean = |&(sum, weight): &(Value, f64)| Estimate {
                value: if weight > 0.0 { sum / weight } else { Value::ZERO },
                variance: 1.0 / weight,
            };
            levels.push(sums.iter().map(mean).collect());
        }
        levels
    }
}

impl Estimate {
    /// This estimate, by a cell's own samples, with that of the cell `around` it, which has them
    /// too (Rauch, Tung and Striebel 1965).
    fn smoothed(self, around: Estimate, spread: f64) -> Estimate {
        if !self.variance.is_finite() {
            return Estimate { variance: around.variance + spread, ..around };
        }
        let predicted = self.variance + spread;
        let gain = if predicted > 0.0 { self.variance / predicted } else { 0.0 };
        let less = gain * gain * (around.variance - predicted);
        Estimate {
            value: self.value + gain * (around.value - self.value),
            variance: (self.variance + less).max(0.0),
        }
    }
}

impl SpreadSums {
    /// Adds those of a cell: cells count by area, however many samples they have.
    fn add(&mut self, cell: &Sums, excess: f64, weight: f64, variance: f64) {
        let share = cell.area / cell.samples.max(1.0);
        self.excess += share * excess;
        self.weight += share * weight;
        self.variance += share * share * variance;
    }

    /// τ², and its variance; `parts` are sums that the same samples are in.
    pub fn spread(&self, parts: f64) -> [f64; 2] {
        let weight = self.weight.max(f64::MIN_POSITIVE);
        [self.excess.max(0.0) / weight, parts * self.variance / (weight * weight)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::{normal_deviate, random_numbers};

    /// 64 × 64 items in cells that differ from those around them by normal deviates, and samples
    /// that scatter by 3: estimates are as far off as they say, less than means of samples are, and
    /// less than the mean of all.
    #[test]
    fn errors_are_those_that_are_stated() {
        let points: Vec<[f32; 2]> =
            (0..64 * 64).map(|k| [k % 64, k / 64].map(|x| (x as f32 + 0.5) / 64.0)).collect();
        let nested = NestedCells::new(&points, 4, [0.0; 2]);
        let areas = vec![1.0; points.len()];
        for deviations in [[0.0, 0.0, 0.0, 0.3], [0.5, 0.3, 0.2, 0.1], [0.1, 0.2, 0.3, 0.5]] {
            let (mut squares, mut stated, mut of_means, mut of_all) = (0.0, 0.0, 0.0, 0.0);
            for trial in 0..40 {
                let mut rng = random_numbers(&[trial]);
                let truth = cells_that_differ(&nested, deviations, &mut rng);
                let sample = |k: usize| {
                    let item = (k % points.len()) as u32;
                    let value = truth[nested.cells[item as usize] as usize];
                    let noise = 3.0 * normal_deviate(&mut rng);
                    Sample { item, value: [(value + noise) as f32, 0.0, 0.0] }
                };
                let samples: Vec<Sample> = (0..4 * points.len()).map(sample).collect();
                let cells = CellSamples::new(&nested, &samples, &areas);
                let mut sums = vec![SpreadSums::default(); nested.levels()];
                cells.add_spreads(&mut sums);
                let spreads: Vec<f64> = sums.iter().map(|sums| sums.spread(1.0)[0]).collect();
                let all = cells.sums[nested.levels()][0].mean().x;
                for (j, estimate) in cells.estimates(&spreads).iter().enumerate() {
                    squares += (estimate.value.x - truth[j]).powi(2);
                    stated += estimate.variance;
                    of_means += (cells.sums[0][j].mean().x - truth[j]).powi(2);
                    of_all += (all - truth[j]).powi(2);
                }
            }
            // Of some 10 000 deviations, of which those of a trial have its spreads in common.
            // Where cells do not differ, spreads are above 0 by noise alone, and stated all the
            // same.
            let ratio = (squares / stated).sqrt();
            println!(
                "{deviations:?}: {ratio:.3} {:.3} {:.3}",
                squares / of_means,
                squares / of_all
            );
            let least = if deviations[0] > 0.0 { 0.9 } else { 0.5 };
            assert!(ratio > least && ratio < 1.1, "{deviations:?}: {ratio}");
            assert!(squares < 0.9 * of_means && squares < 0.5 * of_all, "{deviations:?}");
        }
    }

    /// A value for each of the finest cells: sums of one deviate for each cell that it is in, whose
    /// standard deviations are given from the finest level on.
    fn cells_that_differ(
        nested: &NestedCells,
        deviations: [f64; 4],
        rng: &mut fastrand::Rng,
    ) -> Vec<f64> {
        let mut values = vec![1.0];
        for (l, parent) in nested.parents.iter().enumerate().rev() {
            let deviation = deviations.get(l).copied().unwrap_or(0.0);
            let value = |&cell: &u32| values[cell as usize] + deviation * normal_deviate(rng);
            values = parent.iter().map(value).collect();
        }
        values
    }
}
