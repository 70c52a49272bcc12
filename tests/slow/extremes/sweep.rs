//! What came of a sweep: one quantity over its whole range, against what is known.

use std::fmt;

use radiosity::Solution;

/// A row of the table.
#[derive(Clone, Debug)]
pub struct Sweep {
    pub quantity: &'static str,
    pub range: &'static str,
    /// What it is compared with.
    pub known: &'static str,
    /// Who found it: methods of solvers, or what was asked instead.
    pub by: String,
    pub steps: usize,
    /// Worst relative deviation, and what it may be.
    pub off: f64,
    pub within: f64,
    /// Numbers that were NaN or infinite.
    pub not_finite: usize,
    /// Worst error of the ledger, relative to the emitted flux; none where nothing was solved.
    pub ledger: Option<f64>,
    /// Most steps that a solve took, in the unit of its method.
    pub most: u64,
}

impl Sweep {
    /// Nothing is known yet.
    pub fn new(
        quantity: &'static str,
        range: &'static str,
        known: &'static str,
        within: f64,
    ) -> Sweep {
        let (by, steps, off, not_finite, ledger, most) = (String::new(), 0, 0.0, 0, None, 0);
        Sweep { quantity, range, known, by, steps, off, within, not_finite, ledger, most }
    }

    /// Takes in a step: what was found, and what it should be.
    pub fn step(&mut self, found: &[f64], known: &[f64]) {
        assert_eq!(found.len(), known.len(), "{}: as many numbers as are known", self.quantity);
        self.steps += 1;
        for (a, b) in found.iter().zip(known) {
            self.not_finite += usize::from(!a.is_finite());
            let off = if a == b { 0.0 } else { (a / b - 1.0).abs() };
            self.off = if off.is_nan() { f64::INFINITY } else { self.off.max(off) };
        }
    }

    /// Takes in how a step was solved.
    pub fn solved(&mut self, s: &Solution) {
        let imbalance = s.ledger.imbalance();
        self.ledger = Some(self.ledger.unwrap_or(0.0).max(imbalance));
        self.most = self.most.max(s.steps);
        self.by(&s.method.to_string());
    }

    /// Adds to those who found it.
    pub fn by(&mut self, name: &str) {
        if !self.by.split(", ").any(|known| known == name) {
            self.by += if self.by.is_empty() { "" } else { ", " };
            self.by += name;
        }
    }

    /// Whether all is as it should be.
    pub fn holds(&self) -> bool {
        self.off <= self.within && self.not_finite == 0 && self.ledger.unwrap_or(0.0) <= 1e-9
    }
}

/// As a row of a Markdown table.
impl fmt::Display for Sweep {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let ledger = self.ledger.map_or("–".into(), |ledger| format!("{ledger:.0e}"));
        write!(f, "| {} | {} | {} ", self.quantity, self.range, self.steps)?;
        write!(f, "| {} | {:.0e} | {:.0e} ", self.known, self.off, self.within)?;
        write!(f, "| {} | {ledger} | {}", self.not_finite, self.by)?;
        if self.most > 0 {
            write!(f, ", {} steps at most", self.most)?;
        }
        write!(f, " |")
    }
}
