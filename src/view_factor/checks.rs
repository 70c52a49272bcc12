//! What must hold of a matrix of view factors, measured on raw numbers.

use super::{Missing, ViewFactors};

/// How far a matrix is from what must hold. A good row sum is no proof of good entries: that of a
/// hemicube is perfect while its entries are off.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MatrixChecks {
    /// Row sum + open + back − 1, over rows. The `open` of an exact matrix is not measured but left
    /// over: there it is row sum + back − 1, over the rows that do not leak.
    pub closure: ErrorStats,
    /// (A_i F_ij − A_j F_ji) / min(A_i, A_j), over pairs: an error of the smaller group's factor.
    pub reciprocity: ErrorStats,
    /// By how much a value is below 0 or above 1, or A_i F_ij above A_j, as a share of A_i; over
    /// all factors.
    pub bounds: ErrorStats,
}

/// Size of an error over many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorStats {
    /// Root of the mean square.
    pub rms: f64,
    /// The largest magnitude.
    pub worst: f64,
    /// Row and column of the largest; of a whole row, twice the row.
    pub at: (usize, usize),
}

/// Standard errors that an open share must exceed to be a leak, and rounding.
const SURE: (f64, f64) = (3.0, 1e-9);

impl ErrorStats {
    fn of(errors: impl Iterator<Item = ((usize, usize), f64)>) -> ErrorStats {
        let mut found = ErrorStats::default();
        let mut count = 0.0;
        for (at, error) in errors {
            found.rms += error * error;
            count += 1.0;
            if error.abs() > found.worst {
                (found.worst, found.at) = (error.abs(), at);
            }
        }
        if count > 0.0 {
            found.rms = (found.rms / count).sqrt();
        }
        found
    }
}

impl ViewFactors {
    /// Measures closure, reciprocity and bounds.
    pub fn checks(&self) -> MatrixChecks {
        let rows = 0..self.areas.len();
        let entries = || rows.clone().flat_map(|i| self.factors[i].iter().map(move |f| (i, f)));
        let exact = self.absent == Missing::Zero;
        let measured = rows.clone().filter(|&i| !exact || self.is_closed(i));
        let closure = measured.map(|i| {
            let sum: f64 = self.factors[i].iter().map(|f| f.value).sum();
            let open = if exact { 0.0 } else { self.open[i].value };
            ((i, i), sum + open + self.back[i].value - 1.0)
        });
        let reciprocity = entries().filter(|(i, f)| *i != f.to as usize).map(|(i, f)| {
            let j = f.to as usize;
            let (a, b) = (self.areas[i], self.areas[j]);
            ((i, j), (a * f.value - b * self.factor(j, i).value) / a.min(b))
        });
        let bounds = entries().map(|(i, f)| {
            let most = (self.areas[f.to as usize] / self.areas[i]).min(1.0);
            ((i, f.to as usize), (f.value - most).max(-f.value).max(0.0))
        });
        MatrixChecks {
            closure: ErrorStats::of(closure),
            reciprocity: ErrorStats::of(reciprocity),
            bounds: ErrorStats::of(bounds),
        }
    }

    /// The groups whose enclosure leaks: more of their flux meets nothing than three standard
    /// errors explain. The leakiest come first.
    pub fn leaks(&self) -> Vec<usize> {
        let mut leaks: Vec<usize> = (0..self.open.len()).filter(|&i| !self.is_closed(i)).collect();
        leaks.sort_by(|&i, &j| self.open[j].value.total_cmp(&self.open[i].value).then(i.cmp(&j)));
        leaks
    }

    /// The groups whose flux arrives more than once, beyond three standard errors: something they see
    /// is there twice, such as a poster in the plane of its wall. The worst come first.
    pub fn overfull(&self) -> Vec<usize> {
        let excess = |i: usize| -self.open[i].value;
        let over = |i: &usize| excess(*i) > SURE.0 * self.open[*i].error + SURE.1;
        let mut overfull: Vec<usize> = (0..self.open.len()).filter(over).collect();
        overfull.sort_by(|&i, &j| excess(j).total_cmp(&excess(i)).then(i.cmp(&j)));
        overfull
    }

    pub(super) fn is_closed(&self, i: usize) -> bool {
        self.open[i].value <= SURE.0 * self.open[i].error + SURE.1
    }
}
