//! Choice of a luminaire for a path: in proportion to the irradiance from its middle, unoccluded,
//! and to at least 1 % of that by its mean intensity at normal incidence.

use std::f64::consts::PI;

use fastrand::Rng;
use glam::DVec3;

use crate::scene::Luminaire;

/// One of `luminaires` for a point with unit `normal`, and the probability of that choice; none
/// without light.
pub(super) fn choose<'a>(
    luminaires: &'a [Luminaire],
    at: DVec3,
    normal: DVec3,
    rng: &mut Rng,
) -> Option<(&'a Luminaire, f64)> {
    let weight = |luminaire: &Luminaire| {
        let far = luminaire.position.distance_squared(at).max(luminaire.extent().powi(2));
        // The middle may be dark or behind the surface, and its rim not.
        let least = 0.01 * luminaire.intensity.flux() / (4.0 * PI) / far;
        let middle = luminaire.irradiance(luminaire.position, at, normal);
        luminaire.scale.element_sum() * middle.max(least)
    };
    if let [only] = luminaires {
        return Some((only, 1.0));
    }
    let sums: Vec<f64> = luminaires
        .iter()
        .scan(0.0, |sum, luminaire| {
            *sum += weight(luminaire);
            Some(*sum)
        })
        .collect();
    let total = *sums.last()?;
    let place = rng.f64() * total;
    let k = sums.partition_point(|&sum| sum <= place);
    let before = if k == 0 { 0.0 } else { sums[k - 1] };
    Some((luminaires.get(k)?, (sums[k] - before) / total))
}
