//! The processes and the journal of the program that runs in a thread.

use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::{ControlFlow, Deref, DerefMut, Range};
use std::panic::Location;
use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::costs::{Batch, Costs, Recorder};
use super::journal::Journal;
use super::ranks::{Alone, Ranks, bytes_of};
use crate::progress::Instant;

thread_local! {
    static TEAM: RefCell<Option<Box<Team>>> = const { RefCell::new(None) };
}

/// Where a loop is in the code: those of one site have items of similar cost.
pub(super) type Site = &'static Location<'static>;

/// Processes, a journal, and what all processes agree upon.
pub(super) struct Team {
    ranks: Box<dyn Ranks>,
    journal: Option<Journal>,
    /// Whether process 0 has records of the journal that were not used yet.
    replays: bool,
    /// Loops that began so far.
    loops: u64,
    /// Batches that were shared out so far.
    rounds: u64,
    /// When this process began to work with others.
    start: Instant,
    /// The clock of process 0 at the last exchange, since its start.
    agreed: Duration,
    /// Seconds of an item at each site, as all processes together measured it last.
    costs: HashMap<Site, f64>,
    recorder: Option<Recorder>,
}

/// What a process says of itself in every exchange.
#[derive(Serialize, Deserialize)]
struct Report {
    clock: Duration,
    /// Time that it worked for the batch.
    busy: Duration,
}

/// Runs `work`, all long loops of which are shared with other processes that run the same.
pub fn with_ranks<T>(ranks: Box<dyn Ranks>, work: impl FnOnce() -> T) -> T {
    let before = TEAM.replace(Some(Box::new(Team::new(ranks))));
    let done = work();
    TEAM.set(before);
    done
}

/// Runs `work`, with the results of all its long loops in `journal`: those that are there are
/// not computed again, and others are appended. Of several processes the first has the journal,
/// others give none.
pub fn with_journal<T>(journal: &mut Option<Journal>, work: impl FnOnce() -> T) -> T {
    let with = || {
        if let Some(mut team) = borrow() {
            team.keep(journal.take());
        }
        let done = work();
        if let Some(mut team) = borrow() {
            *journal = team.journal.take();
            team.keep(None);
        }
        done
    };
    match TEAM.with_borrow(Option::is_some) {
        true => with(),
        false => with_ranks(Box::<Alone>::default(), with),
    }
}

/// Runs `work`, and records its costs, in a single process.
pub fn with_costs<T>(work: impl FnOnce() -> T) -> (T, Costs) {
    let record = |recorder: Option<Recorder>| {
        let mut team = borrow()?;
        std::mem::replace(&mut team.recorder, recorder)
    };
    let recorded = || {
        record(Some(Recorder::new()));
        let done = work();
        (done, record(None).map(Recorder::finish).unwrap_or_default())
    };
    match TEAM.with_borrow(Option::is_some) {
        true => recorded(),
        false => with_ranks(Box::<Alone>::default(), recorded),
    }
}

/// What `work` makes in the first process, in all of them: what only that one can read.
///
/// # Errors
/// Those of `work`.
pub fn from_first<R, E>(work: impl FnOnce() -> Result<R, E>) -> Result<R, E>
where
    R: Serialize + DeserializeOwned,
    E: Serialize + DeserializeOwned,
{
    match borrow() {
        Some(mut team) if team.is_divided() => {
            let made = (team.ranks.rank() == 0).then(work);
            let all = team.exchange(Duration::ZERO, &made).1;
            all.into_iter().flatten().next().unwrap_or_else(|| unreachable!("the first has it"))
        }
        _ => work(),
    }
}

/// Runs `work` in this process alone, as for what only the first does.
pub fn alone<T>(work: impl FnOnce() -> T) -> T {
    let _kept = borrow();
    work()
}

/// Number of processes.
pub fn processes() -> usize {
    borrow().map_or(1, |team| team.processes())
}

/// Whether other processes take part, or costs are recorded as if they did.
pub(crate) fn is_shared() -> bool {
    borrow().is_some_and(|team| team.is_divided())
}

/// Whether this process is the first, which prints and writes.
pub fn is_first() -> bool {
    borrow().is_none_or(|team| team.ranks.rank() == 0)
}

/// The time by which work is ended: with other processes that of the last exchange.
pub(crate) fn now() -> Instant {
    match borrow() {
        Some(team) if team.processes() > 1 => team.start + team.agreed,
        _ => Instant::now(),
    }
}

/// Whether to go on, by what this process and all others say: a break of one stops all.
pub fn agree(flow: ControlFlow<()>) -> ControlFlow<()> {
    match borrow() {
        Some(mut team) if team.is_divided() => {
            let breaks = team.exchange(Duration::ZERO, &flow.is_break()).1;
            if breaks.contains(&true) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        }
        _ => flow,
    }
}

/// The number of a loop that begins.
pub(super) fn next_loop() -> Option<u64> {
    let mut team = borrow()?;
    team.loops += 1;
    Some(team.loops)
}

/// The team of this thread, if it has one that is not in use: what is shared as a whole has no
/// parts that are shared.
pub(super) fn borrow() -> Option<Borrowed> {
    TEAM.take().map(|team| Borrowed(Some(team)))
}

/// A team in use.
pub(super) struct Borrowed(Option<Box<Team>>);

impl Drop for Borrowed {
    fn drop(&mut self) {
        TEAM.set(self.0.take());
    }
}

impl Deref for Borrowed {
    type Target = Team;

    fn deref(&self) -> &Team {
        self.0.as_ref().expect("it is given back when dropped")
    }
}

impl DerefMut for Borrowed {
    fn deref_mut(&mut self) -> &mut Team {
        self.0.as_mut().expect("it is given back when dropped")
    }
}

impl Team {
    fn new(ranks: Box<dyn Ranks>) -> Team {
        Team {
            ranks,
            journal: None,
            replays: false,
            loops: 0,
            rounds: 0,
            start: Instant::now(),
            agreed: Duration::ZERO,
            costs: HashMap::new(),
            recorder: None,
        }
    }

    pub fn processes(&self) -> usize {
        self.ranks.size()
    }

    pub fn rank(&self) -> usize {
        self.ranks.rank()
    }

    /// Whether work is shared out, or is to be recorded as if it were.
    pub fn is_divided(&self) -> bool {
        self.processes() > 1 || self.recorder.is_some()
    }

    /// The largest of the sizes of all processes.
    pub fn largest(&mut self, size: usize) -> usize {
        let sizes = self.exchange(Duration::ZERO, &(size as u64)).1;
        sizes.into_iter().max().unwrap_or(1) as usize
    }

    /// Keeps results in `journal` from here on. Its loops are counted from here.
    fn keep(&mut self, journal: Option<Journal>) {
        self.loops = 0;
        self.journal = journal;
        let has_records = self.journal.as_ref().is_some_and(Journal::has_records);
        self.replays = self.exchange(Duration::ZERO, &has_records).1[0];
    }

    /// The results that the journal has of loop `number` from item `first` on, of `count` at most.
    pub fn recorded<R: DeserializeOwned>(
        &mut self,
        number: u64,
        first: u64,
        count: usize,
    ) -> Option<Vec<R>> {
        if !self.replays {
            return None;
        }
        let record = self.journal.as_mut().and_then(|journal| journal.take(number, first));
        let more = self.journal.as_ref().is_some_and(Journal::has_records);
        let (record, more) = match self.processes() {
            1 => (record, more),
            _ => self.exchange(Duration::ZERO, &(record, more)).1.swap_remove(0),
        };
        self.replays = more;
        let results: Vec<R> = postcard::from_bytes(&record?).ok()?;
        (1..=count).contains(&results.len()).then_some(results)
    }

    /// Appends the results of loop `number` from item `first` on.
    pub fn record<R: Serialize + Sync>(&mut self, number: u64, first: u64, results: &[R]) {
        if let Some(journal) = &mut self.journal {
            journal.append(number, first, results);
        }
    }

    /// The results of `work` for `count` items, one each, and the mean time that a process worked.
    /// Parts of the `batch` are taken by whichever process is free, the larger ones first.
    ///
    /// # Errors
    /// That of the first process that has one.
    pub fn share_out<R, E>(
        &mut self,
        site: Site,
        batch: Batch,
        count: usize,
        work: &mut dyn FnMut(Range<usize>) -> Result<Vec<R>, E>,
    ) -> Result<(Vec<R>, Duration), E>
    where
        R: Serialize + DeserializeOwned,
        E: Serialize + DeserializeOwned,
    {
        let processes = self.processes();
        let start = Instant::now();
        if processes == 1 {
            let results = match &mut self.recorder {
                Some(recorder) => recorder.batch(batch, count, work)?,
                None => work(0..count)?,
            };
            return Ok((results, start.elapsed()));
        }
        let least = (batch.least as usize).div_ceil(processes);
        let parts = parts(count, processes, least, self.costs.get(&site).copied());
        let mut own: Result<Vec<(u32, Vec<R>)>, E> = Ok(vec![]);
        self.rounds += 1;
        // The first part of each process needs no counter.
        let mut k = self.ranks.rank();
        while let (Some(part), Ok(done)) = (parts.get(k), &mut own) {
            if parts.len() > processes {
                self.ranks.ask(self.rounds);
            }
            match work(part.clone()) {
                Ok(results) => done.push((k as u32, results)),
                Err(error) => own = Err(error),
            }
            if parts.len() <= processes {
                break;
            }
            k = processes + self.ranks.take(self.rounds) as usize;
        }
        let (busy, of_all) = self.exchange(start.elapsed(), &own);
        self.costs.insert(site, busy.as_secs_f64() * processes as f64 / count.max(1) as f64);
        let mut by_part: Vec<(u32, Vec<R>)> = vec![];
        for results in of_all {
            by_part.extend(results?);
        }
        by_part.sort_unstable_by_key(|(part, _)| *part);
        Ok((by_part.into_iter().flat_map(|(_, results)| results).collect(), busy))
    }

    /// What all processes say, by rank, and the mean time that they worked.
    pub fn exchange<M: Serialize + DeserializeOwned>(
        &mut self,
        busy: Duration,
        message: &M,
    ) -> (Duration, Vec<M>) {
        let report = Report { clock: self.start.elapsed(), busy };
        let bytes = bytes_of(&(report, message));
        if let Some(recorder) = &mut self.recorder {
            recorder.exchange(bytes.len());
        }
        let all = self.ranks.all_gather(&bytes);
        let decoded = |bytes: &Vec<u8>| -> (Report, M) {
            postcard::from_bytes(bytes).expect("all processes run the same program")
        };
        let (reports, messages): (Vec<Report>, Vec<M>) = all.iter().map(decoded).unzip();
        self.agreed = reports[0].clock;
        let busy = reports.iter().map(|report| report.busy).sum::<Duration>();
        (busy / reports.len() as u32, messages)
    }
}

/// Parts of an even share of a batch that the last ones are, at least: so far apart are the ends of
/// processes, where items are alike, and a process is not held up by asking for parts.
const LAST_PARTS: usize = 64;

/// Seconds of a part, at least: about the time in which a process gets the number of its next one.
const SHORTEST_PART: f64 = 1e-3;

/// The parts of `count` items for `processes` that take them on demand: half of an even share of
/// what is left, and `least` at least. Items take `cost` seconds, if that is known: what takes few
/// milliseconds is divided evenly.
///
/// Source: Polychronopoulos, Kuck 1987, guided self-scheduling; with half of its parts, since items
/// differ.
pub(super) fn parts(
    count: usize,
    processes: usize,
    least: usize,
    cost: Option<f64>,
) -> Vec<Range<usize>> {
    // A cost of zero gives infinity, which becomes the largest number.
    let long =
        cost.map_or(1, |cost| (SHORTEST_PART / cost) as usize).min(count.div_ceil(processes));
    let least = least.max(count / (processes * LAST_PARTS)).max(long);
    let mut parts = vec![];
    let mut start = 0;
    while start < count {
        let part = ((count - start) / (2 * processes)).max(least.max(1)).min(count - start);
        parts.push(start..start + part);
        start += part;
    }
    parts
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::parts;

    #[test]
    fn parts_cover_all_items_once_the_larger_first() {
        for (count, processes, least) in [(1, 2, 1), (1000, 2, 1), (1000, 64, 8), (7, 3, 100)] {
            let parts = parts(count, processes, least, None);
            let items: Vec<usize> = parts.iter().cloned().flatten().collect();
            assert!(items.into_iter().eq(0..count));
            assert!(parts.is_sorted_by(|a, b| a.len() >= b.len()));
            assert!(parts[0].len() <= least.max(count.div_ceil(2 * processes)));
        }
    }

    #[test]
    fn short_work_is_divided_evenly() {
        let sizes = |cost| {
            let parts = parts(1000, 4, 1, Some(cost));
            parts.iter().map(Range::len).collect::<Vec<usize>>()
        };
        // Four milliseconds, and less; of a second the last parts take a millisecond.
        assert_eq!([sizes(4e-6), sizes(0.0)], [[250; 4], [250; 4]]);
        let long = sizes(1e-3);
        assert_eq!((long[0], long.len() > 16, *long.last().unwrap()), (125, true, 3));
    }
}
