//! What nobody sees: points inside solids, right behind plates, in cracks; and those that see next
//! to nothing.

use fastrand::Rng;
use glam::DVec3;

use super::path_tracer::{PathTracer, SurfacePoint};
use crate::scene::{Aabb, Scene};

/// A point is hidden where more than this share of its rays meets backs first,
const HIDDEN: f64 = 0.95;

/// or more than this share does, and no light comes: by reciprocity it is not seen from where there
/// is light either,
const HIDDEN_DARK: f64 = 0.05;

/// That no light comes takes so many paths: the gap under a roof's boards that is told the light of
/// their upper side got a thousandth of it, which 64 paths do not find. Fewer tell nothing.
const PATHS_IN_THE_DARK: usize = 4096;

/// or more than this share meets backs that are near:
const HIDDEN_NEAR: f64 = 0.4;

/// nearer than this share of the diagonal of where the light is.
const NEAR: f64 = 0.002;

/// It is hidden in a crack, too, where the mean of 1/distance to what it sees is above one over
/// this share of that diagonal.
const CRACK: f64 = 1e-4;

/// A point that sees surfaces in less than this share of its hemisphere is left out too.
const OPEN: f64 = 0.01;

/// Rays that find that out.
const RAYS: usize = 128;

/// Share of the light that may lie outside of the box where the light is, at either end of an axis.
const TRIMMED_SHARE: f64 = 0.01;

/// The box has to be this many times smaller than the one around all that reflects: in an ordinary
/// room the light fills the room.
const MIN_CONCENTRATION: f64 = 4.0;

/// What a point sees.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outlook {
    /// Share of the hemisphere in which there is a surface.
    covered: f64,
    /// Share of backs among all that it sees.
    backs: f64,
    /// Distance within which the share of [`HIDDEN_NEAR`] are backs, scene unit; infinite if fewer
    /// are.
    near_backs: f64,
    /// Mean of 1/distance, per scene unit.
    inverse_distance: f64,
}

impl Outlook {
    /// What rays from `point` meet.
    pub fn new(tracer: &PathTracer, point: &SurfacePoint, rng: &mut Rng) -> Outlook {
        let hits = tracer.hits(point, RAYS, rng);
        let mut backs: Vec<f64> =
            hits.iter().filter(|hit| !hit.front).map(|hit| hit.distance).collect();
        backs.sort_by(f64::total_cmp);
        let most_in_front = (HIDDEN_NEAR * RAYS as f64) as usize;
        Outlook {
            covered: hits.len() as f64 / RAYS as f64,
            backs: backs.len() as f64 / RAYS as f64,
            near_backs: backs.get(most_in_front).copied().unwrap_or(f64::INFINITY),
            inverse_distance: hits.iter().map(|hit| 1.0 / hit.distance).sum::<f64>() / RAYS as f64,
        }
    }

    /// Whether nobody sees the point, or it sees next to nothing, where the light fills a box of
    /// this `diagonal` (scene unit), and so many paths found that it has `light` or not.
    pub fn is_hidden(&self, diagonal: f64, (light, paths): (bool, usize)) -> bool {
        let is_dark = !light && paths >= PATHS_IN_THE_DARK;
        self.covered < OPEN
            || self.backs > if is_dark { HIDDEN_DARK } else { HIDDEN }
            || self.near_backs < NEAR * diagonal
            || self.inverse_distance * CRACK * diagonal > 1.0
    }
}

/// Diagonal of the box that nearly all light is in, by `points` and what each reflects, W up to a
/// factor; of all of `scene` that reflects where that is not much larger; scene unit.
pub(super) fn lit_diagonal(scene: &Scene, points: &[(DVec3, f64)]) -> f64 {
    let whole = scene.reflecting_bounds().diagonal();
    match Aabb::around_most(points, TRIMMED_SHARE) {
        Some(lit) if lit.diagonal() * MIN_CONCENTRATION < whole => lit.diagonal(),
        _ => whole,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dark_is_hidden_only_where_many_paths_say_so_and_backs_are_seen() {
        let chamber =
            Outlook { covered: 1.0, backs: 0.3, near_backs: f64::INFINITY, inverse_distance: 2.0 };
        let room = Outlook { backs: 0.0, ..chamber };
        for (outlook, light, paths, hidden) in [
            (chamber, false, 4096, true),
            (chamber, false, 2048, false),
            (chamber, true, 4096, false),
            (room, false, 4096, false),
        ] {
            assert_eq!(
                outlook.is_hidden(1.0, (light, paths)),
                hidden,
                "{outlook:?} {light} {paths}"
            );
        }
    }
}
