//! Work lists distributed over all processes and the threads of each.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::ranks::{Ranks, Share, decoded, encoded, in_order};

/// The results of `work` for all `items`, in their order.
///
/// Items are assigned round-robin: neighbours take about the same time, so that the load is
/// balanced.
pub(super) fn share_out<T: Sync, R: Send + Serialize + DeserializeOwned>(
    items: &[T],
    ranks: &mut dyn Ranks,
    work: impl Fn(&T) -> R + Sync,
) -> Vec<R> {
    if ranks.size() == 1 {
        return items.par_iter().map(&work).collect();
    }
    let own: Vec<&T> = Share::of(ranks).from(items).collect();
    let results: Vec<R> = own.into_par_iter().map(&work).collect();
    let bytes = encoded(&results);
    drop(results);
    let of_ranks = ranks.all_gather(&bytes);
    in_order(of_ranks.into_iter().map(|bytes| decoded(&bytes)).collect(), items.len())
}
