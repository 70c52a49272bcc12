//! Shadow rays to many lights, in proportion to what they contribute.
//!
//! ```text
//!   nodes of a cut, by irradiance     strata: each with its own rays          pool: the rest
//!   ├──────────┼───────┼────┼──┼─┼┤   ├──────────┼───────┼────┤               ├──┼─┼┤
//!                                      E · rays that arrive / rays cast
//! ```
//!
//! So where nothing is in the way there is no noise, and the number of rays does not depend on that
//! of lights. Nodes that are worth less than a ray share those of the pool, in proportion.

use std::ops::Range;

use glam::DVec3;

use super::GatherPoint;
use super::light_tree::{CutNode, Leaf, LightTree};
use crate::sampling::low_discrepancy::{r2_point, radical_inverse, sobol_02_point};
use crate::sampling::rotation::second_rotation;
use crate::scene::Rgb;

/// Points of a node that are tried until one sends light to the point: of closed lamps every second
/// is on the back. Of six tries 2⁻⁶ fail, and their ray is not cast.
const CANDIDATES: usize = 6;

/// A point of a light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    pub position: DVec3,
    /// Irradiance if all light of the leaf comes from there, and nothing is in the way, W/m² per
    /// channel.
    pub irradiance: Rgb,
    /// Of an emitting surface: its triangle, and the weights of its second and third corner.
    pub surface: Option<(u32, [f64; 2])>,
}

/// A light that has points.
pub(crate) trait SampledLeaf: Leaf {
    /// The point for one in the unit cube, uniform over what emits, as `point` sees it.
    fn sample(&self, at: [f64; 3], point: &GatherPoint) -> LightSample;

    /// Whether all of its points are one as seen from `point`: one ray is exact.
    fn is_point(&self, point: &GatherPoint) -> bool;
}

/// The lights that rays are cast to from one point.
pub(crate) struct LightSamples<'a, L> {
    tree: &'a LightTree<L>,
    point: GatherPoint,
    rotation: f64,
    strata: Vec<Stratum>,
    pool: Pool,
}

/// A node with rays of its own.
struct Stratum {
    node: CutNode,
    /// Of all rays.
    share: f64,
}

/// Nodes that share rays.
#[derive(Default)]
struct Pool {
    nodes: Vec<CutNode>,
    /// Sums of their irradiance, over the channels.
    sums: Vec<f64>,
    /// W/m² per channel.
    irradiance: Rgb,
    /// Of all rays.
    share: f64,
}

/// A ray of some of the lights.
pub(crate) struct LightRay<'a, L> {
    /// Its stratum; that after all for the pool.
    pub stratum: usize,
    pub leaf: &'a L,
    pub sample: LightSample,
    /// What it stands for, by the same factor in all rays of the stratum.
    pub weight: Rgb,
}

/// Sums over rays of a stratum.
#[derive(Clone, Copy, Debug, Default)]
struct Seen {
    /// Number of rays.
    rays: f64,
    /// Of the rays that arrive; times the transmittance of panes.
    seen: Rgb,
    /// Of all rays, summed over the channels.
    all: f64,
}

/// Sums over rays of each stratum, and of the pool.
#[derive(Debug)]
pub(crate) struct LightSums(Vec<Seen>);

impl<'a, L: SampledLeaf> LightSamples<'a, L> {
    /// For these `nodes` of a cut of `tree` at `point`, whose rays have this `rotation`. Nodes that
    /// are worth one of `rays` have their own.
    pub fn new(
        tree: &'a LightTree<L>,
        nodes: Vec<CutNode>,
        point: &GatherPoint,
        rotation: f64,
        rays: u32,
    ) -> LightSamples<'a, L> {
        let total: f64 = nodes.iter().map(CutNode::brightness).sum();
        let share = |node: &CutNode| node.brightness() / total;
        let is_own = |node: &CutNode| share(node) * f64::from(rays) >= 1.0;
        let (own, shared): (Vec<_>, Vec<_>) = nodes.into_iter().partition(is_own);
        let strata = own.into_iter().map(|node| Stratum { share: share(&node), node }).collect();
        let mut sum = 0.0;
        let sums = shared.iter().map(|node| {
            sum += node.brightness();
            sum
        });
        let sums: Vec<f64> = sums.collect();
        let irradiance = shared.iter().map(|node| node.irradiance).sum();
        let pool = Pool { sums, irradiance, share: sum / total, nodes: shared };
        LightSamples { tree, point: *point, rotation, strata, pool }
    }

    /// Whether there is no light.
    pub fn is_empty(&self) -> bool {
        self.strata.is_empty() && self.pool.nodes.is_empty()
    }

    /// Number of strata, without the pool.
    pub fn strata(&self) -> usize {
        self.strata.len()
    }

    /// Calls `visit` with each of the rays of `range`, dealt out to the strata that are `chosen` by
    /// their number.
    pub fn visit(
        &self,
        range: Range<u32>,
        chosen: impl Fn(usize) -> bool,
        mut visit: impl FnMut(LightRay<'a, L>),
    ) {
        for (k, stratum) in self.strata.iter().enumerate().filter(|(k, _)| chosen(*k)) {
            let mut rays = dealt_out(&range, stratum.share);
            if self.tree.exact_leaf(&stratum.node).is_some_and(|leaf| leaf.is_point(&self.point)) {
                rays.end = rays.end.min(1);
            }
            for ray in rays {
                if let Some(ray) = self.ray_of(k, &stratum.node, self.at(ray)) {
                    visit(ray);
                }
            }
        }
        if !self.pool.nodes.is_empty() && chosen(self.strata.len()) {
            dealt_out(&range, self.pool.share).filter_map(|k| self.ray_of_pool(k)).for_each(visit);
        }
    }

    /// The point of the unit cube for ray `k`.
    fn at(&self, k: u32) -> [f64; 3] {
        let [x, y] = sobol_02_point(k);
        let [z, _] = r2_point(k as usize, self.rotation);
        // Both coordinates are rotated: where only a strip of a light is visible, the same points
        // everywhere would cause an error in the same direction everywhere.
        [(x + second_rotation(self.rotation)).fract(), (y + self.rotation).fract(), z]
    }

    /// A ray to the point of a node for one in the unit cube, or to one of others if no light comes
    /// from there; none if none comes from any.
    fn ray_of(
        &self,
        stratum: usize,
        node: &CutNode,
        [x, y, z]: [f64; 3],
    ) -> Option<LightRay<'a, L>> {
        (0..CANDIDATES).find_map(|j| {
            let [dx, dy] = r2_point(j, 0.0);
            let (leaf, x, probability) = self.tree.choose(node, (x + dx).fract());
            let sample = leaf.sample([x, (y + dy).fract(), z], &self.point);
            // Rounding may choose a leaf of a probability of 0.
            let weight = sample.irradiance / probability;
            let is_seen = weight.is_finite() && weight != Rgb::ZERO;
            is_seen.then_some(LightRay { stratum, leaf, sample, weight })
        })
    }

    /// Ray `k` of the pool: to a node in proportion to its irradiance.
    fn ray_of_pool(&self, k: u32) -> Option<LightRay<'a, L>> {
        let Pool { nodes, sums, .. } = &self.pool;
        let [_, y, z] = self.at(k);
        let position =
            (radical_inverse(k) + second_rotation(self.rotation)).fract() * sums.last()?;
        let node = sums.partition_point(|&sum| sum <= position).min(nodes.len() - 1);
        let width = nodes[node].brightness();
        let x = ((position - sums[node] + width) / width).clamp(0.0, 1.0 - f64::EPSILON);
        let ray = self.ray_of(self.strata.len(), &nodes[node], [x, y, z])?;
        Some(LightRay { weight: nodes[node].irradiance / width, ..ray })
    }

    /// Casts the rays of `range` to the strata that are `chosen` by their number: `passed` gives
    /// the share of a sample's light that arrives.
    pub fn cast(
        &self,
        range: Range<u32>,
        chosen: impl Fn(usize) -> bool,
        passed: impl Fn(&LightSample) -> Rgb,
    ) -> LightSums {
        let mut sums = vec![Seen::default(); self.strata.len() + 1];
        self.visit(range, chosen, |LightRay { stratum, sample, weight, .. }| {
            sums[stratum].rays += 1.0;
            sums[stratum].all += weight.element_sum();
            sums[stratum].seen += weight * passed(&sample);
        });
        LightSums(sums)
    }

    /// Irradiance by these sums, W/m² per channel. Strata of which no ray was cast count as much of
    /// their light as the others.
    pub fn irradiance(&self, sums: &LightSums) -> Rgb {
        let (mut arriving, mut cast, mut missing) = (Rgb::ZERO, 0.0, 0.0);
        for (irradiance, Seen { seen, all, .. }) in self.irradiance_of_strata().zip(&sums.0) {
            let brightness = irradiance.element_sum();
            if *all == 0.0 {
                missing += brightness;
            } else {
                cast += brightness;
                arriving += *seen * (brightness / all);
            }
        }
        // Where no ray of any was cast, no point of a light is above the horizon.
        if cast > 0.0 { arriving * (1.0 + missing / cast) } else { arriving }
    }

    /// The largest irradiance of one ray of a stratum where some rays arrive and some do not,
    /// W/m²: a length over the channels.
    pub fn of_one_ray(&self, sums: &LightSums) -> f64 {
        let strata = self.irradiance_of_strata().zip(&sums.0).enumerate();
        let partial = strata.filter(|(k, _)| sums.is_partial(*k));
        partial.map(|(_, (irradiance, seen))| irradiance.length() / seen.rays).fold(0.0, f64::max)
    }

    /// Irradiance of each stratum and of the pool, if nothing is in the way, W/m² per channel.
    pub fn irradiance_of_strata(&self) -> impl Iterator<Item = Rgb> {
        let own = self.strata.iter().map(|stratum| stratum.node.irradiance);
        own.chain([self.pool.irradiance])
    }
}

impl LightSums {
    /// Adds the sums over other rays of the same lights.
    pub fn add(&mut self, other: &LightSums) {
        for (sum, term) in self.0.iter_mut().zip(&other.0) {
            sum.rays += term.rays;
            sum.seen += term.seen;
            sum.all += term.all;
        }
    }

    /// Whether some rays of a stratum arrive, and some do not.
    pub fn is_partial(&self, stratum: usize) -> bool {
        let Seen { seen, all, .. } = self.0[stratum];
        seen != Rgb::ZERO && seen.element_sum() < (1.0 - 1e-12) * all
    }
}

/// The numbers of a stratum's rays among those of `range`, of all of which it has this `share`; one
/// at least.
fn dealt_out(range: &Range<u32>, share: f64) -> Range<u32> {
    // A share of 1 is a sum of shares up to rounding.
    let [start, end] = [range.start, range.end].map(|k| (f64::from(k) * share + 1e-9) as u32);
    start..end.max(start + 1)
}
