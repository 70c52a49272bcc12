//! Processes that share out work, as those of MPI.

use std::fmt;

/// One of several processes that run the same program on the same input, and exchange results.
///
/// Every process makes the same calls in the same order, but for [`Ranks::take`].
pub trait Ranks: fmt::Debug {
    /// Index of this process, from 0.
    fn rank(&self) -> usize;

    /// Number of processes, ≥ 1.
    fn size(&self) -> usize;

    /// Sends `bytes` to all processes; returns the bytes of all of them, by rank.
    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;

    /// The next number of a counter that all processes share: 0 at first, each number once.
    fn take(&mut self) -> u64;
}

/// A single process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone {
    taken: u64,
}

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

    fn take(&mut self) -> u64 {
        self.taken += 1;
        self.taken - 1
    }
}
