//! Blockers around each polygon that rays have hit.
//!
//! Polygons on the same side of one blocker, such as the storeys of a wall, have similar
//! surroundings: they share the blockers that the rays of any of them have hit, and those whose
//! rays have hit any of them.

use rustc_hash::FxHashMap;

use super::blocker_tree::BlockerTree;
use super::convex_polygons::ConvexPolygon;
use super::fronts::Fronts;
use super::ray_rows::FirstHalf;

/// A blocker, and whether the side is its front.
type Side = (u32, bool);

/// Blockers known around fronts.
pub(super) struct KnownBlockers {
    /// Per front, the side of a blocker that it is a part of.
    sides: Vec<Option<Side>>,
    /// Indices of blockers, ascending.
    of_sides: FxHashMap<Side, Vec<u32>>,
}

impl KnownBlockers {
    /// The blockers of `fronts`, each a part of one of the `blockers`, by the first half of their
    /// rays.
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

    /// The blockers around front `s`, ascending.
    pub fn around(&self, s: usize) -> &[u32] {
        let known = self.sides[s].and_then(|side| self.of_sides.get(&side));
        known.map_or(&[], Vec::as_slice)
    }
}
