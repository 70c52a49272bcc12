//! RowCache for a solver: kept within a memory budget, made again beyond it.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::ledger::largest_share;
use crate::error::Error;
use crate::form_factor::{FormFactors, Row, checked_rows};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// RowCache by patch. Once the budget is full, nothing more is kept and nothing is given up: shooting
/// takes the brightest patches first, and those are the ones that shoot again; and who goes through
/// all rows in the same order again and again finds a part of them each time, which giving up the
/// oldest would spoil.
///
/// A row that is kept may be missing, after a solve was read from a file: then it is made again as it
/// was made before. What is done with rows does not depend on whether they are missing.
#[derive(Clone)]
pub(super) struct RowCache {
    rows: HashMap<NodeId, Arc<Row>>,
    /// In an order, so that sums over them are the same on every run.
    pub trails: BTreeMap<NodeId, PatchHistory>,
    /// Bytes that are left for more.
    free: usize,
    /// RowCache made so far.
    pub made: u64,
}

/// What is known of a patch that has sent light.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct PatchHistory {
    /// All the flux that went along its row, W.
    pub sent: Rgb,
    /// The share of the light that its row was last made for.
    pub share: f64,
    /// Whether its row is kept.
    pub kept: bool,
    /// The share of its light, at most, that its row is wrong about since objects were moved. Only as
    /// it is kept can such a row be had.
    pub doubt: f64,
}

impl RowCache {
    /// None yet, of which `budget` bytes are kept.
    pub fn new(budget: usize) -> RowCache {
        RowCache { rows: HashMap::new(), trails: BTreeMap::new(), free: budget, made: 0 }
    }

    /// Bytes that are left for more.
    pub fn free(&self) -> usize {
        self.free
    }

    /// As it was, the rows missing.
    pub fn restore(&mut self, trails: BTreeMap<NodeId, PatchHistory>, made: u64, free: usize) {
        (self.trails, self.made, self.free) = (trails, made, free.min(self.free));
    }

    /// A row that is kept is there again.
    pub fn restore_row(&mut self, patch: NodeId, row: Row) {
        self.rows.insert(patch, Arc::new(row));
    }

    /// Whether there is no need to make the row of `patch`.
    pub fn keeps(&self, patch: NodeId) -> bool {
        self.trails.get(&patch).is_some_and(|trail| trail.kept)
    }

    pub fn get(&self, patch: NodeId) -> Option<&Arc<Row>> {
        self.rows.get(&patch)
    }

    /// Keeps `row`, made for a share of the light, if it fits.
    pub fn keep(&mut self, patch: NodeId, row: impl Into<Arc<Row>>, share: f64) {
        let row = row.into();
        let trail = self.trails.entry(patch).or_default();
        trail.share = share;
        if let Some(free) = self.free.checked_sub(row.bytes()) {
            (self.free, trail.kept) = (free, true);
            self.rows.insert(patch, row);
        }
    }

    /// Keeps the row of `patch` no longer.
    pub fn forget(&mut self, patch: NodeId) {
        let row = self.rows.remove(&patch);
        self.free += row.map_or(0, |row| row.bytes());
        self.trails.entry(patch).or_default().kept = false;
    }

    /// Notes that `flux` went along the row of `patch`.
    pub fn sent(&mut self, patch: NodeId, flux: Rgb) {
        self.trails.entry(patch).or_default().sent += flux;
    }

    /// The share of the `emitted` light that went where its row is wrong about it, at most.
    pub fn doubt(&self, emitted: Rgb) -> f64 {
        let doubtful = self.trails.values().filter(|trail| trail.doubt > 0.0);
        largest_share(doubtful.map(|t| t.sent.abs() * t.doubt).sum(), emitted)
    }

    /// Makes the rows of `patches`, of which the most that one is about to shoot is `share`.
    pub fn make(
        &mut self,
        mesh: &Mesh,
        maker: &mut dyn FormFactors,
        patches: &[NodeId],
        share: f64,
    ) -> Result<Vec<Row>, Error> {
        let made = checked_rows(maker, mesh, patches, share)?;
        self.made += made.len() as u64;
        Ok(made)
    }

    /// Makes what is missing of the rows of `patches` that are kept, one batch of `maker`'s at a time.
    /// Each is as it was, since it is made for the same share of the light.
    pub fn recall(
        &mut self,
        mesh: &Mesh,
        maker: &mut dyn FormFactors,
        patches: impl IntoIterator<Item = NodeId>,
    ) -> Result<(), Error> {
        let missing = |p: &NodeId| self.keeps(*p) && !self.rows.contains_key(p);
        let mut missing: Vec<NodeId> = patches.into_iter().filter(missing).collect();
        let share = |p: &NodeId| self.trails[p].share;
        missing.sort_by(|a, b| share(a).total_cmp(&share(b)).then(a.cmp(b)));
        missing.dedup();
        let alike: Vec<(f64, Vec<NodeId>)> = missing
            .chunk_by(|a, b| share(a) == share(b))
            .map(|run| (share(&run[0]), run.to_vec()))
            .collect();
        for (share, patches) in alike {
            for batch in patches.chunks(maker.preferred_batch_len().max(1)) {
                let made = self.make(mesh, maker, batch, share)?;
                self.rows.extend(batch.iter().copied().zip(made.into_iter().map(Arc::new)));
            }
        }
        Ok(())
    }

    /// The rows of the first of `elements`, in their order: as far as one batch of rows made reaches,
    /// and of one element at least. All with the same trouble taken, whatever light they carry, so
    /// that the equations stay what they are from one sweep to the next.
    pub fn next(
        &mut self,
        mesh: &Mesh,
        maker: &mut dyn FormFactors,
        elements: impl IntoIterator<Item = usize>,
    ) -> Result<Vec<(usize, Arc<Row>)>, Error> {
        let (mut missing, batch) = (vec![], maker.preferred_batch_len().max(1));
        let reached: Vec<(usize, NodeId)> = elements
            .into_iter()
            .map(|e| (e, mesh.element(e)))
            .take_while(|(_, patch)| {
                if !self.keeps(*patch) {
                    missing.push(*patch);
                }
                missing.len() <= batch
            })
            .collect();
        missing.truncate(batch);
        self.recall(mesh, maker, reached.iter().map(|&(_, patch)| patch))?;
        let mut made = match missing.is_empty() {
            true => vec![],
            false => self.make(mesh, maker, &missing, 1.0)?,
        }
        .into_iter();
        let row = |(e, patch): (usize, NodeId)| match self.get(patch) {
            Some(row) => Some((e, row.clone())),
            None => {
                let row = Arc::new(made.next()?);
                self.keep(patch, row.clone(), 1.0);
                Some((e, row))
            }
        };
        Ok(reached.into_iter().filter_map(row).collect())
    }
}
