//! Evidence for the up axis from luminaires: most hang at one height near the top, and shine down.

use glam::DVec3;

use super::Evidence;
use crate::scene::Scene;

/// Of luminaires at these positions, with their aims where those are given.
pub(super) fn evidence(
    scene: &Scene,
    luminaires: &[(DVec3, Option<DVec3>)],
) -> impl Iterator<Item = Evidence> {
    let height = at_top(scene, luminaires).filter(|_| !luminaires.is_empty());
    let height = height.map(|share| Evidence {
        log_odds: 3.0 * share,
        reason: format!("luminaires near the top along {}", axis_name(share)),
    });
    let aims: Vec<DVec3> = luminaires.iter().filter_map(|(_, aim)| *aim).collect();
    let down: DVec3 = -aims.iter().map(|aim| aim.normalize_or_zero()).sum::<DVec3>();
    let share = (down.z - down.y) / aims.len().max(1) as f64;
    let aimed = (share != 0.0).then(|| Evidence {
        log_odds: 3.0 * share,
        reason: format!("luminaires aimed along −{}", &axis_name(share)[1..]),
    });
    height.into_iter().chain(aimed)
}

/// How much nearer to the top luminaires are along z than along y, from −1 to 1: the share of the
/// upper fifth of the scene's extent below their mean.
fn at_top(scene: &Scene, luminaires: &[(DVec3, Option<DVec3>)]) -> Option<f64> {
    let bounds = scene.reflecting_bounds();
    let mean = luminaires.iter().map(|(at, _)| *at).sum::<DVec3>() / luminaires.len() as f64;
    let spread = |axis: DVec3| {
        let off = luminaires.iter().map(|(at, _)| (*at - mean).dot(axis).abs());
        off.fold(0.0, f64::max) / bounds.size().dot(axis)
    };
    let near_top = |axis: DVec3| {
        let height = (mean - bounds.low).dot(axis) / bounds.size().dot(axis);
        // Luminaires at different heights say little.
        let level = (1.0 - 5.0 * spread(axis)).max(0.0);
        level * (5.0 * height - 4.0).clamp(0.0, 1.0)
    };
    Some(near_top(DVec3::Z) - near_top(DVec3::Y)).filter(|share| share.is_finite())
}

fn axis_name(share: f64) -> &'static str {
    if share > 0.0 { "+z" } else { "+y" }
}
