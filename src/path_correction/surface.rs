//! What the light of a bake misses all over surfaces, by paths that neighbours share.
//!
//! Thousands of points in one place miss nearly the same. So a point needs no paths of its own:
//! what it misses is estimated over [nested cells](super::nested_cells) of points that are alike,
//! in position, normal and brightness: what arrives on two sides of a wall differs. Several sets of
//! cells, shifted at random, are averaged, so that no edges of cells show.

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;

use super::MissingLight;
use super::nested_cells::{CellSamples, Estimate, NestedCells, Sample, SpreadSums};
use crate::gather::two_sided::TwoSidedPoint;
use crate::progress::BatchSizer;
use crate::sampling::low_discrepancy::radical_inverse;
use crate::sampling::random::random_numbers;
use crate::sampling::surface::AreaSampler;
use crate::scene::Rgb;

/// Sets of cells: the edges of one show with an eighth of its steps.
const SETS: usize = 8;

/// Mean number of paths of a finest cell, at least. Plain choice.
const PATHS_OF_CELL: usize = 32;

/// Paths of the first round, and the maximum. The first bring what all points miss in common to
/// 1 % of itself where paths scatter by 2.5 times their mean; the last take 128 MiB.
const PATHS: [usize; 2] = [1 << 16, 1 << 23];

/// Position over the diagonal of the scene, normal and octave of light in the space of cells: two
/// normals a radian apart are as far from each other as two points half of the diagonal apart, and
/// so is light of 1 and 16. Plain choices; no recorded measurement.
const SHARE_OF_NORMAL: f64 = 0.5;
const SHARE_OF_OCTAVE: f64 = 0.125;

/// A point of a surface that paths start from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathOrigin {
    /// Over the diagonal of the scene, from its corner: in [0, 1].
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// W/m²: what its errors are a share of, above 0.
    pub scale: f64,
    /// Area that it stands for.
    pub area: f64,
}

/// What is missed at points, as shares of their scales.
#[derive(Clone, Debug)]
pub(crate) struct MissedLight {
    pub missed: Vec<Rgb>,
    /// Variance of `missed`, a sum over the channels.
    pub variance: Vec<f64>,
    /// Root mean square of the standard errors over area.
    pub error: f64,
}

impl MissingLight<'_> {
    /// Irradiance that is missed at a point of a surface, by path number `path`, W/m². With
    /// `near_paths` what near surfaces reflect is not the field's, as in
    /// [`IrradianceSample::near_paths`](crate::gather::IrradianceSample::near_paths).
    pub fn irradiance_two_sided(
        &self,
        point: &TwoSidedPoint,
        near_paths: bool,
        path: usize,
    ) -> Rgb {
        let [own, other] = point.shares();
        let front = own * self.irradiance_past(&point.point, near_paths, path);
        if other == Rgb::ZERO {
            return front;
        }
        front + other * self.irradiance_past(&point.other_side(), near_paths, path)
    }
}

/// The paths so far.
struct Paths<'a> {
    origins: &'a [PathOrigin],
    areas: Vec<f64>,
    /// Octave of the scale of each, from the darkest.
    octaves: Vec<u32>,
    sets: Vec<NestedCells>,
    /// Origins in an order that has neighbours together.
    order: Vec<u32>,
    samples: Vec<Sample>,
    /// Variance of a sample by octave, once there are samples.
    noise: Vec<f64>,
}

/// What is missed at `origins`, by paths whose number grows until the root mean square over area of
/// standard errors is at most `error`, or there are as many as can be. By an estimate beforehand
/// the root mean square of what is missed is `expected` and surely less than a `bound`, which hold
/// as far as paths do not contradict. The edge of the finest cells is `finest` to twice that, over
/// the diagonal of the scene. `sample` gives what path number `path` finds missing at an origin,
/// W/m², without bias. None where `progress`, as in [`super::correct_by_paths`], stops the work.
pub(crate) fn missed_light(
    origins: &[PathOrigin],
    finest: f64,
    [expected, bound, error]: [f64; 3],
    sample: impl Fn(usize, usize) -> Rgb + Sync,
    mut progress: impl FnMut(usize, usize) -> ControlFlow<()>,
) -> Option<MissedLight> {
    if origins.is_empty() {
        return Some(MissedLight { missed: vec![], variance: vec![], error: 0.0 });
    }
    let mut paths = Paths::new(origins, finest);
    let mut count = PATHS[0];
    loop {
        let report = |done: usize| progress(done, count);
        if paths.trace(count, &sample, report).is_break() {
            return None;
        }
        let missed = paths.missed([expected, bound]);
        if missed.error <= error || count >= PATHS[1] {
            return Some(missed);
        }
        count *= 2;
    }
}

impl PathOrigin {
    /// In the space of cells.
    fn point(&self) -> [f32; 7] {
        let [x, y, z] = self.position.to_array();
        let [u, v, w] = (SHARE_OF_NORMAL * self.normal).to_array();
        [x, y, z, u, v, w, SHARE_OF_OCTAVE * self.scale.log2()].map(|x| x as f32)
    }
}

impl Paths<'_> {
    fn new(origins: &[PathOrigin], finest: f64) -> Paths<'_> {
        let points: Vec<[f32; 7]> = origins.iter().map(PathOrigin::point).collect();
        // 2⁻²⁰ is what 32-bit floats resolve of the diagonal.
        let depth = (-finest.log2()).floor().clamp(1.0, 20.0) as i32;
        let set = |k: usize| {
            let mut rng = random_numbers(&[k as u64]);
            NestedCells::new(&points, depth, std::array::from_fn(|_| rng.f32()))
        };
        let sets: Vec<NestedCells> = (0..SETS).into_par_iter().map(set).collect();
        let areas = origins.iter().map(|origin| origin.area).collect();
        let octaves: Vec<f64> = origins.iter().map(|origin| origin.scale.log2()).collect();
        let darkest = octaves.iter().copied().fold(f64::INFINITY, f64::min);
        let octaves: Vec<u32> = octaves.iter().map(|octave| (octave - darkest) as u32).collect();
        let noise = vec![1.0; 1 + octaves.iter().max().map_or(0, |&octave| octave as usize)];
        let order = sets[0].order();
        Paths { origins, areas, octaves, order, sets, samples: vec![], noise }
    }

    /// Traces until there are `count` paths, in proportion to area and scatter, which makes the
    /// mean square of errors over the area least (Neyman 1934). `progress` gets the number of all.
    fn trace(
        &mut self,
        count: usize,
        sample: &(impl Fn(usize, usize) -> Rgb + Sync),
        mut progress: impl FnMut(usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let weight = |&item: &u32| {
            let (item, octaves) = (item as usize, &self.octaves);
            self.areas[item] * self.noise[octaves[item] as usize].sqrt()
        };
        let along = AreaSampler::new(self.order.iter().map(weight));
        let (first, round) = (self.samples.len(), radical_inverse(self.samples.len() as u32 + 1));
        let numbers: Vec<usize> = (first..count).collect();
        let (mut remaining, mut batches) = (&numbers[..], BatchSizer::new(1024));
        while !remaining.is_empty() {
            let traced = batches.next(&mut remaining, |batch| {
                let trace = |&path: &usize| {
                    let share = ((path - first) as f64 + round) / (count - first) as f64;
                    let item = self.order[along.locate(share).0];
                    let scale = self.origins[item as usize].scale;
                    let value = sample(item as usize, path) / scale;
                    Sample { item, value: value.to_array().map(|x| x as f32) }
                };
                batch.par_iter().map(trace).collect::<Vec<_>>()
            });
            self.samples.extend(traced);
            progress(self.samples.len())?;
        }
        ControlFlow::Continue(())
    }

    /// What is missed, where so much was `expected`, and at most the second of both.
    fn missed(&mut self, expected: [f64; 2]) -> MissedLight {
        let most = self.samples.len() / PATHS_OF_CELL;
        let (first, last) = (&self.sets[0], self.sets[0].levels() - 1);
        let left_out = (0..last).find(|&l| first.count(l) <= most).unwrap_or(last);
        let sets: Vec<NestedCells> =
            self.sets.par_iter().map(|set| set.coarsened(left_out)).collect();
        let of_set = |set| CellSamples::new(set, &self.samples, &self.areas, &self.octaves);
        let samples: Vec<CellSamples> = sets.par_iter().map(of_set).collect();
        self.noise = samples[0].noise.clone();
        let (spreads, uncertainty) = spreads(&samples, sets[0].levels(), expected);
        let estimates: Vec<Vec<Estimate>> =
            samples.par_iter().map(|samples| samples.estimates(&spreads)).collect();
        let share = 1.0 / SETS as f64;
        let at = |item: usize| {
            let of_sets = sets.iter().zip(&estimates);
            let sum = of_sets.fold((Rgb::ZERO, 0.0), |(value, variance), (set, estimates)| {
                let estimate = estimates[set.cells[item] as usize];
                (value + estimate.value, variance + estimate.variance)
            });
            // Within a finest cell values differ by as much as such cells do.
            (share * sum.0, share * sum.1 + spreads[0] + uncertainty)
        };
        let (missed, variance): (Vec<Rgb>, Vec<f64>) =
            (0..self.origins.len()).into_par_iter().map(at).unzip();
        let all: f64 = self.areas.iter().sum();
        let square: f64 = variance.iter().zip(&self.areas).map(|(v, area)| v * area).sum();
        let error = (square / all.max(f64::MIN_POSITIVE)).sqrt();
        MissedLight { missed, variance, error }
    }
}

/// τ² of each level, by the samples of all sets of cells. Their sum is the square of what is
/// `expected`, within a standard error of that by the samples. And by how much it may be more: it
/// is at most the square of the `bound`, within the same.
fn spreads(samples: &[CellSamples], levels: usize, [expected, bound]: [f64; 2]) -> (Vec<f64>, f64) {
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
