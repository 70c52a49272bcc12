//! Processes that share out work, each with all of the input: as those of MPI do.

/// One of several processes that run the same program on the same input, and exchange results.
///
/// What is shared out comes back the same, whichever process made it, so that all of them have the
/// same bits, for any number of them. Every process must make the same calls in the same order.
pub trait Ranks: std::fmt::Debug {
    /// The number of this process, from 0.
    fn rank(&self) -> usize;

    /// How many there are, 1 or more.
    fn size(&self) -> usize;

    /// Gives `bytes` to all processes: what each has given, by rank.
    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>>;
}

/// A process that works alone.
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
