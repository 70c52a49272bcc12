//! Which luminaire a path asks: the more irradiance its middle may bring, the more often.

use std::f64::consts::PI;

use fastrand::Rng;
use glam::DVec3;

use crate::scene::Luminaire;

/// Share of its mean intensity that every luminaire counts with at least, straight ahead: the
/// middle of one may be dark or behind the surface, and its rim not.
const MIN_SHARE: f64 = 0.01;

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
        let least = MIN_SHARE * luminaire.intensity.flux() / (4.0 * PI) / far;
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
