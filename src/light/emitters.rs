//! Choice of an emitting triangle for a path: in clusters, by an approximate irradiance at a point.
//!
//! ```text
//! x ──► weight of each cluster: E · min(1, A / (π d²))     d: from x to the cluster's box
//!   ──► a cluster, in proportion ──► a triangle of it, by its power ──► a point, by area
//! ```
//!
//! The weight affects variance only. The density of every choice can be evaluated again, for the
//! light that a path hits without it (multiple importance sampling).

use std::f64::consts::{PI, SQRT_2};

use fastrand::Rng;
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::scene::Scene;

/// Maximum number of clusters: every vertex of every path evaluates the weights of all.
const MAX_CLUSTERS: usize = 64;

/// The emitting triangles of a scene.
#[derive(Debug)]
pub(super) struct Emitters {
    clusters: Vec<Cluster>,
    /// Of every triangle of the scene: its cluster, and the density on it where that cluster is
    /// chosen, per area; none for those that do not emit.
    densities: Vec<Option<(usize, f64)>>,
}

/// Emitting triangles that lie together.
#[derive(Debug)]
struct Cluster {
    bounds: Aabb,
    area: f64,
    /// Mean exitance, summed over the channels, in units of the scene's brightest.
    exitance: f64,
    /// Triangles, and the power of each with those before it, in units of the brightest exitance
    /// times area.
    powers: Vec<(usize, f64)>,
}

/// How bright the clusters may be at a point, as running sums.
pub(super) struct Weights {
    sums: [f64; MAX_CLUSTERS],
    total: f64,
}

impl Emitters {
    pub fn new(scene: &Scene) -> Emitters {
        let exitance = |t: usize| scene.exitance(t).element_sum();
        let emits = |&t: &usize| exitance(t) > 0.0;
        let all: Vec<usize> = (0..scene.triangles().len()).filter(emits).collect();
        let brightest = all.iter().map(|&t| exitance(t)).fold(0.0, f64::max);
        let mut densities = vec![None; scene.triangles().len()];
        let build = |(c, triangles): (usize, Vec<usize>)| {
            let mut power = 0.0;
            let area = triangles.iter().map(|&t| scene.area(t)).sum();
            let add = |&t: &usize| {
                power += exitance(t) / brightest * scene.area(t);
                (t, power)
            };
            let powers = triangles.iter().map(add).collect();
            for &t in &triangles {
                densities[t] = Some((c, exitance(t) / brightest / power));
            }
            let bounds = bounds_of(scene, &triangles);
            Cluster { bounds, area, exitance: power / area, powers }
        };
        let clusters = split(scene, all).into_iter().enumerate().map(build).collect();
        Emitters { clusters, densities }
    }

    /// The weights of all clusters at `x`.
    pub fn weights(&self, x: DVec3) -> Weights {
        let (mut sums, mut total) = ([0.0; MAX_CLUSTERS], 0.0);
        for (sum, cluster) in sums.iter_mut().zip(&self.clusters) {
            total += cluster.weight(x);
            *sum = total;
        }
        Weights { sums, total }
    }

    /// A triangle at random; on it, points are uniform over the area. None without light.
    pub fn choose(&self, weights: &Weights, rng: &mut Rng) -> Option<usize> {
        let at = rng.f64() * weights.total;
        let c = weights.sums[..self.clusters.len()].iter().position(|&sum| at < sum)?;
        let powers = &self.clusters[c].powers;
        let at = rng.f64() * powers.last()?.1;
        let k = powers.partition_point(|&(_, sum)| sum <= at);
        powers.get(k).map(|&(t, _)| t)
    }

    /// The density, per area, of the choice of any point of triangle `t`.
    pub fn density(&self, weights: &Weights, t: usize) -> f64 {
        let Some((c, on_it)) = self.densities[t] else { return 0.0 };
        if weights.total == 0.0 {
            return 0.0;
        }
        let before = if c == 0 { 0.0 } else { weights.sums[c - 1] };
        (weights.sums[c] - before) / weights.total * on_it
    }
}

impl Cluster {
    fn weight(&self, x: DVec3) -> f64 {
        let nearest = x.clamp(self.bounds.low, self.bounds.high);
        self.exitance * (self.area / (PI * nearest.distance_squared(x))).min(1.0)
    }
}

fn bounds_of(scene: &Scene, triangles: &[usize]) -> Aabb {
    Aabb::from_points(triangles.iter().flat_map(|&t| scene.corners(t)))
}

/// Splits `all` in halves along the longest side of its box, the widest clusters first.
fn split(scene: &Scene, all: Vec<usize>) -> Vec<Vec<usize>> {
    if all.is_empty() {
        return vec![];
    }
    let centre = |t: usize| scene.corners(t).into_iter().sum::<DVec3>() / 3.0;
    let width = |triangles: &[usize]| match triangles.len() {
        1 => 0.0,
        _ => bounds_of(scene, triangles).longest_side(),
    };
    let mut clusters = vec![(width(&all), all)];
    while clusters.len() < MAX_CLUSTERS {
        let widest = clusters.iter().map(|&(width, _)| width).fold(0.0, f64::max);
        // Equal up to rounding: a scene in another unit has the same clusters.
        let is_widest = |c: &(f64, Vec<usize>)| c.1.len() > 1 && c.0 >= (1.0 - 1e-9) * widest;
        let Some(widest) = clusters.iter().rposition(is_widest) else { break };
        let (_, mut low) = clusters.swap_remove(widest);
        let bounds = bounds_of(scene, &low);
        // An irrational step: regular positions, which rounding moves, do not lie on multiples of
        // it.
        let (axis, step) = (bounds.longest_axis(), 1e-6 / SQRT_2 * bounds.longest_side());
        let along = |t: usize| ((centre(t) - bounds.low)[axis] / step) as u64;
        low.sort_by_cached_key(|&t| (along(t), t));
        let high = low.split_off(low.len() / 2);
        clusters.extend([low, high].map(|half| (width(&half), half)));
    }
    clusters.into_iter().map(|(_, triangles)| triangles).collect()
}
