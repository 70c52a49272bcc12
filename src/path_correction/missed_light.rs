//! What the light of a bake misses at points, by paths that neighbours share.
//!
//! Points near each other miss nearly the same. So a point needs few paths of its own, or none:
//! what it misses is estimated over [nested cells](super::nested_cells) of points that are alike,
//! in position, normal and brightness: what arrives on two sides of a wall differs. Several sets of
//! cells, shifted at random, are averaged, so that no edges of cells show.

use std::ops::ControlFlow;

use arrayvec::ArrayVec;
use glam::DVec3;
use rayon::prelude::*;

use super::nested_cells::{
    CellSamples, Estimate, ItemSamples, NestedCells, SampleSums, SpreadSums, Value,
};
use crate::sampling::low_discrepancy::radical_inverse;
use crate::sampling::random::random_numbers;
use crate::sampling::surface::AreaSampler;
use crate::work::{Batches, agree};

/// Sets of cells: the edges of one show with an eighth of its steps.
const SETS: usize = 8;

/// Mean number of paths of a finest cell, at least. Plain choice.
const PATHS_OF_CELL: usize = 32;

/// Paths of the first round: bring what all points miss in common to 1 % of itself where paths
/// scatter by 2.5 times their mean.
const FIRST_PATHS: usize = 1 << 16;

/// Maximum number of paths of a point in the first round. Plain choice.
const FIRST_PATHS_OF_POINT: usize = 256;

/// Maximum number of paths: minutes on a few cores.
const MAX_PATHS: usize = 1 << 27;

/// Position, normal and octave of light in the space of cells: two normals a radian apart are as
/// far from each other as two points half a unit apart, and so is light of 1 and 16. Plain choices;
/// no recorded measurement.
const SHARE_OF_NORMAL: f64 = 0.5;
const SHARE_OF_OCTAVE: f64 = 0.125;

/// A point that paths start from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathOrigin {
    /// In a unit in which all are about 1 apart.
    pub position: DVec3,
    /// Unit normal; zero where light arrives from all sides.
    pub normal: DVec3,
    /// W/m²: what its errors are a share of, above 0.
    pub scale: f64,
    /// Area that it stands for, or its weight.
    pub area: f64,
}

/// When there are enough paths. Errors are shares of the scales of points.
#[derive(Clone, Debug)]
pub(crate) enum Goal {
    /// The root mean square over area of standard errors is at most this.
    Mean(f64),
    /// The variance at each point, a sum over the numbers, is at most this. Where that is not above
    /// 0 paths do not help.
    Each(Vec<f64>),
}

/// What is missed at points, as shares of their scales.
#[derive(Clone, Debug)]
pub(crate) struct MissedLight<const M: usize> {
    pub missed: Vec<Value<M>>,
    /// Variance of `missed`, a sum over the numbers.
    pub variance: Vec<f64>,
    /// The share of each number in `variance`.
    pub shares: Value<M>,
    /// Variance of the mean over area of what is missed in W/m², a sum over the numbers, at most.
    pub mean_variance: f64,
    /// Root mean square of the standard errors over area.
    pub error: f64,
    /// Number of paths.
    pub paths: usize,
    /// Whether the goal is.
    pub is_reached: bool,
}

/// The paths so far.
struct Paths<'a, const M: usize> {
    origins: &'a [PathOrigin],
    areas: Vec<f64>,
    /// Octave of the scale of each, from the darkest.
    octaves: Vec<u32>,
    sets: Vec<NestedCells>,
    /// Origins in an order that has neighbours together.
    order: Vec<u32>,
    /// Those with samples, and where each is among them.
    samples: Vec<ItemSamples<M>>,
    slots: Vec<u32>,
    count: usize,
    /// Variance of a sample by octave, once there are samples.
    noise: Vec<f64>,
}

/// A slot of no samples.
const NO_SLOT: u32 = u32::MAX;

/// What is missed at `origins`, by paths whose number grows until the `goal` is reached, or there
/// are as many as can be. By an estimate beforehand the root mean square of what is missed is
/// `expected` and surely less than a `bound`, which hold as far as paths do not contradict; both
/// are infinite where nothing is known. The edge of the finest cells is `finest` to twice that.
/// `sample` gives what path number `path` finds missing at an origin, W/m², without bias. None
/// where `progress`, as in [`super::correct_by_paths`], stops the work.
pub(crate) fn missed_light<const M: usize>(
    origins: &[PathOrigin],
    finest: f64,
    expected: [f64; 2],
    goal: &Goal,
    sample: impl Fn(usize, usize) -> Value<M> + Sync,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Option<MissedLight<M>> {
    let mut paths = Paths::new(origins, finest);
    let mut open = vec![1.0; origins.len()];
    let mut more = first_paths(origins);
    loop {
        let all = paths.count + more;
        if paths.trace(more, &open, &sample, |done| progress(done, all)).is_break() {
            return None;
        }
        let mut missed = paths.missed(expected);
        open = goal.open(&missed);
        missed.is_reached = goal.is_reached(&missed);
        if paths.count >= MAX_PATHS || open.iter().all(|&share| share == 0.0) {
            return Some(missed);
        }
        // Rounds are few also where few points are open, or neighbours had the paths.
        more = paths.of(&open).max(paths.count / 16);
    }
}

/// Number of paths of the first round.
fn first_paths(origins: &[PathOrigin]) -> usize {
    FIRST_PATHS.min(FIRST_PATHS_OF_POINT * origins.len())
}

/// What errors of values of these `sizes` are shares of: each is at least the share `floor` of
/// their mean.
pub(crate) fn scales(sizes: impl Iterator<Item = f64> + Clone, floor: f64) -> Vec<f64> {
    let (count, sum) = sizes.clone().fold((0.0, 0.0), |(n, sum), size| (n + 1.0, sum + size));
    // Where nothing arrived, what paths find is taken as it is.
    let least = if sum > 0.0 { floor * sum / count } else { 1.0 };
    sizes.map(|size| size.max(least)).collect()
}

impl Goal {
    /// How many more paths points need, over those so far: as many as take their variance to the
    /// goal if it is all noise, up to 1; 0 where it is reached.
    fn open<const M: usize>(&self, missed: &MissedLight<M>) -> Vec<f64> {
        let share = |variance: f64, most: f64| (variance / most - 1.0).min(1.0);
        match self {
            Goal::Mean(error) => {
                let share = share(missed.error * missed.error, error * error).max(0.0);
                vec![share; missed.variance.len()]
            }
            Goal::Each(most) => {
                let open = |&(variance, &most): &(&f64, &f64)| most > 0.0 && *variance > most;
                let each = missed.variance.iter().zip(most);
                each.map(|p| if open(&p) { share(*p.0, *p.1) } else { 0.0 }).collect()
            }
        }
    }

    fn is_reached<const M: usize>(&self, missed: &MissedLight<M>) -> bool {
        match self {
            Goal::Mean(error) => missed.error <= *error,
            Goal::Each(most) => missed.variance.iter().zip(most).all(|(v, most)| v <= most),
        }
    }
}

impl PathOrigin {
    /// In the space of cells.
    fn point(&self) -> [f32; 7] {
        let [x, y, z] = self.position.to_array();
        let [u, v, w] = (SHARE_OF_NORMAL * self.normal).to_array();
        [x, y, z, u, v, w, SHARE_OF_OCTAVE * libm::log2(self.scale)].map(|x| x as f32)
    }
}

impl<const M: usize> Paths<'_, M> {
    fn new(origins: &[PathOrigin], finest: f64) -> Paths<'_, M> {
        let points: Vec<[f32; 7]> = origins.iter().map(PathOrigin::point).collect();
        // 2⁻²⁰ is what 32-bit floats resolve of the unit.
        let depth = (-libm::log2(finest)).floor().clamp(1.0, 20.0) as i32;
        let set = |k: usize| {
            let mut rng = random_numbers(&[k as u64]);
            NestedCells::new(&points, depth, std::array::from_fn(|_| rng.f32()))
        };
        let sets: Vec<NestedCells> = (0..SETS).into_par_iter().map(set).collect();
        let areas = origins.iter().map(|origin| origin.area).collect();
        let octaves: Vec<f64> = origins.iter().map(|origin| libm::log2(origin.scale)).collect();
        let darkest = octaves.iter().copied().fold(f64::INFINITY, f64::min);
        let octaves: Vec<u32> = octaves.iter().map(|octave| (octave - darkest) as u32).collect();
        let noise = vec![1.0; 1 + octaves.iter().max().map_or(0, |&octave| octave as usize)];
        let (order, slots) = (sets[0].order(), vec![NO_SLOT; origins.len()]);
        Paths { origins, areas, octaves, sets, order, samples: vec![], slots, count: 0, noise }
    }

    /// The number of paths so far from a point.
    fn from(&self, point: usize) -> f64 {
        match self.slots[point] {
            NO_SLOT => 0.0,
            slot => self.samples[slot as usize].sums.count,
        }
    }

    /// The number of paths that are these shares of those so far from each point.
    fn of(&self, shares: &[f64]) -> usize {
        shares.iter().enumerate().map(|(k, share)| share * self.from(k)).sum::<f64>() as usize
    }

    /// Traces `more` paths from open points, half of them in proportion to area and scatter, which
    /// makes the mean square of errors over the area least (Neyman 1934), and half to area alone:
    /// an octave whose rare bright paths were not met yet does not scatter. `progress` gets the
    /// number of all.
    fn trace(
        &mut self,
        more: usize,
        open: &[f64],
        sample: &(impl Fn(usize, usize) -> Value<M> + Sync),
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let scatter = |item: usize| self.noise[self.octaves[item] as usize].sqrt();
        let is_open = |item: usize| open[item] > 0.0;
        let items = (0..open.len()).filter(|&item| is_open(item));
        let [area, scattered] = items.fold([0.0; 2], |[area, scattered], item| {
            [area + self.areas[item], scattered + self.areas[item] * scatter(item)]
        });
        let mean = (scattered / area).max(f64::MIN_POSITIVE);
        let weight = |&item: &u32| match is_open(item as usize) {
            true => self.areas[item as usize] * (mean + scatter(item as usize)),
            false => 0.0,
        };
        let along = AreaSampler::new(self.order.iter().map(weight));
        let (first, round) = (self.count, radical_inverse(self.count as u32 + 1));
        let numbers: Vec<usize> = (first..first + more).collect();
        let (mut remaining, mut batches) = (&numbers[..], Batches::new(1024).without_journal());
        while !remaining.is_empty() {
            let trace = |&path: &usize| {
                let share = ((path - first) as f64 + round) / more as f64;
                let item = self.order[along.locate(share).0];
                let scale = self.origins[item as usize].scale;
                let value = sample(item as usize, path).map(|value| value / scale);
                (item, ArrayVec::from(value))
            };
            let (_, traced) = batches.next(&mut remaining, |batch| {
                batch.par_iter().map(trace).collect::<Vec<(u32, ArrayVec<f64, M>)>>()
            });
            for (item, value) in traced {
                self.add(item, std::array::from_fn(|k| value[k]));
            }
            agree(progress(self.count))?;
        }
        ControlFlow::Continue(())
    }

    fn add(&mut self, item: u32, value: Value<M>) {
        let slot = &mut self.slots[item as usize];
        if *slot == NO_SLOT {
            *slot = self.samples.len() as u32;
            self.samples.push(ItemSamples { item, sums: SampleSums::default() });
        }
        self.samples[*slot as usize].sums.add_sample(&value);
        self.count += 1;
    }

    /// What is missed, where so much was `expected`, and at most the second of both.
    fn missed(&mut self, expected: [f64; 2]) -> MissedLight<M> {
        let most = self.count / PATHS_OF_CELL;
        let (first, last) = (&self.sets[0], self.sets[0].levels() - 1);
        let left_out = (0..last).find(|&l| first.count(l) <= most).unwrap_or(last);
        let sets: Vec<NestedCells> =
            self.sets.par_iter().map(|set| set.coarsened(left_out)).collect();
        let of_set = |set| CellSamples::new(set, &self.samples, &self.areas, &self.octaves);
        let samples: Vec<CellSamples<M>> = sets.par_iter().map(of_set).collect();
        self.noise = samples[0].noise.clone();
        let (spreads, uncertainty) = spreads(&samples, sets[0].levels(), expected);
        let estimates: Vec<Vec<Estimate<M>>> =
            samples.par_iter().map(|samples| samples.estimates(&spreads)).collect();
        let populations: Vec<Vec<f64>> = sets.par_iter().map(NestedCells::populations).collect();
        let share = 1.0 / SETS as f64;
        let at = |item: usize| {
            let (mut value, mut variance) = ([0.0; M], 0.0);
            for ((set, estimates), populations) in sets.iter().zip(&estimates).zip(&populations) {
                let cell = set.cells[item] as usize;
                let estimate = &estimates[cell];
                value.iter_mut().zip(estimate.value).for_each(|(sum, own)| *sum += share * own);
                // Within a finest cell values differ by as much as such cells do.
                let within = spreads[0] * (1.0 - 1.0 / populations[cell]);
                variance += share * (estimate.variance + within);
            }
            (value, variance + uncertainty)
        };
        let (missed, variance): (Vec<Value<M>>, Vec<f64>) =
            (0..self.origins.len()).into_par_iter().map(at).unzip();
        let all: f64 = self.areas.iter().sum();
        let square: f64 = variance.iter().zip(&self.areas).map(|(v, area)| v * area).sum();
        let error = (square / all.max(f64::MIN_POSITIVE)).sqrt();
        let (shares, mean_variance) = (samples[0].shares(), self.mean_variance(&variance));
        let paths = self.count;
        MissedLight { missed, variance, shares, mean_variance, error, paths, is_reached: false }
    }

    /// Variance of the mean over area of values with these variances, in W/m²: at most that of the
    /// means of points by their own paths, and that of values whose errors are all alike. A point
    /// without paths counts as one with its share of those of the first round: its neighbours have
    /// them.
    fn mean_variance(&self, variances: &[f64]) -> f64 {
        let all: f64 = self.areas.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let first = first_paths(self.origins) as f64;
        let (mut own, mut error) = (0.0, 0.0);
        for (k, origin) in self.origins.iter().enumerate() {
            let share = origin.area / all;
            let count = self.from(k).max(share * first);
            let noise = self.noise[self.octaves[k] as usize];
            own += (share * origin.scale).powi(2) * noise / count;
            error += share * origin.scale * variances[k].sqrt();
        }
        own.min(error * error)
    }
}

/// τ² of each level, by the samples of all sets of cells. Their sum is the square of what is
/// `expected`, within a standard error of that by the samples. And by how much it may be more: it
/// is at most the square of the `bound`, within the same.
fn spreads<const M: usize>(
    samples: &[CellSamples<M>],
    levels: usize,
    [expected, bound]: [f64; 2],
) -> (Vec<f64>, f64) {
    let mut sums = vec![SpreadSums::default(); levels];
    samples.iter().for_each(|samples| samples.add_spreads(&mut sums));
    let spreads: Vec<[f64; 2]> =
        sums.iter().map(|sums| sums.spread(samples.len() as f64)).collect();
    let [sum, variance] = [0, 1].map(|k| spreads.iter().map(|spread| spread[k]).sum::<f64>());
    let within = |square: f64| {
        let error = variance.sqrt();
        square.clamp((sum - error).max(0.0), sum + error)
    };
    let [wanted, most] = [expected, bound].map(|missed| within(missed * missed));
    let adjusted = |[spread, own]: &[f64; 2]| match wanted < sum {
        true => spread * wanted / sum,
        // The least sum of squares of changes over their standard errors.
        false => spread + (wanted - sum) * own / variance.max(f64::MIN_POSITIVE),
    };
    (spreads.iter().map(adjusted).collect(), (most - wanted).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::random::normal_deviate;

    fn go_on(_: usize, _: usize) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// 100 points of a bright room miss nothing, by paths that scatter by half; 100 of a dark one,
    /// a hundredth as bright, miss 0.3 ± 0.1, by one path in 256. Each room has the errors that
    /// are stated, all are as small as asked, and the mean is as far off as stated.
    #[test]
    fn rooms_have_errors_of_their_own() {
        let goal = Goal::Each(vec![0.05f64.powi(2); 200]);
        let (mut squares, mut stated) = ([0.0; 2], [0.0; 2]);
        let (mut mean_squares, mut mean_stated) = (0.0, 0.0);
        for trial in 0..20 {
            let mut rng = random_numbers(&[trial]);
            let is_dark = |k: usize| k >= 100;
            let origin = |k: usize| PathOrigin {
                position: DVec3::X * (k as f64 / 200.0),
                normal: DVec3::Z,
                scale: if is_dark(k) { 0.01 } else { 1.0 },
                area: 1.0,
            };
            let origins: Vec<PathOrigin> = (0..200).map(origin).collect();
            let truth: Vec<f64> = (0..200)
                .map(|k| if is_dark(k) { 0.3 + 0.1 * normal_deviate(&mut rng) } else { 0.0 })
                .collect();
            let sample = |k: usize, path: usize| {
                let mut rng = random_numbers(&[trial, k as u64, path as u64]);
                let missed = match is_dark(k) {
                    true if rng.f64() * 256.0 < 1.0 => 256.0 * truth[k],
                    true => 0.0,
                    false => 0.5 * normal_deviate(&mut rng),
                };
                [origins[k].scale * missed]
            };
            let (unknown, finest) = ([f64::INFINITY; 2], 1.0 / 256.0);
            let missed = missed_light(&origins, finest, unknown, &goal, sample, go_on).unwrap();
            assert!(missed.is_reached, "{trial}");
            // The dark room, each point by itself, would take (0.3 · 16 / 0.05)² paths; the bright
            // room has those of the first round. A quarter for the last round.
            assert!(missed.paths < 125 * 9216, "{}", missed.paths);
            let mut off = 0.0;
            for (k, truth) in truth.iter().enumerate() {
                let (room, error) = (usize::from(is_dark(k)), missed.missed[k][0] - truth);
                squares[room] += error * error;
                stated[room] += missed.variance[k];
                off += origins[k].scale * error / 200.0;
            }
            mean_squares += off * off;
            mean_stated += missed.mean_variance;
        }
        let ratios = [0, 1].map(|room: usize| (squares[room] / stated[room]).sqrt());
        let of_mean = (mean_squares / mean_stated).sqrt();
        println!("{ratios:?} {of_mean}");
        // Of 2 000 errors each, which share what is estimated of a trial. The spread of the dark
        // room is that of the bright one too, whose points do not differ: its errors are stated too
        // large. That of the mean is known by 20 of them, ±16 %: three of these.
        assert!(ratios[0] > 0.2 && ratios[0] < 1.1, "{ratios:?}");
        assert!(ratios[1] > 0.7 && ratios[1] < 1.15, "{ratios:?}");
        assert!(of_mean > 0.2 && of_mean < 1.5, "{of_mean}");
    }

    /// Without points there is nothing to miss, and a stop gives nothing.
    #[test]
    fn no_points_and_stops() {
        let (unknown, goal) = ([f64::INFINITY; 2], Goal::Each(vec![]));
        let missed = missed_light(&[], 0.1, unknown, &goal, |_, _| [1.0], go_on).unwrap();
        assert!(missed.missed.is_empty() && missed.is_reached, "{missed:?}");
        let origin = PathOrigin { position: DVec3::ZERO, normal: DVec3::Z, scale: 1.0, area: 1.0 };
        let stop = |_, _| ControlFlow::Break(());
        let stopped = missed_light(&[origin], 0.1, unknown, &goal, |_, _| [1.0], stop);
        assert!(stopped.is_none());
    }
}
