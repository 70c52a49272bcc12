//! Rows distributed over processes: one drives the solve, the others serve it.
//!
//! ```text
//! process 0        Solver ─→ SharedRows ─ patches ─→ all      own rows ─┐
//! the others                 serve      ←─────────────┘       own rows ─┴─→ process 0
//! ```
//!
//! Rows are integers and come back in the order of their patches, so that a solve has the same bits
//! with any number of processes whose sources make the same rows.

use serde::{Deserialize, Serialize};

use super::{FormFactors, Row, checked_rows};
use crate::error::Error;
use crate::mesh::{Mesh, NodeId};
use crate::ranks::{Ranks, Share, ask, dismiss, serve};

/// A request for rows of these patches, with this weight.
#[derive(Serialize, Deserialize)]
struct Request {
    weight: f64,
    patches: Vec<NodeId>,
}

/// Combines the rows of several processes to one source: process 0 has it, the others call
/// [`SharedRows::serve`].
#[derive(Debug)]
pub struct SharedRows<'a, F> {
    source: F,
    ranks: &'a mut dyn Ranks,
}

impl<'a, F: FormFactors> SharedRows<'a, F> {
    /// Distributes rows over `ranks`, of which this process is number 0, with `source` for its own
    /// share. The others serve until this is dropped.
    pub fn new(source: F, ranks: &'a mut dyn Ranks) -> SharedRows<'a, F> {
        SharedRows { source, ranks }
    }

    /// Makes rows over `mesh` for process 0 until that is done. Meshes and settings of sources must
    /// be the same in all processes.
    ///
    /// An error of `source` is sent to process 0, which then fails.
    ///
    /// # Panics
    /// When process 0 does not distribute rows.
    pub fn serve(source: &mut F, mesh: &Mesh, ranks: &mut dyn Ranks) {
        serve(ranks, |request, share| own_rows(source, mesh, request, share));
    }
}

impl<F: FormFactors> FormFactors for SharedRows<'_, F> {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        let request = Request { weight, patches: patches.to_vec() };
        let own = |request: &Request, share| own_rows(&mut self.source, mesh, request, share);
        ask(self.ranks, &request, patches.len(), own)
    }

    fn preferred_batch_len(&self) -> usize {
        // Independent of the number of processes: a solve shoots in the order of its batches.
        self.source.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        self.source.fingerprint()
    }
}

impl<F> Drop for SharedRows<'_, F> {
    fn drop(&mut self) {
        dismiss(self.ranks);
    }
}

/// This process's share of the rows of `request`.
fn own_rows(
    source: &mut impl FormFactors,
    mesh: &Mesh,
    request: &Request,
    share: Share,
) -> Result<Vec<Row>, Error> {
    let own: Vec<NodeId> = share.from(&request.patches).copied().collect();
    checked_rows(source, mesh, &own, request.weight)
}
