//! The processes of an MPI run, as the library shares work out to them.

use mpi::Count;
use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives};
use radiosity::ranks::Ranks;

/// Bytes that all processes give together at once: MPI counts in 31 bits.
const MAX_BYTES: usize = 1 << 30;

/// All processes of the run.
pub struct World(pub SimpleCommunicator);

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "process {} of {}", self.rank(), self.size())
    }
}

impl Ranks for World {
    fn rank(&self) -> usize {
        self.0.rank() as usize
    }

    fn size(&self) -> usize {
        self.0.size() as usize
    }

    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut lengths = vec![0u64; self.size()];
        self.0.all_gather_into(&(bytes.len() as u64), &mut lengths[..]);
        let most = MAX_BYTES / self.size();
        let longest = lengths.iter().copied().max().unwrap_or(0) as usize;
        let mut gathered: Vec<Vec<u8>> = vec![vec![]; self.size()];
        for start in (0..longest).step_by(most) {
            let piece = |length: usize| start.min(length)..(start + most).min(length);
            let counts: Vec<Count> =
                lengths.iter().map(|&length| piece(length as usize).len() as Count).collect();
            let starts = counts.iter().scan(0, |end, count| {
                *end += count;
                Some(*end - count)
            });
            let starts: Vec<Count> = starts.collect();
            let mut all = vec![0u8; counts.iter().sum::<Count>() as usize];
            let mut parts = PartitionMut::new(&mut all[..], &counts[..], &starts[..]);
            self.0.all_gather_varcount_into(&bytes[piece(bytes.len())], &mut parts);
            for ((gathered, &at), &count) in gathered.iter_mut().zip(&starts).zip(&counts) {
                gathered.extend(&all[at as usize..][..count as usize]);
            }
        }
        gathered
    }
}
