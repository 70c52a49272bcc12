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
    fn entry_rounded_to_zero_loses_its_transmittance() {
        let (all, half) = (Row::TOTAL, Row::TOTAL / 2);
        let entry = |element, share| Entry { element, share };
        let passed = vec![[0; 3], [half; 3], [all; 3], [half; 3]];
        let mut row = Row {
            entries: vec![entry(1, 3 << 20), entry(5, 1 << 20)],
            backface: all - (4 << 20),
            passed: passed.clone(),
            ..Row::default()
        };
        row.set_factors(&[0.0, 0.25, 0.0, 0.75]);
        assert_eq!((row.entries.len(), &row.passed[..]), (1, &passed[1..]));
    }
}
