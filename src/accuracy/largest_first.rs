//! Items from the largest down, of which few are wanted.

use std::cmp::Ordering;

use rayon::prelude::*;

/// One of as many items is in the first part that is sorted; each further part is twice as large as
/// the one before. Plain choice.
const FIRST_PART: usize = 32;

/// `items` in `order`, sorted as far as they are taken: n items of which k are taken cost
/// O(n log(k FIRST_PART / n) + k log k), all of them O(n log n).
pub(crate) fn in_order<T: Send>(
    mut items: Vec<T>,
    order: impl Fn(&T, &T) -> Ordering + Sync,
) -> impl Iterator<Item = T> {
    let mut sorted = vec![].into_iter();
    let mut part = items.len().div_ceil(FIRST_PART);
    std::iter::from_fn(move || {
        if sorted.len() == 0 && !items.is_empty() {
            let rest = items.len().saturating_sub(part);
            if rest > 0 {
                items.select_nth_unstable_by(rest, |a, b| order(b, a));
            }
            let mut next = items.split_off(rest);
            next.par_sort_unstable_by(&order);
            part += next.len();
            sorted = next.into_iter();
        }
        sorted.next()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::hash::split_mix64_nth;

    #[test]
    fn items_come_in_order_however_many_are_taken() {
        for count in [0, 1, 2, 31, 32, 33, 1000, 4097] {
            let items: Vec<u64> = (0..count).map(|k| split_mix64_nth(k) % 500).collect();
            let mut all = items.clone();
            all.sort_unstable_by(|a, b| b.cmp(a));
            for taken in [0, 1, 10, count as usize] {
                let first = in_order(items.clone(), |a, b| b.cmp(a)).take(taken);
                assert!(first.eq(all.iter().take(taken).copied()), "{taken} of {count}");
            }
        }
    }
}
