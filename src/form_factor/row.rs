//! A row of the form-factor matrix: the distribution of the light of one patch, sparse and exact.
//!
//! Shares are integers that sum to [`Row::TOTAL`], losses included:
//!
//! ```text
//! Σ entries' shares + escaped + backface = 2³² − 1
//! ```
//!
//! So a row conserves light, its sum does not depend on the order, and a solve with it conserves
//! energy whatever the errors of the single shares are.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorKind};
use crate::geometry::rounding::Apportion;
use crate::mesh::{Mesh, NodeId};
use crate::scene::Rgb;

/// Distribution of the light that leaves one patch: the row F_i· of the form-factor matrix, sparse.
///
/// F_ij is the fraction of the flux leaving patch i that arrives at the front of element j. Shares
/// are integers in units of 1/[`Row::TOTAL`], so that they add up exactly, in any order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// Receiving elements by ascending index, each with its share.
    pub entries: Vec<Entry>,
    /// Share that hits nothing and leaves the scene.
    pub escaped: u32,
    /// Share that hits the back of a surface and is lost there.
    pub backface: u32,
    /// Transmittance of clear panes on the way for each entry, then for `escaped` and for
    /// `backface`, per channel in units of 1/[`Row::TOTAL`]: the mean over the entry's light. The
    /// shares themselves are those without panes. Empty where no light goes through a pane.
    pub passed: Vec<[u32; 3]>,
}

/// A nonzero entry of a [`Row`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Receiving element.
    pub element: u32,
    /// Form factor in units of 1/[`Row::TOTAL`].
    pub share: u32,
}

impl Row {
    /// The share of all of the light: F = 1.
    pub const TOTAL: u32 = u32::MAX;

    /// The form factor, in [0, 1], for `share`.
    pub fn form_factor(share: u32) -> f64 {
        f64::from(share) / f64::from(Row::TOTAL)
    }

    /// Sum of all shares over [`Row::TOTAL`]: 1 for a row that conserves light.
    pub fn closure(&self) -> f64 {
        self.sum() as f64 / f64::from(Row::TOTAL)
    }

    pub(crate) fn sum(&self) -> u64 {
        let entries: u64 = self.entries.iter().map(|e| u64::from(e.share)).sum();
        entries + u64::from(self.escaped) + u64::from(self.backface)
    }

    /// The transmittance per channel, in [0, 1], for `passed`.
    pub(crate) fn transmittance(passed: [u32; 3]) -> Rgb {
        Rgb::from_array(passed.map(Row::form_factor))
    }

    /// The integers for `transmittance` per channel, in [0, 1].
    pub(crate) fn passed(transmittance: Rgb) -> [u32; 3] {
        // Above 1 only by rounding; clamped to 1.
        transmittance.to_array().map(|share| (share * f64::from(Row::TOTAL)).round() as u32)
    }

    /// Memory of this row, bytes.
    pub fn bytes(&self) -> usize {
        let passed = self.passed.len() * size_of::<[u32; 3]>();
        size_of::<Row>() + self.entries.len() * size_of::<Entry>() + passed
    }

    /// Sets the shares of the entries, then `escaped` and `backface`, to these form factors, which
    /// sum to 1 except for rounding; rounded by their running sum, so that the shares sum to
    /// [`Row::TOTAL`]. Entries that round to 0 are removed.
    pub(crate) fn set_factors(&mut self, factors: &[f64]) {
        let mut sum = 0.0;
        let mut shares = Apportion::default();
        let slots = self.entries.iter_mut().map(|e| &mut e.share);
        for (slot, factor) in slots.chain([&mut self.escaped, &mut self.backface]).zip(factors) {
            sum += factor;
            *slot = shares.part_up_to((sum * f64::from(Row::TOTAL)).round() as u32);
        }
        // The largest slot takes the remainder of the rounded sum.
        let slots = self.entries.iter_mut().map(|e| &mut e.share);
        let largest = slots.chain([&mut self.escaped, &mut self.backface]).max_by_key(|s| **s);
        if let Some(share) = largest {
            *share += shares.remainder(Row::TOTAL);
        }
        let mut shares = self.entries.iter().map(|e| e.share);
        // The last two do not belong to entries.
        self.passed.retain(|_| shares.next() != Some(0));
        self.entries.retain(|e| e.share > 0);
    }

    /// The mean of `rows`, each of which sums to [`Row::TOTAL`]: so does the mean, exactly, and the
    /// error of every share is less than one unit. The mean of no rows is an empty row.
    pub(crate) fn mean(rows: &[&Row]) -> Row {
        let count = rows.len().max(1) as u64;
        if rows.iter().any(|row| !row.passed.is_empty()) {
            return Row::mean_through_panes(rows);
        }
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
        let backface = mean_of(&mut rows.iter().map(|r| r.backface));
        Row { entries, escaped, backface, passed: vec![] }
    }

    /// The mean of rows some of which go through panes: transmittances are weighted by shares.
    fn mean_through_panes(rows: &[&Row]) -> Row {
        // By element; escaped and back-face light come last, as in `passed`.
        let (escaped, backface) = (u64::from(u32::MAX) + 1, u64::from(u32::MAX) + 2);
        let mut sums: BTreeMap<u64, (f64, Rgb)> = BTreeMap::new();
        for row in rows {
            let entries = row.entries.iter().map(|e| (u64::from(e.element), e.share));
            let all = entries.chain([(escaped, row.escaped), (backface, row.backface)]);
            for (k, (slot, share)) in all.enumerate() {
                let passed = row.passed.get(k).map_or(Rgb::ONE, |&p| Row::transmittance(p));
                let sum = sums.entry(slot).or_default();
                sum.0 += f64::from(share);
                sum.1 += f64::from(share) * passed;
            }
        }
        let bare: Vec<Row> = rows.iter().map(|&r| Row { passed: vec![], ..r.clone() }).collect();
        let mean = Row::mean(&bare.iter().collect::<Vec<_>>());
        let slots = mean.entries.iter().map(|e| u64::from(e.element)).chain([escaped, backface]);
        let passed = slots.map(|slot| match sums.get(&slot) {
            Some(&(share, passed)) if share > 0.0 => Row::passed(passed / share),
            _ => [Row::TOTAL; 3],
        });
        Row { passed: passed.collect(), ..mean }
    }

    /// Checks the contract: shares sum to [`Row::TOTAL`], elements ascend and exist in `mesh`.
    ///
    /// # Errors
    /// [`ErrorKind::FormFactor`] that names `patch` and the violation.
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
        if !self.passed.is_empty() && self.passed.len() != self.entries.len() + 2 {
            let found =
                format!("{} shares pass of {} entries", self.passed.len(), self.entries.len());
            return broken(found, "give one an entry, then one of what is open and one of backs");
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
            let row = Row { entries: entries.collect(), escaped: open, ..Row::default() };
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
        // The mean of equal rows is the row.
        assert_eq!(Row::mean(&[&rows[0]; 3]), rows[0]);
    }

    #[test]
    fn mean_through_panes_is_weighted_by_shares() {
        let row = |entries: &[(u32, u32)], passed: &[u32]| {
            let entries = entries.iter().map(|&(element, share)| Entry { element, share });
            let row = Row { entries: entries.collect(), ..Row::default() };
            let backface = (u64::from(Row::TOTAL) - row.sum()) as u32;
            Row { backface, passed: passed.iter().map(|&p| [p; 3]).collect(), ..row }
        };
        let (all, half) = (Row::TOTAL, Row::TOTAL / 2);
        // The second has no panes.
        let rows =
            [row(&[(1, 3 << 20), (5, 1 << 20)], &[0, half, all, half]), row(&[(1, 1 << 20)], &[])];
        let mean = Row::mean(&rows.each_ref());
        assert_eq!(mean.sum(), u64::from(Row::TOTAL));
        assert_eq!(mean.entries.iter().map(|e| e.element).collect::<Vec<_>>(), [1, 5]);
        let passed: Vec<f64> = mean.passed.iter().map(|p| Row::transmittance(*p).x).collect();
        // A quarter of the light of element 1 is of the second row; so is about half of that on
        // backs.
        let backs = rows.each_ref().map(|row| f64::from(row.backface));
        let of_backs = (backs[0] / 2.0 + backs[1]) / (backs[0] + backs[1]);
        for (found, want) in passed.iter().zip([0.25, 0.5, 1.0, of_backs]) {
            assert!((found - want).abs() < 1e-9, "{passed:?}");
        }
        // An entry that is rounded to 0 loses its transmittance too.
        let mut row = rows[0].clone();
        row.set_factors(&[0.0, 0.25, 0.0, 0.75]);
        assert_eq!((row.entries.len(), &row.passed[..]), (1, &rows[0].passed[1..]));
    }
}
