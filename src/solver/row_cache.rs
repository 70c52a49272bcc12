//! Rows for a solver: cached within a memory budget, recomputed beyond it.
//!
//! Rows are never evicted to make room. Shooting takes the brightest patches first, and those shoot
//! again; the other methods visit all rows cyclically, for which LRU eviction has a hit rate of
//! zero. So the first rows that fit stay.
//!
//! A cached row may be missing from memory after a session was read from a file: it is rebuilt on
//! demand, with the same importance and so with the same bits. Results do not depend on whether
//! rows are missing.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::ledger::largest_share;
use crate::error::Error;
use crate::form_factor::{FormFactors, Row, checked_rows};
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;
use crate::work::Batches;

/// Rows by patch, and the flux sent along each.
#[derive(Clone)]
pub(super) struct RowCache {
    rows: HashMap<NodeId, Arc<Row>>,
    /// Ordered, so that sums over them are the same on every run.
    pub histories: BTreeMap<NodeId, PatchHistory>,
    /// Unused bytes of the budget.
    free_bytes: usize,
    /// Rows computed so far.
    pub rows_made: u64,
    /// Sizes of requests to the source of rows, so that none takes long.
    requests: Batches,
}

/// Record of a patch that has sent light.
#[derive(Clone, Copy, Default, Serialize, Deserialize)]
pub(super) struct PatchHistory {
    /// All the flux that went along its row, W.
    pub sent: Rgb,
    /// The importance with which its row was last computed: see [`FormFactors::rows`].
    pub importance: f64,
    /// Whether its row is cached, in memory or missing.
    pub cached: bool,
    /// Upper bound of the share of its light that its row misplaces since objects have moved. A
    /// stale row cannot be computed again.
    pub stale_fraction: f64,
}

impl RowCache {
    /// An empty cache for rows of `budget` bytes.
    pub fn new(budget: usize) -> RowCache {
        RowCache {
            rows: HashMap::new(),
            histories: BTreeMap::new(),
            free_bytes: budget,
            rows_made: 0,
            requests: Batches::new(16),
        }
    }

    /// Unused bytes of the budget.
    pub fn free_bytes(&self) -> usize {
        self.free_bytes
    }

    /// Restores saved histories and `rows`; all other cached rows are missing.
    pub fn restore(
        &mut self,
        histories: Vec<(NodeId, PatchHistory)>,
        rows: Vec<(NodeId, Row)>,
        rows_made: u64,
        free_bytes: usize,
    ) {
        self.rows = rows.into_iter().map(|(patch, row)| (patch, Arc::new(row))).collect();
        self.histories = histories.into_iter().collect();
        self.rows_made = rows_made;
        self.free_bytes = free_bytes.min(self.free_bytes);
    }

    /// Whether the row of `patch` is cached, in memory or missing.
    pub fn contains(&self, patch: NodeId) -> bool {
        self.histories.get(&patch).is_some_and(|history| history.cached)
    }

    /// The row of `patch`, if it is in memory.
    pub fn get(&self, patch: NodeId) -> Option<&Arc<Row>> {
        self.rows.get(&patch)
    }

    /// Caches `row`, computed with `importance`, if it fits.
    pub fn insert(&mut self, patch: NodeId, row: impl Into<Arc<Row>>, importance: f64) {
        let row = row.into();
        let history = self.histories.entry(patch).or_default();
        history.importance = importance;
        if let Some(free_bytes) = self.free_bytes.checked_sub(row.bytes()) {
            self.free_bytes = free_bytes;
            history.cached = true;
            self.rows.insert(patch, row);
        }
    }

    /// Removes the row of `patch`.
    pub fn evict(&mut self, patch: NodeId) {
        let row = self.rows.remove(&patch);
        self.free_bytes += row.map_or(0, |row| row.bytes());
        self.histories.entry(patch).or_default().cached = false;
    }

    /// Records that `flux` (W) went along the row of `patch`.
    pub fn record_sent(&mut self, patch: NodeId, flux: Rgb) {
        self.histories.entry(patch).or_default().sent += flux;
    }

    /// Upper bound of the flux that stale rows have misplaced, as a share of `emitted`: the worst
    /// channel.
    pub fn stale_flux_bound(&self, emitted: Rgb) -> f64 {
        let stale = self.histories.values().filter(|history| history.stale_fraction > 0.0);
        let misplaced = stale.map(|history| history.sent.abs() * history.stale_fraction);
        largest_share(misplaced.sum(), emitted)
    }

    /// Computes and checks the rows of `patches`, without caching them.
    pub fn make(
        &mut self,
        mesh: &Mesh,
        row_source: &mut dyn FormFactors,
        mut patches: &[NodeId],
        importance: f64,
    ) -> Result<Vec<Row>, Error> {
        let mut rows = vec![];
        while !patches.is_empty() {
            rows.extend(self.make_some(mesh, row_source, &mut patches, importance)?);
        }
        Ok(rows)
    }

    /// The same for the first of `patches`, as many as take a fraction of a second; these are taken
    /// off. A row does not depend on which others are requested with it.
    pub fn make_some(
        &mut self,
        mesh: &Mesh,
        row_source: &mut dyn FormFactors,
        patches: &mut &[NodeId],
        importance: f64,
    ) -> Result<Vec<Row>, Error> {
        let make = |request: &[NodeId]| checked_rows(row_source, mesh, request, importance);
        let (_, rows) = self.requests.try_next(patches, make)?;
        self.rows_made += rows.len() as u64;
        Ok(rows)
    }

    /// Recomputes those rows of `patches` that are cached but missing from memory. The same
    /// importance gives the same bits.
    pub fn rebuild_missing(
        &mut self,
        mesh: &Mesh,
        row_source: &mut dyn FormFactors,
        patches: impl IntoIterator<Item = NodeId>,
    ) -> Result<(), Error> {
        let is_missing = |p: &NodeId| self.contains(*p) && !self.rows.contains_key(p);
        let importance = |p: &NodeId| self.histories[p].importance;
        let mut missing: Vec<NodeId> = patches.into_iter().filter(is_missing).collect();
        missing.sort_by(|a, b| importance(a).total_cmp(&importance(b)).then(a.cmp(b)));
        missing.dedup();
        let by_importance: Vec<(f64, Vec<NodeId>)> = missing
            .chunk_by(|a, b| importance(a) == importance(b))
            .map(|run| (importance(&run[0]), run.to_vec()))
            .collect();
        for (importance, patches) in by_importance {
            let rows = self.make(mesh, row_source, &patches, importance)?;
            self.rows.extend(patches.into_iter().zip(rows.into_iter().map(Arc::new)));
        }
        Ok(())
    }

    /// The rows of the first of `elements`, in their order: as many as are cached or fit in one
    /// request for new rows, at least one.
    pub fn next_element_rows(
        &mut self,
        mesh: &Mesh,
        row_source: &mut dyn FormFactors,
        elements: impl IntoIterator<Item = usize>,
    ) -> Result<Vec<(usize, Arc<Row>)>, Error> {
        let batch_len = row_source.preferred_batch_len().max(1);
        let mut uncached = vec![];
        let reached: Vec<(usize, NodeId)> = elements
            .into_iter()
            .map(|e| (e, mesh.element(e)))
            .take_while(|(_, patch)| {
                if !self.contains(*patch) {
                    uncached.push(*patch);
                }
                uncached.len() <= batch_len
            })
            .collect();
        uncached.truncate(batch_len);
        self.rebuild_missing(mesh, row_source, reached.iter().map(|&(_, patch)| patch))?;
        // Full importance, whatever light they carry: all methods but shooting use them again in
        // every step, and the equations do not change between steps.
        let importance = 1.0;
        let new_rows = if uncached.is_empty() {
            vec![]
        } else {
            self.make_some(mesh, row_source, &mut &uncached[..], importance)?
        };
        let mut new_rows = new_rows.into_iter();
        let mut rows = Vec::with_capacity(reached.len());
        for (e, patch) in reached {
            let row = match self.get(patch) {
                Some(row) => row.clone(),
                None => {
                    let Some(row) = new_rows.next() else { break };
                    let row = Arc::new(row);
                    self.insert(patch, row.clone(), importance);
                    row
                }
            };
            rows.push((e, row));
        }
        Ok(rows)
    }
}
