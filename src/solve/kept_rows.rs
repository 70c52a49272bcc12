//! Rows kept for the next time their patch shoots, within a memory budget.

use std::collections::HashMap;

use crate::form_factor::Row;
use crate::mesh::NodeId;

/// Rows by patch. Once the budget is full, nothing more is kept and nothing is given up: shooting
/// takes the brightest patches first, and those are the ones that shoot again.
pub(super) struct KeptRows {
    rows: HashMap<NodeId, Row>,
    free: usize,
}

impl KeptRows {
    pub fn new(budget: usize) -> KeptRows {
        KeptRows { rows: HashMap::new(), free: budget }
    }

    pub fn get(&self, patch: NodeId) -> Option<&Row> {
        self.rows.get(&patch)
    }

    /// Keeps `row` if it fits.
    pub fn keep(&mut self, patch: NodeId, row: Row) {
        if let Some(free) = self.free.checked_sub(row.bytes()) {
            self.free = free;
            self.rows.insert(patch, row);
        }
    }
}
