//! The costs of a run: of each task of its long loops, and the size of each exchange between
//! processes.
//!
//! They are recorded in one process, and tell by [`Costs::simulate`] how long the same run would
//! take on many.

use std::time::Duration;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::ranks::bytes_of;
use crate::progress::Instant;

/// Tasks are timed together until they take as long: reading the clock costs a thousandth of that,
/// and 4 096 processes that share a loop of some seconds have as much to do each. Plain choice.
const TIMED_TOGETHER: Duration = Duration::from_millis(1);

/// What a run did, with durations in nanoseconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Costs {
    /// Threads of the process.
    pub threads: usize,
    pub(super) events: Vec<Event>,
}

/// What a process does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) enum Event {
    /// Work that is not shared, for as long: every process does it.
    Own(u64),
    /// All processes exchange as many bytes each.
    Exchange(u64),
    Shared(Batch),
}

/// A batch that is shared out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Batch {
    /// Number of the loop; none where all items are one batch.
    pub of: Option<u64>,
    /// Items that a process wants in a batch.
    pub size: u64,
    /// Items of a part, at least.
    pub least: u64,
    /// Items of the loop that were left, with these.
    pub remaining: u64,
    /// Numbers of consecutive items, and how long these took together.
    pub tasks: Vec<(u64, u64)>,
    /// Bytes of all results, and the time to make them into bytes, and results of these.
    pub bytes: u64,
    pub encoding: u64,
    pub decoding: u64,
}

/// Records the costs of the work of this process.
#[derive(Debug)]
pub(super) struct Recorder {
    costs: Costs,
    /// End of the last event.
    since: Instant,
}

impl Recorder {
    pub fn new() -> Recorder {
        let costs = Costs { threads: rayon::current_num_threads(), events: vec![] };
        Recorder { costs, since: Instant::now() }
    }

    /// Records what was done since the last event.
    fn own(&mut self) {
        let own = nanoseconds(self.since.elapsed());
        match self.costs.events.last_mut() {
            Some(Event::Own(before)) => *before += own,
            _ => self.costs.events.push(Event::Own(own)),
        }
    }

    pub fn exchange(&mut self, bytes: usize) {
        self.own();
        self.costs.events.push(Event::Exchange(bytes as u64));
        self.since = Instant::now();
    }

    /// The results of `work` for the items of a batch, and their costs: `batch` without them.
    pub fn batch<R: Serialize + DeserializeOwned, E>(
        &mut self,
        mut batch: Batch,
        count: usize,
        work: &mut dyn FnMut(std::ops::Range<usize>) -> Result<Vec<R>, E>,
    ) -> Result<Vec<R>, E> {
        self.own();
        let least = (batch.least as usize).max(1);
        let (mut results, mut together) = (Vec::with_capacity(count), least);
        while results.len() < count {
            let part = results.len()..count.min(results.len() + together);
            let start = Instant::now();
            let items = part.len() as u64;
            results.extend(work(part)?);
            let duration = start.elapsed();
            batch.tasks.push((items, nanoseconds(duration)));
            if duration < TIMED_TOGETHER {
                together *= 2;
            } else {
                together = (together / 2).max(least);
            }
        }
        let start = Instant::now();
        let bytes = bytes_of(&results);
        batch.encoding = nanoseconds(start.elapsed());
        batch.bytes = bytes.len() as u64;
        let start = Instant::now();
        let decoded: Result<Vec<R>, _> = postcard::from_bytes(&bytes);
        batch.decoding = nanoseconds(start.elapsed());
        drop((decoded, bytes));
        self.costs.events.push(Event::Shared(batch));
        self.since = Instant::now();
        Ok(results)
    }

    pub fn finish(mut self) -> Costs {
        self.own();
        self.costs
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    duration.as_nanos() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_item_is_recorded_once() {
        let mut recorder = Recorder::new();
        for (count, least) in [(1000, 1), (5, 8), (100, 7)] {
            let batch = Batch { least, remaining: count, ..Batch::default() };
            let work = &mut |part: std::ops::Range<usize>| Ok::<_, ()>(part.collect());
            let results: Vec<usize> = recorder.batch(batch, count as usize, work).unwrap();
            assert!(results.into_iter().eq(0..count as usize));
            let Some(Event::Shared(batch)) = recorder.costs.events.last() else { unreachable!() };
            assert_eq!(batch.tasks.iter().map(|(items, _)| items).sum::<u64>(), count);
            // Whatever follows is work of its own; all tasks but the last have as many at least.
            let whole = &batch.tasks[..batch.tasks.len() - 1];
            assert!(whole.iter().all(|(items, _)| *items >= least));
            assert!(batch.bytes >= count);
        }
        recorder.exchange(12);
        let costs = recorder.finish();
        let kinds = costs.events.iter().map(|event| match event {
            Event::Own(_) => 'o',
            Event::Exchange(12) => 'e',
            Event::Exchange(_) => '?',
            Event::Shared(_) => 's',
        });
        assert_eq!(kinds.collect::<String>(), "osososoeo");
    }
}
