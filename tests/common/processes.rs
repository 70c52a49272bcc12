//! Threads that act as processes which share out work.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Barrier, Mutex};

use radiosity::work::{Ranks, with_ranks};

/// One of some threads that act as processes.
#[derive(Clone, Debug)]
struct Thread {
    rank: usize,
    given: Arc<Mutex<Vec<Vec<u8>>>>,
    barrier: Arc<Barrier>,
    /// The round and the counter that all share, and how many numbers each has taken.
    counter: Arc<Mutex<(u64, u64)>>,
    taken: Arc<Vec<AtomicU64>>,
}

impl Ranks for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.taken.len()
    }

    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        self.given.lock().unwrap()[self.rank] = bytes.to_vec();
        self.barrier.wait();
        let all = self.given.lock().unwrap().clone();
        self.barrier.wait();
        all
    }

    fn take(&mut self, round: u64) -> u64 {
        self.taken[self.rank].fetch_add(1, Ordering::Relaxed);
        let mut counter = self.counter.lock().unwrap();
        if counter.0 != round {
            *counter = (round, 0);
        }
        counter.1 += 1;
        counter.1 - 1
    }
}

/// What `work` makes in each of `size` processes, by their rank.
pub fn in_processes<R: Send>(size: usize, work: impl Fn(usize) -> R + Sync) -> Vec<R> {
    let thread = Thread {
        rank: 0,
        given: Arc::new(Mutex::new(vec![vec![]; size])),
        barrier: Arc::new(Barrier::new(size)),
        counter: Arc::default(),
        taken: Arc::new((0..size).map(|_| AtomicU64::new(0)).collect()),
    };
    let made = std::thread::scope(|scope| {
        let process = |rank| {
            let (thread, work) = (Thread { rank, ..thread.clone() }, &work);
            scope.spawn(move || with_ranks(Box::new(thread), || work(rank)))
        };
        let threads: Vec<_> = (0..size).map(process).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let idle = thread.taken.iter().any(|taken| taken.load(Ordering::Relaxed) == 0);
    assert!(!idle, "nothing was shared out");
    made
}
