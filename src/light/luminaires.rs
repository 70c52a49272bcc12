//! Choice of a luminaire for a path: in proportion to the irradiance from its middle, unoccluded,
//! and to at least 1 % of that by its mean intensity at normal incidence.
//!
//! ```text
//! many:  x ──► a cluster, by Φ / d² of it ──► a luminaire of it, by irradiance
//! ```

use std::f64::consts::PI;

use fastrand::Rng;
use glam::DVec3;

use crate::geometry::aabb::Aabb;
use crate::scene::Luminaire;

/// Maximum number of luminaires of a cluster. One costs as much as looking at twice as many
/// clusters.
const MAX_OF_CLUSTER: usize = 32;

/// The luminaires of a scene in clusters.
#[derive(Debug)]
pub(super) struct Luminaires {
    clusters: Vec<Cluster>,
}

/// Luminaires that lie together.
#[derive(Debug)]
struct Cluster {
    /// Their indices, and the least weight of each times the square of its distance.
    luminaires: Vec<(u32, f64)>,
    /// Around their middles.
    bounds: Aabb,
    /// The square of the largest extent.
    extent2: f64,
    /// Summed over the channels, W.
    flux: f64,
}

impl Luminaires {
    pub fn new(luminaires: &[Luminaire]) -> Luminaires {
        let mut clusters = vec![];
        if !luminaires.is_empty() {
            split(luminaires, (0..luminaires.len() as u32).collect(), &mut clusters);
        }
        Luminaires { clusters }
    }

    /// One of `luminaires` for a point with unit `normal`, and the probability of that choice; none
    /// without light.
    pub fn choose<'a>(
        &self,
        luminaires: &'a [Luminaire],
        at: DVec3,
        normal: DVec3,
        rng: &mut Rng,
    ) -> Option<(&'a Luminaire, f64)> {
        if let [only] = luminaires {
            return Some((only, 1.0));
        }
        let (cluster, of_cluster) = match &self.clusters[..] {
            [only] => (only, 1.0),
            all => {
                let (k, probability) = draw(all.iter().map(|c| c.weight(at)), rng)?;
                (&all[k], probability)
            }
        };
        let weight = |&(k, least): &(u32, f64)| {
            let luminaire = &luminaires[k as usize];
            let far = luminaire.position.distance_squared(at).max(luminaire.extent().powi(2));
            // The middle may be dark or behind the surface, and its rim not.
            let middle = luminaire.irradiance(luminaire.position, at, normal);
            (luminaire.scale.element_sum() * middle).max(least / far)
        };
        let (k, probability) = draw(cluster.luminaires.iter().map(weight), rng)?;
        Some((&luminaires[cluster.luminaires[k].0 as usize], of_cluster * probability))
    }
}

impl Cluster {
    fn weight(&self, at: DVec3) -> f64 {
        let nearest = at.clamp(self.bounds.low, self.bounds.high);
        self.flux / nearest.distance_squared(at).max(self.extent2)
    }
}

/// Halves `chosen` along the longest side of their box until they are few.
fn split(luminaires: &[Luminaire], mut chosen: Vec<u32>, clusters: &mut Vec<Cluster>) {
    let bounds = Aabb::from_points(chosen.iter().map(|&k| luminaires[k as usize].position));
    if chosen.len() > MAX_OF_CLUSTER {
        let along = |k: u32| luminaires[k as usize].position[bounds.longest_axis()];
        chosen.sort_unstable_by(|&a, &b| along(a).total_cmp(&along(b)).then(a.cmp(&b)));
        let high = chosen.split_off(chosen.len() / 2);
        split(luminaires, chosen, clusters);
        split(luminaires, high, clusters);
        return;
    }
    let of = |&k: &u32| &luminaires[k as usize];
    let flux = |k: &u32| of(k).flux().element_sum();
    let extents = chosen.iter().map(|k| of(k).extent().powi(2));
    clusters.push(Cluster {
        bounds,
        extent2: extents.fold(0.0, f64::max),
        flux: chosen.iter().map(flux).sum(),
        luminaires: chosen.iter().map(|k| (*k, 0.01 * flux(k) / (4.0 * PI))).collect(),
    });
}

/// A number in proportion to these weights, and its probability; none if all are 0.
fn draw(weights: impl Iterator<Item = f64>, rng: &mut Rng) -> Option<(usize, f64)> {
    let sums = weights.scan(0.0, |sum, weight| {
        *sum += weight;
        Some(*sum)
    });
    let sums: Vec<f64> = sums.collect();
    let total = *sums.last()?;
    let position = rng.f64() * total;
    let k = sums.partition_point(|&sum| sum <= position);
    let before = if k == 0 { 0.0 } else { sums[k - 1] };
    (k < sums.len()).then(|| (k, (sums[k] - before) / total))
}
