//! A list of things to do, shared out between the processes that there are and the threads of each.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::ranks::Ranks;

/// What `work` makes of all `items`, in their order.
///
/// Items are dealt out one by one: neighbours take about as long, so that all have as much to do.
pub(super) fn share_out<T: Sync, R: Send + Serialize + DeserializeOwned>(
    items: &[T],
    ranks: &mut dyn Ranks,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    let size = ranks.size();
    if size == 1 {
        return items.par_iter().map(&work).collect();
    }
    let own: Vec<&T> = items.iter().skip(ranks.rank()).step_by(size).collect();
    let results: Vec<R> = own.into_par_iter().map(&work).collect();
    let bytes = postcard::to_extend(&results, vec![]).expect("a vector takes all bytes");
    drop(results);
    let mut of_ranks = Vec::with_capacity(size);
    for bytes in ranks.all_gather(&bytes) {
        let results: Vec<R> =
            postcard::from_bytes(&bytes).expect("all processes run the same program");
        of_ranks.push(results.into_iter());
    }
    (0..items.len()).filter_map(|k| of_ranks[k % size].next()).collect()
}
