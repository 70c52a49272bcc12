//! A long list of like items, in batches of similar duration.

use std::ops::Range;
use std::panic::Location;
use std::time::Duration;

use rayon::prelude::*;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::costs::Batch;
use super::team::{self, Site};
use crate::progress::Instant;

/// Batches grow or shrink towards this duration, so that progress is reported several times a
/// second; where they are shared with other processes once, since each ends with an exchange.
const BATCH_DURATION: Duration = Duration::from_millis(250);
const SHARED_BATCH_DURATION: Duration = Duration::from_secs(1);

/// Splits lists of like items into batches of similar duration, and has their results computed:
/// here, by other processes, or in an earlier run. Results must not depend on batch ends, which
/// follow the clock.
pub(crate) struct Batches {
    /// Items in the next batch, and in any but the last at least.
    size: usize,
    least: usize,
    /// Number among the loops of the program; none in work that is shared as a whole.
    number: Option<u64>,
    /// Where the loop is in the code.
    site: Site,
    /// Whether results are kept in a journal.
    is_kept: bool,
    /// Items done so far.
    done: u64,
}

/// What cannot go wrong.
#[derive(Debug, Serialize, Deserialize)]
enum Never {}

impl Batches {
    /// The first batch has `first` items.
    #[track_caller]
    pub fn new(first: usize) -> Batches {
        let (number, site) = (team::next_loop(), Location::caller());
        Batches { size: first.max(1), least: 1, number, site, is_kept: true, done: 0 }
    }

    /// As many items at least, all but in the last batch: those that are done at once, each by one
    /// thread.
    pub fn at_least(self, least: usize) -> Batches {
        Batches { size: self.size.max(least), least, ..self }
    }

    /// Results are computed again by a program that resumes: there are so many that a journal would
    /// be larger than they are worth.
    pub fn without_journal(self) -> Batches {
        Batches { is_kept: false, ..self }
    }

    /// Takes the next batch off the front of `remaining`; returns it with its results, one for each
    /// item. `work` is called for parts of the batch, in this process or in others.
    pub fn next<'t, T, R: Sync + Serialize + DeserializeOwned>(
        &mut self,
        remaining: &mut &'t [T],
        mut work: impl FnMut(&'t [T]) -> Vec<R>,
    ) -> (&'t [T], Vec<R>) {
        let Ok(done) = self.try_next(remaining, |part| Ok::<_, Never>(work(part)));
        done
    }

    /// The same for work that may fail.
    ///
    /// # Errors
    /// Those of `work`, in this process or another.
    pub fn try_next<'t, T, R, E>(
        &mut self,
        remaining: &mut &'t [T],
        mut work: impl FnMut(&'t [T]) -> Result<Vec<R>, E>,
    ) -> Result<(&'t [T], Vec<R>), E>
    where
        R: Sync + Serialize + DeserializeOwned,
        E: Serialize + DeserializeOwned,
    {
        let shared = self.number.and_then(|number| Some((number, team::borrow()?)));
        let (count, results) = match shared {
            Some((number, mut team)) => {
                let kept = match self.is_kept {
                    true => team.recorded(number, self.done, remaining.len()),
                    false => None,
                };
                match kept {
                    Some(results) => (results.len(), results),
                    None => {
                        // A process has its own first size.
                        if self.done == 0 {
                            self.size = team.largest(self.size);
                        }
                        let processes = team.processes();
                        let batch = Batch {
                            of: Some(number),
                            size: self.size as u64,
                            least: self.least as u64,
                            remaining: remaining.len() as u64,
                            ..Batch::default()
                        };
                        let count = batch_len(self.size, processes, remaining.len());
                        let work = &mut |part: Range<usize>| work(&remaining[part]);
                        let (results, duration) = team.share_out(self.site, batch, count, work)?;
                        self.size = adapted(self.size, self.least, duration, processes, count);
                        if self.is_kept {
                            team.record(number, self.done, &results);
                        }
                        (count, results)
                    }
                }
            }
            None => {
                let count = batch_len(self.size, 1, remaining.len());
                let start = Instant::now();
                let results = work(&remaining[..count])?;
                self.size = adapted(self.size, self.least, start.elapsed(), 1, count);
                (count, results)
            }
        };
        debug_assert_eq!(count, results.len(), "one result for each item");
        self.done += count as u64;
        let (batch, rest) = remaining.split_at(count);
        *remaining = rest;
        Ok((batch, results))
    }
}

/// Items of the next batch of `remaining` ones, if each of the processes is to have `size`.
pub(super) fn batch_len(size: usize, processes: usize, remaining: usize) -> usize {
    remaining.min(size.saturating_mul(processes))
}

/// The size after a batch of `count` items for which processes took as long: half of it after one
/// that took too long, twice as much after a full one that took less than a third of what is
/// wanted.
pub(super) fn adapted(
    size: usize,
    least: usize,
    duration: Duration,
    processes: usize,
    count: usize,
) -> usize {
    let wanted = if processes == 1 { BATCH_DURATION } else { SHARED_BATCH_DURATION };
    let is_full = count == size.saturating_mul(processes);
    if duration > wanted {
        (size / 2).max(least)
    } else if duration < wanted / 3 && is_full {
        size.saturating_mul(2)
    } else {
        size
    }
}

/// The results of `work` for the numbers below `count`, in their order, by all threads and
/// processes. They are not kept in a journal. Worth it where an item takes longer than to exchange
/// its result: some tens of nanoseconds.
#[track_caller]
pub(crate) fn map<R: Send + Serialize + DeserializeOwned>(
    count: usize,
    work: impl Fn(usize) -> R + Sync,
) -> Vec<R> {
    match team::borrow() {
        Some(mut team) if team.is_divided() => {
            let work = &mut |part: Range<usize>| -> Result<Vec<R>, Never> {
                Ok(part.into_par_iter().map(&work).collect())
            };
            let batch = Batch { least: 1, remaining: count as u64, ..Batch::default() };
            let Ok((results, _)) = team.share_out(Location::caller(), batch, count, work);
            results
        }
        _ => (0..count).into_par_iter().map(&work).collect(),
    }
}

/// A copy is a loop of its own.
impl Clone for Batches {
    fn clone(&self) -> Batches {
        Batches { number: team::next_loop(), done: 0, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::Batches;

    #[test]
    fn batches_cover_all_items_once_in_order() {
        let items: Vec<u32> = (0..1000).collect();
        let (mut remaining, mut done) = (&items[..], vec![]);
        let mut batches = Batches::new(3);
        while !remaining.is_empty() {
            let (batch, results) = batches.next(&mut remaining, <[u32]>::to_vec);
            assert_eq!(batch, results);
            done.extend(results);
        }
        assert_eq!(done, items);
    }
}
