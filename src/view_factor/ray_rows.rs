//! Rows of view factors from rays: the number of rays of a polygon that hit each other one first.
//!
//! Rays start from points all over a polygon, with cosine-distributed directions, both from a
//! low-discrepancy set of four dimensions. Each carries the same share of the flux, so that a
//! factor is a count. There are two such sets, scrambled independently: what one half hits says
//! nothing of the other.
//!
//! ```text
//!     ╲  │  ╱      first half: blockers around the polygon
//!   ▭──╲─│─╱──▭    second half: fronts behind blockers that the first half missed
//!  ───────────────
//! ```
//!
//! A factor with only the *known* blockers is too large. The second half of the rays estimates the
//! excess without bias, since the known blockers do not depend on it.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::convex_polygons::in_units;
use super::fronts::Fronts;
use super::polygon_points::{PolygonPoints, scrambled_point};
use super::tolerances::CONTACT_HEIGHT;
use crate::sampling::hemisphere::cosine_direction;
use crate::scene::Scene;
use crate::visibility::ray_scene::{Hit, RayScene};

/// A polygon, and the number of rays of each half that hit it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Count {
    pub polygon: u32,
    pub halves: [u32; 2],
}

/// A half of the rays of a polygon.
#[derive(Clone, Copy)]
pub(super) enum Half {
    First,
    Second,
}

/// Hits of the first half of the rays of a polygon.
#[derive(Serialize, Deserialize)]
pub(super) struct FirstHalf {
    /// Fronts, by ascending index.
    pub fronts: Vec<Count>,
    /// Rays that hit a back.
    back: u32,
    /// Indices of blockers, ascending.
    pub blockers: Vec<u32>,
}

/// Hits of the rays of a polygon.
#[derive(Serialize, Deserialize)]
pub(super) struct RayRow {
    /// Total number of rays, with or without a hit.
    pub rays: u32,
    /// Fronts, by ascending index.
    pub fronts: Vec<Count>,
    /// Rays that hit a back.
    pub back: u32,
    /// Rays of the second half that hit an unknown blocker.
    pub unknown: u32,
    /// Fronts behind those blockers, which the rays would have hit if only known blockers existed.
    pub hidden: Vec<Count>,
}

/// The triangles of a scene for rays, in units relative to its centre.
pub(super) struct RayCaster<'a> {
    fronts: &'a Fronts,
    rays: RayScene,
    /// Per triangle, the index of the blocker that it is a part of.
    blockers: Vec<Option<u32>>,
}

impl<'a> RayCaster<'a> {
    /// For `scene`, all lengths divided by `unit`; `blockers` has the blocker of each triangle.
    pub fn new(
        scene: &Scene,
        unit: f64,
        fronts: &'a Fronts,
        blockers: Vec<Option<u32>>,
    ) -> RayCaster<'a> {
        let position = in_units(scene, unit);
        let corners = (0..scene.triangles().len()).map(|t| scene.corners(t).map(&position));
        let rays = RayScene::new(corners).with_covered_backs(|t| scene.is_back_covered(t));
        RayCaster { fronts, rays, blockers }
    }

    /// Per front, the index of the blocker that it is a part of.
    pub fn blockers_of_fronts(&self) -> Vec<Option<u32>> {
        let mut of_fronts = vec![None; self.fronts.polygons.len()];
        for (t, &blocker) in self.blockers.iter().enumerate() {
            for front in self.fronts.both_sides(t).into_iter().flatten() {
                of_fronts[front as usize] = blocker;
            }
        }
        of_fronts
    }

    /// Casts the first half of `rays` rays from polygon `s`.
    pub fn first_half(&self, s: u32, rays: u32) -> FirstHalf {
        let (mut met, mut blockers) = (Met::default(), vec![]);
        self.cast(s, Half::First, rays / 2, |_, _, hit| {
            met.add(self.fronts, hit);
            blockers.extend(self.blockers[hit.triangle]);
        });
        blockers.sort_unstable();
        blockers.dedup();
        // Of thousands of rays, some hundred blockers.
        blockers.shrink_to_fit();
        FirstHalf { fronts: counted(met.fronts, Half::First), back: met.backs, blockers }
    }

    /// Casts the second half of `rays` rays from polygon `s` and adds the first; `known` blockers
    /// ascend.
    pub fn row(&self, s: u32, rays: u32, first: &FirstHalf, known: &[u32]) -> RayRow {
        let is_known = |hit: &Hit| {
            self.blockers[hit.triangle].is_none_or(|blocker| known.binary_search(&blocker).is_ok())
        };
        let (mut met, mut hidden, mut unknown) = (Met::default(), vec![], 0);
        self.cast(s, Half::Second, rays / 2, |from, direction, hit| {
            met.add(self.fronts, hit);
            unknown += u32::from(!is_known(hit));
            let mut last = *hit;
            while !is_known(&last) {
                let start = last.distance + CONTACT_HEIGHT;
                let Some(next) = self.first_hit(s, from, direction, start) else { break };
                hidden.extend(self.fronts.met(next.triangle, next.front));
                last = next;
            }
        });
        let fronts = sum_of_counts(&first.fronts, &counted(met.fronts, Half::Second));
        let back = first.back + met.backs;
        RayRow { rays, fronts, back, unknown, hidden: counted(hidden, Half::Second) }
    }

    /// Share of a set of rays from polygon `s` that hit polygon `t` first; each `seed` gives other
    /// rays.
    pub fn share(&self, s: u32, t: u32, rays: u32, seed: u64) -> f64 {
        let mut count = 0;
        self.cast_set(s, rays, seed, |_, _, hit| {
            count += u32::from(self.fronts.met(hit.triangle, hit.front) == Some(t));
        });
        f64::from(count) / f64::from(rays)
    }

    /// Whether anything but polygons `s` and `t` is between two points, one on each.
    pub fn is_hidden(&self, [s, t]: [u32; 2], from: DVec3, to: DVec3) -> bool {
        let is_other = |hit: &Hit| {
            let sides = self.fronts.both_sides(hit.triangle);
            !sides.contains(&Some(s)) && !sides.contains(&Some(t))
        };
        self.rays.occluded(from, to - from, CONTACT_HEIGHT..1.0 - CONTACT_HEIGHT, is_other)
    }

    /// Calls `meets` with start, direction and hit of each of `rays` rays of polygon `s` that hits
    /// something.
    pub fn cast(&self, s: u32, half: Half, rays: u32, meets: impl FnMut(DVec3, DVec3, &Hit)) {
        // Sets of 2¹⁶ points take the seeds after this: fewer than lie between the halves.
        self.cast_set(s, rays, u64::from(s) << 32 | (half as u64) << 31, meets);
    }

    fn cast_set(&self, s: u32, rays: u32, seed: u64, mut meets: impl FnMut(DVec3, DVec3, &Hit)) {
        let polygon = &self.fronts.polygons[s as usize];
        let points = PolygonPoints::new(&polygon.corners);
        for k in 0..rays {
            let [u, v, radius2, turn] = scrambled_point(k, seed);
            let from = points.at(u, v);
            let direction = cosine_direction(polygon.normal, [radius2, turn]);
            if let Some(hit) = self.first_hit(s, from, direction, CONTACT_HEIGHT) {
                meets(from, direction, &hit);
            }
        }
    }

    /// The first hit of a ray from polygon `s` beyond `start`.
    fn first_hit(&self, s: u32, from: DVec3, direction: DVec3, start: f64) -> Option<Hit> {
        let is_other = |hit: &Hit| !self.fronts.both_sides(hit.triangle).contains(&Some(s));
        self.rays.closest_hit_of(from, direction, start, None, is_other)
    }
}

/// First hits of rays, in any order.
#[derive(Default)]
struct Met {
    fronts: Vec<u32>,
    /// Rays that hit a back.
    backs: u32,
}

impl Met {
    fn add(&mut self, fronts: &Fronts, hit: &Hit) {
        match fronts.met(hit.triangle, hit.front) {
            Some(front) => self.fronts.push(front),
            None => self.backs += 1,
        }
    }
}

/// Polygons in any order that rays of a half have hit, as counts by ascending index.
fn counted(mut polygons: Vec<u32>, half: Half) -> Vec<Count> {
    polygons.sort_unstable();
    let runs = polygons.chunk_by(|a, b| a == b);
    let count = |run: &[u32]| {
        let mut halves = [0; 2];
        halves[half as usize] = run.len() as u32;
        Count { polygon: run[0], halves }
    };
    let mut counts: Vec<Count> = runs.map(count).collect();
    counts.shrink_to_fit();
    counts
}

/// The counts of two ascending lists added up.
pub(super) fn sum_of_counts(a: &[Count], b: &[Count]) -> Vec<Count> {
    let mut union = Vec::with_capacity(a.len() + b.len());
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    while let Some(polygon) = [a.peek(), b.peek()].into_iter().flatten().map(|c| c.polygon).min() {
        let of_a = a.next_if(|c| c.polygon == polygon).map_or([0; 2], |c| c.halves);
        let of_b = b.next_if(|c| c.polygon == polygon).map_or([0; 2], |c| c.halves);
        union.push(Count { polygon, halves: [0, 1].map(|half| of_a[half] + of_b[half]) });
    }
    union.shrink_to_fit();
    union
}
