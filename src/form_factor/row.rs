//! A row of the form-factor matrix: where the light of one patch goes, sparse and exact.
//!
//! Shares are whole numbers that sum to [`Row::TOTAL`], what is lost included:
//!
//! ```text
//! Σ entries' shares + escaped + backface = 2³² − 1
//! ```
//!
//! So a row neither loses nor makes light, its sum does not depend on the order, and a solve along
//! it conserves energy whatever the errors of the single shares are.

use crate::error::{Error, ErrorKind};
use crate::geometry::rounding::Apportion;
use crate::mesh::{Mesh, NodeId};

/// Where light that leaves one patch goes: the row F_i· of the form-factor matrix, sparse.
///
/// F_ij is the fraction of the flux leaving patch i that arrives at the front of element j. Shares
/// are whole numbers in units of 1/[`Row::TOTAL`], so that they add up exactly, in any order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Row {
    /// Elements that receive, by ascending index, each with its share.
    pub entries: Vec<Entry>,
    /// Share that meets nothing and leaves the scene.
    pub escaped: u32,
    /// Share that meets the back of a surface and is lost there.
    pub backface: u32,
}

/// One nonzero of a [`Row`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Receiving element.
    pub element: u32,
    /// Form factor in units of 1/[`Row::TOTAL`].
    pub share: u32,
}

impl Row {
    /// The share that is all of the light: F = 1.
    pub const TOTAL: u32 = u32::MAX;

    /// The form factor, in [0, 1], that `share` stands for.
    pub fn form_factor(share: u32) -> f64 {
        f64::from(share) / f64::from(Row::TOTAL)
    }

    /// Sum of all shares over [`Row::TOTAL`]: 1 for a row that neither loses nor makes light.
    pub fn closure(&self) -> f64 {
        self.sum() as f64 / f64::from(Row::TOTAL)
    }

    pub(crate) fn sum(&self) -> u64 {
        let entries: u64 = self.entries.iter().map(|e| u64::from(e.share)).sum();
        entries + u64::from(self.escaped) + u64::from(self.backface)
    }

    /// Bytes that keeping this row takes.
    pub fn bytes(&self) -> usize {
        size_of::<Row>() + self.entries.len() * size_of::<Entry>()
    }

    /// Sets the shares of the entries, then `escaped` and `backface`, to these form factors, which
    /// sum to 1 but for rounding; rounded by their running sum, so that the shares sum to
    /// [`Row::TOTAL`]. Entries that round to 0 are removed.
    pub(crate) fn set_factors(&mut self, factors: &[f64]) {
        let mut sum = 0.0;
        let mut shares = Apportion::default();
        let slots = self.entries.iter_mut().map(|e| &mut e.share);
        for (slot, factor) in slots.chain([&mut self.escaped, &mut self.backface]).zip(factors) {
            sum += factor;
            *slot = shares.part_up_to((sum * f64::from(Row::TOTAL)).round() as u32);
        }
        // The largest slot can take what rounding of the sum has left.
        let slots = self.entries.iter_mut().map(|e| &mut e.share);
        let largest = slots.chain([&mut self.escaped, &mut self.backface]).max_by_key(|s| **s);
        if let Some(share) = largest {
            *share += shares.remainder(Row::TOTAL);
        }
        self.entries.retain(|e| e.share > 0);
    }

    /// The mean of `rows`, each of which sums to [`Row::TOTAL`]: so does the mean, exactly, and
    /// every share of it is off by less than one unit. The mean of no rows is an empty row.
    pub(crate) fn mean(rows: &[&Row]) -> Row {
        let count = rows.len().max(1) as u64;
        let mut entries: Vec<Entry> = rows.iter().flat_map(|r| r.entries.iter().copied()).collect();
        // The rows are in order already: a stable sort merges them.
        entries.sort_by_key(|e| e.element);
        let mut sum = 0;
        let mut means = Apportion::default();
        let mut mean_of = |shares: &mut dyn Iterator<Item = u32>| {
            sum += shares.map(u64::from).sum::<u64>();
            means.part_up_to((sum / count) as u32)
        };
        let runs = entries.chunk_by(|a, b| a.element == b.element);
        let mean = |run: &[Entry]| Entry {
            element: run[0].element,
            share: mean_of(&mut run.iter().map(|e| e.share)),
        };
        let entries = runs.map(mean).filter(|e| e.share > 0).collect();
        let escaped = mean_of(&mut rows.iter().map(|r| r.escaped));
        Row { entries, escaped, backface: mean_of(&mut rows.iter().map(|r| r.backface)) }
    }

    /// Checks the contract: shares sum to [`Row::TOTAL`], elements ascend and exist in `mesh`.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`] that names `patch` and what is off.
    pub fn check(&self, mesh: &Mesh, patch: NodeId) -> Result<(), Error> {
        let broken = |found: String, remedy: &str| {
            let place = format!("form-factor row of patch {}", patch.0);
            Err(Error::new(ErrorKind::FormFactor, place, found, remedy))
        };
        if self.sum() != u64::from(Row::TOTAL) {
            let found = format!("shares sum to {} of {}", self.sum(), Row::TOTAL);
            return broken(found, "entries, open and back must add up to Row::TOTAL");
        }
        if self.entries.windows(2).any(|w| w[0].element >= w[1].element) {
            return broken("elements out of order".into(), "they must ascend, each once");
        }
        match self.entries.last() {
            Some(last) if last.element as usize >= mesh.element_count() => broken(
                format!("element {}", last.element),
                &format!("the mesh has {} elements", mesh.element_count()),
            ),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_of_rows_is_exact() {
        let row = |entries: &[(u32, u32)], open: u32| {
            let entries = entries.iter().map(|&(element, share)| Entry { element, share });
            let row = Row { entries: entries.collect(), escaped: open, backface: 0 };
            Row { backface: (u64::from(Row::TOTAL) - row.sum()) as u32, ..row }
        };
        // Remainders of 1, 2 and 3 in four, an entry that is in one row only, one that is lost.
        let rows = [
            row(&[(1, 5), (3, 7), (4, 1)], 9),
            row(&[(1, 4), (7, 1 << 31)], 0),
            row(&[(0, 2), (3, 4)], u32::MAX - 6),
            row(&[(3, 4)], 3),
        ];
        let mean = Row::mean(&rows.each_ref());
        assert_eq!(mean.sum(), u64::from(Row::TOTAL));
        assert!(mean.entries.windows(2).all(|w| w[0].element < w[1].element));
        assert!(mean.entries.iter().all(|e| e.share > 0));
        let share =
            |r: &Row, k: u32| r.entries.iter().find(|e| e.element == k).map_or(0, |e| e.share);
        let near = |got: u32, all: [u32; 4]| {
            let want = all.iter().map(|&s| f64::from(s)).sum::<f64>() / 4.0;
            assert!((f64::from(got) - want).abs() < 1.0, "{got} {want}");
        };
        (0..8).for_each(|k| near(share(&mean, k), rows.each_ref().map(|r| share(r, k))));
        near(mean.escaped, rows.each_ref().map(|r| r.escaped));
        near(mean.backface, rows.each_ref().map(|r| r.backface));
        // Of equal rows, the row.
        assert_eq!(Row::mean(&[&rows[0]; 3]), rows[0]);
    }
}
