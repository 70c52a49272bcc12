//! Form-factor rows from rays on the CPU: an independent check, and the backend without a GPU.
//!
//! ```text
//! patch ─► n cosine-weighted rays from its centroid, rotated by a hash of its id
//!       ─► item hit by each: element, back, nothing ─► sorted, counted ─► row of shares
//! ```

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::error::Error;
use crate::form_factor::{Entry, FormFactors, Row, resolution_policy};
use crate::geometry::rounding::Apportion;
use crate::mesh::{Mesh, NodeId};
use crate::sampling::hash::low_bias32;
use crate::sampling::hemisphere::HemisphereSamples;
use crate::scene::Rgb;
use crate::visibility::offset;
use crate::visibility::panes::Panes;
use crate::visibility::ray_scene::{Hit, RayScene};

/// Makes form-factor rows by casting cosine-distributed rays from a patch's centroid.
///
/// Every ray carries the same share of the light, so a form factor is a count: for n rays the
/// standard error of an entry F is at most √(F(1−F)/n) (that of independent rays; stratified ones
/// have less).
///
/// Rows for patches that shoot little have fewer rays: see [`RayRows::with_full_share`].
#[derive(Debug)]
pub struct RayRows {
    rays: Arc<RayScene>,
    panes: Panes,
    count: u32,
    /// Rows made at once.
    batch_len: usize,
    pub(crate) full_share: f64,
}

impl RayRows {
    /// Default share of the emitted flux from which a patch gets all rays: half of that for
    /// hemicubes, since N² rays are a third of the pixels of a hemicube with N along an edge.
    /// Dimmer patches get fewer rays, which increases the error of a whole bake by at most some 3 %
    /// (measured in three scenes).
    pub const FULL_SHARE: f64 = 2e-3;

    /// `count` rays per row over the triangles of `mesh`, and fewer for patches that shoot little.
    ///
    /// # Errors
    /// [`crate::ErrorKind::Setting`] when `count` is 0 or above 2²⁰.
    pub fn new(mesh: &Mesh, count: u32) -> Result<RayRows, Error> {
        HemisphereSamples::new(count)?;
        let (rays, panes) = (RayScene::of_scene(mesh.scene()), Panes::of_scene(mesh.scene()));
        // Fewer rows if each takes long; at least one per 1024 elements, since the choice of the
        // next shots visits all elements: with 16 rows for a million of them, that took 27 s of 43.
        let few = ((1 << 20) / count).clamp(1, 16) as usize;
        let batch_len = few.max(mesh.element_count() / 1024);
        Ok(RayRows { rays, panes, count, batch_len, full_share: RayRows::FULL_SHARE })
    }

    /// All rays for patches that shoot at least this share of the emitted flux, in [0, 1]; for
    /// others a quarter of them, a sixteenth and so on, but no less than 256 if `count` permits, by
    /// their share: rays ∝ share^0.8 minimizes the error for the time. [`RayRows::FULL_SHARE`] by
    /// default; with 0 all rows have all rays.
    pub fn with_full_share(self, full_share: f64) -> RayRows {
        RayRows { full_share, ..self }
    }

    fn row(&self, mesh: &Mesh, patch: NodeId, samples: &HemisphereSamples) -> Row {
        let (eye, own) = (mesh.viewpoint(patch), mesh.triangle(patch));
        let start = offset::RAY_START * mesh.area(patch).sqrt();
        let rotation = rotation(patch);
        let directions = samples.directions(mesh.normal(patch), rotation);
        if !self.panes.is_none() {
            return self.row_through_panes(mesh, patch, directions, start);
        }
        let mut hits: Vec<u32> = vec![];
        self.rays.closest_hits(eye, directions, start, Some(own), |_, hit| {
            hits.push(item(mesh, hit));
        });
        hits.sort_unstable();
        row_of(&hits)
    }

    /// The same in a scene with panes, with their transmittance on the way to each item.
    fn row_through_panes(
        &self,
        mesh: &Mesh,
        patch: NodeId,
        directions: impl Iterator<Item = DVec3>,
        start: f64,
    ) -> Row {
        let (eye, own) = (mesh.viewpoint(patch), mesh.triangle(patch));
        let mut hits: Vec<(u32, Rgb)> = vec![];
        self.rays.closest_hits(eye, directions, start, Some(own), |direction, hit| {
            let end = hit.map_or(f64::INFINITY, |hit| hit.distance);
            hits.push((item(mesh, hit), self.panes.transmittance(eye, direction, start..end)));
        });
        // Hits of one item stay in order, so that their sum is the same on every run.
        hits.sort_by_key(|&(item, _)| item);
        let items: Vec<u32> = hits.iter().map(|&(item, _)| item).collect();
        let row = row_of(&items);
        if hits.iter().all(|&(_, passed)| passed == Rgb::ONE) {
            return row;
        }
        let mean = |run: &[(u32, Rgb)]| {
            (run[0].0, run.iter().map(|&(_, passed)| passed).sum::<Rgb>() / run.len() as f64)
        };
        let means: FxHashMap<u32, Rgb> = hits.chunk_by(|a, b| a.0 == b.0).map(mean).collect();
        let items = row.entries.iter().map(|entry| entry.element).chain([OPEN, BACK]);
        let passed = |item| Row::passed(means.get(&item).copied().unwrap_or(Rgb::ONE));
        Row { passed: items.map(passed).collect(), ..row }
    }
}

/// Rotation of a patch's rays about its normal, in turns: a hash of its number.
pub(crate) fn rotation(patch: NodeId) -> f64 {
    f64::from(low_bias32(patch.0)) / 2f64.powi(32)
}

/// The item of a ray that ends at `hit`.
fn item(mesh: &Mesh, hit: Option<Hit>) -> u32 {
    match hit {
        None => OPEN,
        Some(hit) if !hit.front => BACK,
        Some(hit) => mesh.element_at(hit.triangle, hit.u, hit.v).0 as u32,
    }
}

/// The row of rays that hit these items, in ascending order.
fn row_of(hits: &[u32]) -> Row {
    row_of_counts(hits.chunk_by(|a, b| a == b).map(|run| (run[0], run.len() as u32)), hits.len())
}

/// The row of `rays` rays by the number of hits of each item, in ascending order.
pub(crate) fn row_of_counts(items: impl Iterator<Item = (u32, u32)>, rays: usize) -> Row {
    // Ray k in sorted order has the shares from k·TOTAL/n to (k+1)·TOTAL/n.
    let share_of_first = |k: u64| (k * u64::from(Row::TOTAL) / rays as u64) as u32;
    let mut row = Row::default();
    let (mut shares, mut counted) = (Apportion::default(), 0);
    for (item, count) in items {
        counted += u64::from(count);
        let share = shares.part_up_to(share_of_first(counted));
        match item {
            OPEN => row.escaped = share,
            BACK => row.backface = share,
            element => row.entries.push(Entry { element, share }),
        }
    }
    row
}

/// Number of rays of a patch that shoots `weight` of the emitted flux: all `count` from
/// `full_share` on, a quarter, a sixteenth … of them below, see [`RayRows::with_full_share`].
pub(crate) fn rays_for_importance(count: u32, weight: f64, full_share: f64) -> u32 {
    let halvings = resolution_policy::halvings_for_importance(weight, full_share);
    let least = resolution_policy::MIN_HALVED_RESOLUTION.pow(2);
    count.checked_shr(halvings.saturating_mul(2)).unwrap_or(0).max(least).min(count)
}

impl FormFactors for RayRows {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let count = rays_for_importance(self.count, weight, self.full_share);
        let samples = HemisphereSamples::new(count)?;
        Ok(patches.par_iter().map(|&p| self.row(mesh, p, &samples)).collect())
    }

    /// The same on every machine, since it decides the order of shots.
    fn preferred_batch_len(&self) -> usize {
        self.batch_len
    }

    fn fingerprint(&self) -> String {
        format!("{} rays, all from {}", self.count, self.full_share)
    }
}

/// Items of a ray without a hit, and of one that hits a back; all others are elements.
pub(crate) const OPEN: u32 = u32::MAX;
pub(crate) const BACK: u32 = u32::MAX - 1;
