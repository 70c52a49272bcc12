//! Data that each process has a part of for good: blocks, dealt out in turn.

use std::ops::Range;

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::batches::Never;
use super::costs::Batch;
use super::team;
use crate::progress::Instant;

/// Whether this process keeps the data of block `k`.
pub(crate) fn is_own(k: usize) -> bool {
    team::borrow().is_none_or(|team| k % team.processes() == team.rank())
}

/// The results of `work` for the numbers below `count`, in their order, each by the process that
/// keeps the data of that block.
pub(crate) fn map_blocks<R: Send + Serialize + DeserializeOwned>(
    count: usize,
    work: impl Fn(usize) -> R + Sync,
) -> Vec<R> {
    let Some(mut team) = team::borrow().filter(|team| team.is_divided()) else {
        return (0..count).into_par_iter().map(&work).collect();
    };
    let processes = team.processes();
    if let Some(recorder) = team.recorder() {
        let batch = Batch { least: 1, remaining: count as u64, ..Batch::default() };
        let work = &mut |part: Range<usize>| -> Result<Vec<R>, Never> {
            Ok(part.into_par_iter().map(&work).collect())
        };
        let Ok(results) = recorder.batch(batch, count, work);
        return results;
    }
    let start = Instant::now();
    let own: Vec<usize> = (team.rank()..count).step_by(processes).collect();
    let own: Vec<R> = own.into_par_iter().map(&work).collect();
    let mut of_all: Vec<_> =
        team.exchange(start.elapsed(), &own).1.into_iter().map(Vec::into_iter).collect();
    (0..count).filter_map(|k| of_all[k % processes].next()).collect()
}
