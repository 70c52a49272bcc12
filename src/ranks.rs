//! Work distributed over processes that all have the whole input, as with MPI.

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

/// Results of all ranks in the order of the `items`, which were assigned round-robin.
pub(crate) fn in_order<R>(of_ranks: Vec<Vec<R>>, items: usize) -> Vec<R> {
    let size = of_ranks.len();
    let mut of_ranks: Vec<_> = of_ranks.into_iter().map(Vec::into_iter).collect();
    (0..items).filter_map(|k| of_ranks[k % size].next()).collect()
}

/// Selects the items of one process: they are assigned round-robin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Share {
    rank: usize,
    size: usize,
}

impl Share {
    pub fn of(ranks: &dyn Ranks) -> Share {
        Share { rank: ranks.rank(), size: ranks.size() }
    }

    /// The share of `items`.
    pub fn from<T>(self, items: &[T]) -> impl Iterator<Item = &T> {
        items.iter().skip(self.rank).step_by(self.size)
    }
}

/// `message`, serialized for other processes.
pub(crate) fn encoded(message: &impl Serialize) -> Vec<u8> {
    postcard::to_extend(message, vec![]).expect("a vector takes all bytes")
}

/// A message that another process has [`encoded`].
pub(crate) fn decoded<T: DeserializeOwned>(bytes: &[u8]) -> T {
    postcard::from_bytes(bytes).expect("all processes run the same program")
}
