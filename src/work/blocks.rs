//! Data that each process has a part of for good: blocks, dealt out in turn.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::batches::map;
use super::team;
use crate::progress::Instant;

/// Whether this process keeps the data of block `k`.
pub(crate) fn is_own(k: usize) -> bool {
    team::borrow().is_none_or(|team| k % team.processes() == team.rank())
}

/// The results of `work` for the numbers below `count`, in their order, each by the process that
/// keeps the data of that block.
#[track_caller]
pub(crate) fn map_blocks<R: Send + Serialize + DeserializeOwned>(
    count: usize,
    work: impl Fn(usize) -> R + Sync,
) -> Vec<R> {
    let Some(mut team) = team::borrow().filter(|team| team.processes() > 1) else {
        return map(count, work);
    };
    let processes = team.processes();
    let start = Instant::now();
    let own: Vec<usize> = (team.rank()..count).step_by(processes).collect();
    let own: Vec<R> = own.into_par_iter().map(&work).collect();
    let mut of_all: Vec<_> =
        team.exchange(start.elapsed(), &own).1.into_iter().map(Vec::into_iter).collect();
    (0..count).filter_map(|k| of_all[k % processes].next()).collect()
}
