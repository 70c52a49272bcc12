//! The processes of an MPI run: one program, whose long loops are shared out between them.
//!
//! ```text
//! mpirun -n 4 radiosity-mpi bake HALL.obj --error 0.05
//! ```
//!
//! Every process runs all of the program on the same input; the first prints and writes. Loops go
//! through [`Ranks`]: parts of them are taken from a counter, which a thread of the first process
//! serves, and results are exchanged.

use std::io::Write;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use mpi::{Count, Tag, Threading};
use radiosity::work::{Ranks, with_ranks};

/// Bytes that all processes give together at once: MPI counts in 31 bits.
const MAX_BYTES: usize = 1 << 30;

/// Messages that ask for a number, and that have one.
const ASK: Tag = 1;
const NUMBER: Tag = 2;

/// Between two looks for messages that ask.
const PAUSE: Duration = Duration::from_micros(200);

/// How long a process that failed waits for the others to end, too, before it ends them.
const PATIENCE: Duration = Duration::from_secs(2);

/// Runs `program` in every process of the run.
pub fn run(program: impl FnOnce() -> ExitCode) -> ExitCode {
    let Some((universe, threading)) = mpi::initialize_with_threading(Threading::Multiple) else {
        eprintln!("error: MPI cannot be initialised");
        return ExitCode::FAILURE;
    };
    let world = universe.world();
    if threading < Threading::Multiple {
        if world.rank() == 0 {
            eprintln!("error: this MPI does not let several threads call it; take one that does");
        }
        return ExitCode::FAILURE;
    }
    // What panics would wait for the others in `MPI_Finalize`, and they for it.
    let report = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        report(info);
        SimpleCommunicator::world().abort(101);
    }));
    let mut errors = (world.rank() > 0).then(silence).flatten();
    let code = with_ranks(Box::new(World::new(world.duplicate())), program);
    end_together(&world, code, errors.as_mut());
    code
}

/// Sends what this process prints nowhere: the first prints the same. The standard error that was.
fn silence() -> Option<std::fs::File> {
    let errors = rustix::io::dup(rustix::stdio::stderr()).ok()?;
    let nowhere = std::fs::OpenOptions::new().write(true).open("/dev/null").ok()?;
    rustix::stdio::dup2_stdout(&nowhere).ok()?;
    rustix::stdio::dup2_stderr(&nowhere).ok()?;
    Some(errors.into())
}

/// Waits until all processes end; if this one failed and others go on, they are ended: they would
/// wait for it.
fn end_together(world: &SimpleCommunicator, code: ExitCode, errors: Option<&mut std::fs::File>) {
    let (failed, start) = (code != ExitCode::SUCCESS, Instant::now());
    let mut all = world.immediate_barrier();
    loop {
        match all.test() {
            Ok(_) => return,
            Err(waiting) => all = waiting,
        }
        if failed && start.elapsed() > PATIENCE {
            let host = mpi::environment::processor_name().unwrap_or_default();
            let rank = world.rank();
            if let Some(errors) = errors {
                _ = writeln!(errors, "error: process {rank} on {host} failed, and others did not");
            }
            world.abort(1);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// All processes of the run.
struct World {
    all: SimpleCommunicator,
    counter: Option<Counter>,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "process {} of {}", self.rank(), self.size())
    }
}

impl World {
    fn new(all: SimpleCommunicator) -> World {
        let counter = (all.rank() == 0 && all.size() > 1).then(Counter::start);
        World { all, counter }
    }
}

impl Ranks for World {
    fn rank(&self) -> usize {
        self.all.rank() as usize
    }

    fn size(&self) -> usize {
        self.all.size() as usize
    }

    fn all_gather(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        let mut lengths = vec![0u64; self.size()];
        self.all.all_gather_into(&(bytes.len() as u64), &mut lengths[..]);
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
            self.all.all_gather_varcount_into(&bytes[piece(bytes.len())], &mut parts);
            for ((gathered, &at), &count) in gathered.iter_mut().zip(&starts).zip(&counts) {
                gathered.extend(&all[at as usize..][..count as usize]);
            }
        }
        gathered
    }

    fn take(&mut self) -> u64 {
        match &self.counter {
            Some(counter) => counter.next.fetch_add(1, Ordering::Relaxed),
            None => {
                let world = SimpleCommunicator::world();
                let first = world.process_at_rank(0);
                first.send_with_tag(&0u64, ASK);
                first.receive_with_tag::<u64>(NUMBER).0
            }
        }
    }
}

/// The counter, in the first process; a thread answers those that ask.
///
/// MPI's own shared memory does without the thread, but its bindings for Rust do not have it.
struct Counter {
    next: Arc<AtomicU64>,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Counter {
    fn start() -> Counter {
        let (next, ends) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicBool::new(false)));
        let thread = std::thread::spawn({
            let (next, ends) = (next.clone(), ends.clone());
            move || {
                let world = SimpleCommunicator::world();
                while !ends.load(Ordering::Relaxed) {
                    match world.any_process().immediate_matched_probe_with_tag(ASK) {
                        Some((message, asked)) => {
                            _ = message.matched_receive::<u64>();
                            let number = next.fetch_add(1, Ordering::Relaxed);
                            let asker = world.process_at_rank(asked.source_rank());
                            asker.send_with_tag(&number, NUMBER);
                        }
                        None => std::thread::sleep(PAUSE),
                    }
                }
            }
        });
        Counter { next, ends, thread: Some(thread) }
    }
}

impl Drop for Counter {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            _ = thread.join();
        }
    }
}
