//! Work distributed over processes that all have the whole input, as with MPI.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// One of several processes that run the same program on the same input, and exchange results.
///
/// Distributed results do not depend on which process computed them, so that all processes have the
/// same bits, for any number of processes. Every process must make the same calls in the same
/// order.
pub trait Ranks: std::fmt::Debug {
    /// Index of this process, from 0.
    fn rank(&self) -> usize;

    /// Number of processes, ≥ 1.
    fn size(&self) -> usize;

    /// Sends `bytes` to all processes; returns the bytes of all of them, by rank.
    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;
}

/// A single process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone;

impl Ranks for Alone {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        vec![bytes.to_vec()]
    }
}

/// The results of `work` for all `items`, in their order, computed by all processes and the threads
/// of each.
///
/// Items are assigned round-robin: neighbours take about the same time, so that the load is
/// balanced.
pub(crate) fn share_out<T: Sync, R: Send + Serialize + DeserializeOwned>(
    items: &[T],
    ranks: &mut dyn Ranks,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let (rank, size) = (ranks.rank(), ranks.size());
    let own = items.par_iter().skip(rank).step_by(size);
    let results: Vec<R> = own.map(&work).collect();
    if size == 1 {
        return results;
    }
    let bytes = postcard::to_extend(&results, vec![]).expect("a vector takes all bytes");
    drop(results);
    let decoded = |bytes: Vec<u8>| -> Vec<R> {
        postcard::from_bytes(&bytes).expect("all processes run the same program")
    };
    let of_ranks = ranks.all_gather(&bytes).into_iter();
    let mut of_ranks: Vec<_> = of_ranks.map(|bytes| decoded(bytes).into_iter()).collect();
    (0..items.len()).filter_map(|k| of_ranks[k % size].next()).collect()
}
