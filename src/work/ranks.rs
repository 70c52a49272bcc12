//! Processes that share out work, as those of MPI.

use std::fmt;

use serde::Serialize;

/// One of several processes that run the same program on the same input, and exchange results.
///
/// Every process makes the same calls in the same order, but for the number of calls of
/// [`Ranks::ask`] and [`Ranks::take`] in a round.
pub trait Ranks: fmt::Debug {
    /// Index of this process, from 0.
    fn rank(&self) -> usize;

    /// Number of processes, ≥ 1.
    fn size(&self) -> usize;

    /// Sends `bytes` to all processes; returns the bytes of all of them, by rank.
    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;

    /// Asks for a number that [`Ranks::take`] is to give, so that it comes while this process
    /// works.
    fn ask(&mut self, round: u64) {
        _ = round;
    }

    /// The next number of the counter of this `round`, which all processes share: from 0, each
    /// number once. It was asked for before. Rounds ascend, and each ends with a call of
    /// [`Ranks::all_gather`].
    fn take(&mut self, round: u64) -> u64;
}

/// A single process.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alone {
    round: u64,
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

    fn take(&mut self, round: u64) -> u64 {
        self.taken = if round == self.round { self.taken + 1 } else { 0 };
        self.round = round;
        self.taken
    }
}

/// What goes from one process to another.
pub(super) fn bytes_of<M: Serialize + ?Sized>(message: &M) -> Vec<u8> {
    postcard::to_extend(message, vec![]).expect("a vector takes all bytes")
}
