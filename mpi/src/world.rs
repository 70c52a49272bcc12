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
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use mpi::datatype::PartitionMut;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator, CommunicatorCollectives, Destination, Source};
use mpi::{Count, Tag, Threading};
use radiosity::work::{Ranks, with_ranks};

use crate::progress::locked;

/// Bytes that all processes give together at once: MPI counts in 31 bits.
const MAX_BYTES: usize = 1 << 30;

/// Messages that ask for a number, and that have one.
const ASK: Tag = 1;
const NUMBER: Tag = 2;

/// Between two looks for messages that ask, after one and after a long time without any: a look
/// takes some microseconds of a core.
const PAUSES: [Duration; 2] = [Duration::from_micros(50), Duration::from_millis(1)];

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
    let mut ranks = World { all: world.duplicate(), counter: Counter::new(&world) };
    let places = ranks.places();
    if world.rank() == 0 {
        eprintln!("{} processes: {places}", world.size());
    }
    let code = with_ranks(Box::new(ranks), program);
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
    counter: Counter,
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "process {} of {}", self.rank(), self.size())
    }
}

impl World {
    /// The hosts, with the number of threads of each process there.
    fn places(&mut self) -> String {
        let host = mpi::environment::processor_name().unwrap_or_default();
        let own = format!("{host}, {} threads", rayon::current_num_threads());
        let mut of_all: Vec<Vec<u8>> = self.all_gather(own.as_bytes());
        of_all.sort();
        let alike = of_all.chunk_by(|a, b| a == b);
        let alike =
            alike.map(|run| format!("{} on {}", run.len(), String::from_utf8_lossy(&run[0])));
        alike.collect::<Vec<_>>().join("; ")
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

    fn ask(&mut self, round: u64) {
        if let Counter::Remote = self.counter {
            SimpleCommunicator::world().process_at_rank(0).send_with_tag(&round, ASK);
        }
    }

    fn take(&mut self, round: u64) -> u64 {
        match &self.counter {
            Counter::Own { counter, .. } => locked(counter).take(round),
            Counter::Remote => {
                SimpleCommunicator::world().process_at_rank(0).receive_with_tag::<u64>(NUMBER).0
            }
        }
    }
}

/// The counter of rounds.
///
/// MPI's own shared memory does without a thread that answers, but its bindings for Rust do not
/// have it.
enum Counter {
    /// In the first process, where a thread answers those that ask.
    Own { counter: Arc<Mutex<Rounds>>, ends: Arc<AtomicBool>, thread: Option<JoinHandle<()>> },
    /// In others.
    Remote,
}

/// A round, and the numbers of it that were taken.
#[derive(Default)]
struct Rounds {
    round: u64,
    taken: u64,
}

impl Rounds {
    /// The next number of `round`; of one that has ended, any.
    fn take(&mut self, round: u64) -> u64 {
        if round > self.round {
            *self = Rounds { round, taken: 0 };
        }
        self.taken += u64::from(round == self.round);
        self.taken.wrapping_sub(1)
    }
}

impl Counter {
    fn new(world: &SimpleCommunicator) -> Counter {
        if world.rank() > 0 {
            return Counter::Remote;
        }
        let (counter, ends) = (Arc::<Mutex<Rounds>>::default(), Arc::new(AtomicBool::new(false)));
        let thread = std::thread::spawn({
            let (counter, ends) = (counter.clone(), ends.clone());
            move || {
                let world = SimpleCommunicator::world();
                let [shortest, longest] = PAUSES;
                let mut pause = shortest;
                while !ends.load(Ordering::Relaxed) {
                    match world.any_process().immediate_matched_probe_with_tag(ASK) {
                        Some((message, asked)) => {
                            let (round, _) = message.matched_receive::<u64>();
                            let number = locked(&counter).take(round);
                            let asker = world.process_at_rank(asked.source_rank());
                            asker.send_with_tag(&number, NUMBER);
                            pause = shortest;
                        }
                        None => {
                            std::thread::sleep(pause);
                            pause = (2 * pause).min(longest);
                        }
                    }
                }
            }
        });
        Counter::Own { counter, ends, thread: Some(thread) }
    }
}

impl Drop for Counter {
    fn drop(&mut self) {
        if let Counter::Own { ends, thread, .. } = self {
            ends.store(true, Ordering::Relaxed);
            if let Some(thread) = thread.take() {
                _ = thread.join();
            }
        }
    }
}
