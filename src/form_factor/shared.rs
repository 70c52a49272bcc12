//! Rows shared out between processes: one drives the solve, the others serve it.
//!
//! ```text
//! process 0        Solver ─→ SharedRows ─ patches ─→ all      own rows ─┐
//! the others                 serve      ←─────────────┘       own rows ─┴─→ process 0
//! ```
//!
//! Rows are whole numbers and come back in the order of their patches, so that a solve has the same
//! bits with any number of processes whose sources make the same rows.

use serde::{Deserialize, Serialize};

use super::{FormFactors, Row, checked_rows};
use crate::error::{Error, ErrorKind};
use crate::mesh::{Mesh, NodeId};
use crate::ranks::Ranks;

/// Rows that are wanted: of these patches, of this weight.
#[derive(Serialize, Deserialize)]
struct Request {
    weight: f64,
    patches: Vec<NodeId>,
}

/// Rows of several processes as those of one source: process 0 has it, the others call
/// [`SharedRows::serve`].
#[derive(Debug)]
pub struct SharedRows<'a, F> {
    source: F,
    ranks: &'a mut dyn Ranks,
}

impl<'a, F: FormFactors> SharedRows<'a, F> {
    /// Shares rows out to `ranks`, of which this process is number 0, with `source` for its own.
    /// The others serve until this is dropped.
    pub fn new(source: F, ranks: &'a mut dyn Ranks) -> SharedRows<'a, F> {
        SharedRows { source, ranks }
    }

    /// Makes rows over `mesh` for process 0 until it has no more to ask for. Meshes and settings of
    /// sources must be the same in all processes.
    ///
    /// An error of `source` is told to process 0, which then fails.
    ///
    /// # Panics
    /// When process 0 does not share rows out.
    pub fn serve(source: &mut F, mesh: &Mesh, ranks: &mut dyn Ranks) {
        loop {
            let requests = ranks.all_gather(&[]);
            if requests[0].is_empty() {
                return;
            }
            let request = decoded::<Request>(&requests[0]);
            let own = own_rows(source, mesh, &request, ranks);
            ranks.all_gather(&encoded(&own));
        }
    }
}

impl<F: FormFactors> FormFactors for SharedRows<'_, F> {
    fn rows(&mut self, mesh: &Mesh, patches: &[NodeId], weight: f64) -> Result<Vec<Row>, Error> {
        if self.ranks.size() == 1 {
            return self.source.rows(mesh, patches, weight);
        }
        let request = Request { weight, patches: patches.to_vec() };
        self.ranks.all_gather(&encoded(&request));
        let own = own_rows(&mut self.source, mesh, &request, self.ranks);
        let mut of_ranks = vec![];
        for (bytes, rank) in self.ranks.all_gather(&encoded(&own)).iter().zip(0..) {
            let rows = decoded::<Result<Vec<Row>, String>>(bytes).map_err(|found| {
                let remedy = "see to that process, and go on from the last checkpoint";
                Error::new(ErrorKind::Device, format!("rows of process {rank}"), found, remedy)
            })?;
            of_ranks.push(rows.into_iter());
        }
        let size = of_ranks.len();
        Ok((0..patches.len()).filter_map(|k| of_ranks[k % size].next()).collect())
    }

    fn preferred_batch_len(&self) -> usize {
        // As many whatever the processes: a solve shoots in the order of its batches.
        self.source.preferred_batch_len()
    }

    fn fingerprint(&self) -> String {
        self.source.fingerprint()
    }
}

impl<F> Drop for SharedRows<'_, F> {
    fn drop(&mut self) {
        if self.ranks.size() > 1 {
            self.ranks.all_gather(&[]);
        }
    }
}

/// The rows of `request` that fall to this process; of an error, its text.
fn own_rows(
    source: &mut impl FormFactors,
    mesh: &Mesh,
    request: &Request,
    ranks: &dyn Ranks,
) -> Result<Vec<Row>, String> {
    let own = request.patches.iter().skip(ranks.rank()).step_by(ranks.size());
    let own: Vec<NodeId> = own.copied().collect();
    checked_rows(source, mesh, &own, request.weight).map_err(|e| e.to_string())
}

fn encoded(message: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(message, vec![]).expect("a vector takes all bytes")
}

fn decoded<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> T {
    postcard::from_bytes(bytes).expect("all processes run the same program")
}
