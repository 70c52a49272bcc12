//! Threads that act as processes which share out work.

use std::sync::{Arc, Barrier, Mutex};

use radiosity::ranks::Ranks;

/// One of some threads that act as processes.
#[derive(Debug)]
pub struct Thread {
    rank: usize,
    given: Arc<Mutex<Vec<Vec<u8>>>>,
    barrier: Arc<Barrier>,
    calls: usize,
}

impl Ranks for Thread {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.given.lock().unwrap().len()
    }

    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        self.calls += 1;
        self.given.lock().unwrap()[self.rank] = bytes.to_vec();
        self.barrier.wait();
        let all = self.given.lock().unwrap().clone();
        self.barrier.wait();
        all
    }
}

/// What `work` makes in each of `size` processes.
pub fn in_processes<R: Send>(size: usize, work: impl Fn(&mut Thread) -> R + Sync) -> Vec<R> {
    let given = Arc::new(Mutex::new(vec![vec![]; size]));
    let barrier = Arc::new(Barrier::new(size));
    std::thread::scope(|scope| {
        let process = |rank| {
            let (given, barrier) = (given.clone(), barrier.clone());
            let work = &work;
            scope.spawn(move || {
                let mut thread = Thread { rank, given, barrier, calls: 0 };
                let result = work(&mut thread);
                assert!(thread.calls > 0, "nothing was shared out");
                result
            })
        };
        let threads: Vec<_> = (0..size).map(process).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}
