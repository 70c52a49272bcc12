//! How much to do between two calls of progress.

use std::time::{Duration, Instant};

/// As much at once as takes about this long: progress is told several times a second.
const PACE: Duration = Duration::from_millis(250);

/// A number of like things to do at once, which follows the clock. What comes out must not depend on it.
pub(crate) struct BatchSizer(usize);

impl BatchSizer {
    /// Begins with `first` at once.
    pub fn new(first: usize) -> BatchSizer {
        BatchSizer(first)
    }

    /// Takes what is to be done next off `left`, and does it.
    pub fn next<'t, T, R>(&mut self, left: &mut &'t [T], work: impl FnOnce(&'t [T]) -> R) -> R {
        let now;
        (now, *left) = left.split_at(left.len().min(self.0));
        let begun = Instant::now();
        let done = work(now);
        self.0 = match begun.elapsed() {
            t if t > PACE => (self.0 / 2).max(1),
            t if t < PACE / 3 && now.len() == self.0 => self.0 * 2,
            _ => self.0,
        };
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_done_once_and_in_order() {
        let all: Vec<u32> = (0..1000).collect();
        let (mut left, mut pace, mut done) = (&all[..], BatchSizer::new(3), vec![]);
        while !left.is_empty() {
            pace.next(&mut left, |now| done.extend(now.iter().copied()));
        }
        assert_eq!(done, all);
    }
}
