//! How long a run would take on many processes, by its recorded costs.
//!
//! ```text
//! process 0  ── own ──┤ part 0 │ part 3 ├ waits ┤ exchange ├ decodes all ├── own ── …
//! process 1  ── own ──┤ part 1 │ part 2 │ part 4┤ exchange ├ decodes all ├── own ── …
//! ```
//!
//! Batches and their parts are made by the code that shares them out in a real run. An exchange
//! takes two collective operations, of lengths and of contents: the latency of each is that of
//! ⌈log₂ N⌉ messages, and every process receives the bytes of all others (Thakur, Rabenseifner,
//! Gropp 2005, table 1, recursive doubling). Numbers of parts come from process 0, one after the
//! other.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use super::batches::{adapted, batch_len};
use super::costs::{Batch, Costs, Event};
use super::team::parts;

/// Processes, what connects them, and what they run on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// Processes, ≥ 1, each with as many threads as the one that recorded the costs.
    pub processes: usize,
    /// Seconds from process to process.
    pub latency: f64,
    /// Bytes that a process receives in a second.
    pub bandwidth: f64,
    /// Processes that run at once; others wait. None: all.
    pub at_once: Option<usize>,
}

/// Where the time of a simulated run goes, in seconds. The parts add up to all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SimulatedTime {
    /// Shared work, mean of a process.
    pub shared: f64,
    /// Work that each process does, as reading the scene.
    pub own: f64,
    /// Waiting for the slowest process, and for numbers of parts; mean of a process.
    pub waiting: f64,
    /// Exchanging results, with making them into bytes and back.
    pub exchange: f64,
}

impl SimulatedTime {
    /// All of it.
    pub fn total(&self) -> f64 {
        self.shared + self.own + self.waiting + self.exchange
    }
}

/// How long process 0 takes to answer one request for a part, in nanoseconds. Measured: matched
/// probe, receive and send, Open MPI 4.1.4, two processes of one machine, 10⁵ requests.
const ANSWER: f64 = 400.0;

/// Where no request waits, process 0 looks for the next one after pauses that double, up to one
/// millisecond: the last one is about half of the time without a request, and half of it is waited
/// in the mean.
const LONGEST_PAUSE: f64 = 1e6;

/// Nanoseconds of a second.
const SECOND: f64 = 1e9;

/// A loop or the part of one that nothing interrupts: its batches have other ends with other
/// numbers of processes.
struct Loop<'c> {
    first: &'c Batch,
    /// Number of items up to and with each timed task, and the time.
    ends: Vec<(u64, f64)>,
    /// Own work, bytes, encoding and decoding of all items.
    own: f64,
    bytes: f64,
    encoding: f64,
    decoding: f64,
    /// Exchanges between batches, and their bytes.
    exchanges: Vec<u64>,
    batches: f64,
}

impl Costs {
    /// The time that the run would take on `cluster`, of a scene `times` as large: with as many
    /// times the items in each loop, and as much work that is not shared.
    pub fn simulate(&self, cluster: &Cluster, times: usize) -> SimulatedTime {
        let processes = cluster.processes.max(1);
        let slowdown = cluster
            .at_once
            .map_or(1.0, |at_once| (processes as f64 / at_once.max(1) as f64).max(1.0));
        let mut run = Run {
            cluster,
            processes,
            slowdown,
            times: times.max(1) as f64,
            sizes: HashMap::new(),
            time: SimulatedTime::default(),
        };
        let mut events = &self.events[..];
        while let Some((event, rest)) = events.split_first() {
            events = rest;
            match event {
                Event::Own(own) => run.own(*own as f64),
                Event::Exchange(bytes) => run.exchange(*bytes as f64 * processes as f64),
                Event::Shared(batch) => {
                    let mut list = Loop::new(batch);
                    list.extend(&mut events);
                    run.share_out(&list);
                }
            }
        }
        let SimulatedTime { shared, own, waiting, exchange } = run.time;
        SimulatedTime {
            shared: shared / SECOND,
            own: own / SECOND,
            waiting: waiting / SECOND,
            exchange: exchange / SECOND,
        }
    }
}

impl<'c> Loop<'c> {
    fn new(first: &'c Batch) -> Loop<'c> {
        let mut new = Loop {
            first,
            ends: vec![(0, 0.0)],
            own: 0.0,
            bytes: 0.0,
            encoding: 0.0,
            decoding: 0.0,
            exchanges: vec![],
            batches: 0.0,
        };
        new.add(first);
        new
    }

    fn count(&self) -> u64 {
        self.ends.last().map_or(0, |(count, _)| *count)
    }

    fn add(&mut self, batch: &Batch) {
        for &(items, time) in &batch.tasks {
            let (count, end) = *self.ends.last().expect("it has the start");
            self.ends.push((count + items, end + time as f64));
        }
        self.bytes += batch.bytes as f64;
        self.encoding += batch.encoding as f64;
        self.decoding += batch.decoding as f64;
        self.batches += 1.0;
    }

    /// Takes off the front of `events` what continues this loop.
    fn extend(&mut self, events: &mut &'c [Event]) {
        loop {
            let is_shared = |event: &Event| matches!(event, Event::Shared(_));
            let Some(next) = events.iter().position(is_shared) else { return };
            let Event::Shared(batch) = &events[next] else { return };
            let is_next = batch.of.is_some()
                && batch.of == self.first.of
                && batch.remaining + self.count() == self.first.remaining;
            if !is_next {
                return;
            }
            for event in &events[..next] {
                match event {
                    Event::Own(own) => self.own += *own as f64,
                    Event::Exchange(bytes) => self.exchanges.push(*bytes),
                    Event::Shared(_) => {}
                }
            }
            self.add(batch);
            *events = &events[next + 1..];
        }
    }

    /// Time of the items before number `k`.
    fn time_before(&self, k: u64) -> f64 {
        let all = *self.ends.last().expect("it has the start");
        // As many times as the scene is larger.
        let (rounds, k) = (k / all.0.max(1), k % all.0.max(1));
        let next = self.ends.partition_point(|(count, _)| *count <= k).min(self.ends.len() - 1);
        let ((start, before), (end, after)) = (self.ends[next - 1], self.ends[next]);
        let share = (k - start) as f64 / (end - start) as f64;
        rounds as f64 * all.1 + before + share * (after - before)
    }
}

struct Run<'c> {
    cluster: &'c Cluster,
    processes: usize,
    slowdown: f64,
    times: f64,
    /// Items that a process wants in a batch of each loop.
    sizes: HashMap<u64, usize>,
    /// In nanoseconds.
    time: SimulatedTime,
}

impl Run<'_> {
    fn own(&mut self, own: f64) {
        self.time.own += own * self.slowdown * self.times;
    }

    /// All processes exchange as many bytes together.
    fn exchange(&mut self, bytes: f64) {
        if self.processes == 1 {
            return;
        }
        let messages = 2.0 * f64::from(self.processes.next_power_of_two().trailing_zeros());
        let others = 1.0 - 1.0 / self.processes as f64;
        let transfer = bytes * others / self.cluster.bandwidth;
        self.time.exchange += (messages * self.cluster.latency + transfer) * SECOND;
    }

    fn share_out(&mut self, list: &Loop) {
        let count = (list.count() as f64 * self.times) as usize;
        let per_item = self.times / count.max(1) as f64;
        let mut size = match list.first.of {
            Some(number) => *self.sizes.entry(number).or_insert((list.first.size as usize).max(1)),
            None => count,
        };
        let least = (list.first.least as usize).max(1);
        let mut done = 0;
        while done < count {
            let batch = match list.first.of {
                Some(_) => batch_len(size, self.processes, count - done),
                None => count,
            };
            let (end, busy) = self.batch(list, done..done + batch);
            self.time.shared += busy;
            self.time.waiting += end - busy;
            let share = batch as f64 * per_item;
            if self.processes > 1 {
                let of_process = list.encoding * share / self.processes as f64;
                self.time.exchange += (of_process + list.decoding * share) * self.slowdown;
                self.exchange(list.bytes * share);
                // Whether to go on.
                let own = list.exchanges.len() as f64 / list.batches;
                let bytes = list.exchanges.iter().sum::<u64>() as f64 / list.batches;
                if own > 0.0 {
                    self.exchange(bytes * self.processes as f64);
                }
            }
            self.own(list.own * batch as f64 / count as f64);
            let busy = std::time::Duration::from_nanos(busy as u64);
            size = adapted(size, least, busy, self.processes, batch);
            done += batch;
        }
        if let Some(number) = list.first.of {
            self.sizes.insert(number, size);
        }
    }

    /// When the last process has done its parts of these items, and the mean time of their work.
    fn batch(&self, list: &Loop, items: std::ops::Range<usize>) -> (f64, f64) {
        let cost = |part: &std::ops::Range<usize>| {
            let at = |k: usize| list.time_before((items.start + k) as u64);
            (at(part.end) - at(part.start)) * self.slowdown
        };
        if self.processes == 1 {
            let all = cost(&(0..items.len()));
            return (all, all);
        }
        let least = (list.first.least as usize).div_ceil(self.processes);
        // The processes have measured it in batches before.
        let item = list.time_before(list.count()) / list.count().max(1) as f64 * self.slowdown;
        let parts = parts(items.len(), self.processes, least, Some(item / SECOND));
        let mut busy = 0.0;
        // A process asks for the next part when it begins one, and has the number when that is
        // done, or later.
        let message = self.cluster.latency * SECOND;
        let mut answers = 0.0f64;
        let mut ask = |at: f64, process: usize| {
            if process == 0 {
                return at;
            }
            let arrival = at + message;
            let idle = (arrival - answers).max(0.0);
            answers = answers.max(arrival) + (idle / 4.0).min(LONGEST_PAUSE / 2.0) + ANSWER;
            answers + message
        };
        let is_asked = parts.len() > self.processes;
        let mut next = parts.iter();
        // Times in whole nanoseconds, so that they have an order.
        let mut free: BinaryHeap<Reverse<(u64, usize)>> = BinaryHeap::new();
        for (process, part) in (0..self.processes).zip(next.by_ref()) {
            let time = cost(part);
            busy += time;
            let answer = if is_asked { ask(0.0, process) } else { 0.0 };
            free.push(Reverse((time.max(answer) as u64, process)));
        }
        for part in next {
            let Some(Reverse((start, process))) = free.pop() else { break };
            let (start, time) = (start as f64, cost(part));
            busy += time;
            free.push(Reverse(((start + time).max(ask(start, process)) as u64, process)));
        }
        // The last number says that there is nothing left.
        let last = free.into_iter().map(|Reverse((end, _))| end).max().unwrap_or(0);
        (last as f64, busy / self.processes as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A network that costs nothing.
    fn cluster(processes: usize) -> Cluster {
        Cluster { processes, latency: 0.0, bandwidth: f64::INFINITY, at_once: None }
    }

    /// Items of a millisecond each, in one batch, between own work of as many milliseconds.
    fn costs(own: u64, items: u64, bytes: u64) -> Costs {
        let millisecond = 1_000_000;
        let batch = Batch {
            size: items,
            least: 1,
            remaining: items,
            tasks: vec![(1, millisecond); items as usize],
            bytes,
            ..Batch::default()
        };
        let own = Event::Own(own * millisecond);
        Costs { threads: 1, events: vec![own.clone(), Event::Shared(batch), own] }
    }

    #[test]
    fn one_process_takes_the_time_that_was_recorded() {
        let time = costs(100, 500, 0).simulate(&cluster(1), 1);
        let expected = SimulatedTime { own: 0.2, shared: 0.5, ..SimulatedTime::default() };
        assert!((time.total() - expected.total()).abs() < 1e-12, "{time:?}");
        assert_eq!(time, expected);
    }

    #[test]
    fn shared_work_is_divided_and_own_work_is_not() {
        let costs = costs(100, 4096, 0);
        for processes in [2, 4, 16, 64] {
            let time = costs.simulate(&cluster(processes), 1);
            assert_eq!(time.own, 0.2);
            let ideal = 4.096 / processes as f64;
            assert!((time.shared / ideal - 1.0).abs() < 1e-9, "{time:?}");
            // The last process ends a part after the mean, at most: of as many milliseconds as an
            // even share has items, over 64, and the answer that there is no more takes less than
            // one.
            let part = (ideal / 64.0).max(1e-3);
            assert!(time.waiting < part + 1e-3, "{processes}: {time:?}");
        }
    }

    #[test]
    fn item_that_takes_longest_ends_last() {
        let mut costs = costs(0, 64, 0);
        let Event::Shared(batch) = &mut costs.events[1] else { unreachable!() };
        batch.tasks[63].1 = 1_000_000_000;
        let time = costs.simulate(&cluster(64), 1);
        assert!((time.total() - 1.0).abs() < 2e-3, "{time:?}");
        assert!(time.waiting > 0.98, "{time:?}");
    }

    #[test]
    fn exchange_takes_latency_and_bandwidth() {
        let network = Cluster { latency: 1e-3, bandwidth: 1e6, ..cluster(4) };
        // Lengths and contents, two messages each; 3 of 4 parts of 2 MB are those of others.
        let time = costs(0, 64, 2_000_000).simulate(&network, 1);
        assert!((time.exchange - (4.0 * 1e-3 + 1.5)).abs() < 1e-9, "{time:?}");
    }

    #[test]
    fn batches_of_a_loop_are_one_list() {
        // Three batches of 10 items with own work and an exchange between them.
        let batch = |remaining| {
            let tasks = vec![(10, 10_000_000)];
            let batch =
                Batch { of: Some(1), size: 10, least: 1, remaining, tasks, ..Batch::default() };
            Event::Shared(batch)
        };
        let between = [Event::Own(1_000_000), Event::Exchange(8)];
        let mut events = vec![batch(30)];
        for remaining in [20, 10] {
            events.extend(between.clone());
            events.push(batch(remaining));
        }
        let costs = Costs { threads: 1, events };
        let time = costs.simulate(&cluster(2), 1);
        assert!((time.shared - 0.015).abs() < 1e-9, "{time:?}");
        assert!((time.own - 0.002).abs() < 1e-9, "{time:?}");
        // Of a scene that is ten times as large.
        let time = costs.simulate(&cluster(1), 10);
        assert!((time.shared - 0.3).abs() < 1e-9 && (time.own - 0.02).abs() < 1e-9, "{time:?}");
    }
}
