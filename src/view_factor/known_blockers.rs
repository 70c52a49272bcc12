//! Which blockers stand around each polygon, by what rays have met.
//!
//! Polygons on the same side of one blocker, such as the storeys of a wall, see much the same: each
//! knows what the rays of any of them have met, and whose rays have met any of them.

use rustc_hash::FxHashMap;

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::fronts::Fronts;
use super::ray_rows::FirstHalf;

/// A blocker, and whether it is its front.
type Side = (u32, bool);

/// Blockers known around fronts.
pub(super) struct KnownBlockers {
    /// Per front, the side that it is a part of.
    sides: Vec<Option<Side>>,
    /// Indices of blockers, ascending.
    of_sides: FxHashMap<Side, Vec<u32>>,
}

impl KnownBlockers {
    /// Of `fronts`, each a part of one of the `blockers`, by the first half of their rays.
    pub fn new(
        fronts: &Fronts,
        blockers: &BlockerTree,
        of_fronts: &[Option<u32>],
        halves: &[FirstHalf],
    ) -> KnownBlockers {
        let side = |(polygon, &blocker): (&ConvexPolygon, &Option<u32>)| {
            blocker.map(|k| (k, polygon.normal.dot(blockers.normal(k)) > 0.0))
        };
        let sides: Vec<_> = fronts.polygons.iter().zip(of_fronts).map(side).collect();
        let mut of_sides: FxHashMap<Side, Vec<u32>> = FxHashMap::default();
        for ((half, side), own) in halves.iter().zip(&sides).zip(of_fronts) {
            if let Some(side) = side {
                of_sides.entry(*side).or_default().extend(&half.blockers);
            }
            for count in &half.fronts {
                if let (Some(own), Some(met)) = (own, sides[count.polygon as usize]) {
                    of_sides.entry(met).or_default().push(*own);
                }
            }
        }
        for known in of_sides.values_mut() {
            known.sort_unstable();
            known.dedup();
            known.shrink_to_fit();
        }
        KnownBlockers { sides, of_sides }
    }

    /// Those around front `s`, ascending.
    pub fn around(&self, s: usize) -> &[u32] {
        let known = self.sides[s].and_then(|side| self.of_sides.get(&side));
        known.map_or(&[], Vec::as_slice)
    }
}
