//! The matrix itself: areas, factors and their errors, as plain data.
//!
//! Rows emit, columns receive. The factors, the open share and the back share of a row sum to one.

use super::matrix_rows::{MatrixRows, unused};

/// The matrix of area-averaged form factors between the groups of a scene, sparse, with a standard
/// error beside every factor.
///
/// All vectors have one entry per row. The rows are the fronts of all groups, in the order of
/// [`Scene::groups`](crate::scene::Scene::groups), then the backs of two-sided ones: what follows
/// calls each of them a group. F_ij is the fraction of the flux leaving group i (the row) that
/// arrives at group j (the column), 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFactors {
    /// Names of the groups, in the order of rows and columns.
    pub names: Vec<String>,
    /// Per row, the row of the front that it is the back of: both are sides of one sheet. `None`
    /// for fronts.
    pub back_of: Vec<Option<u32>>,
    /// Area of each row, length unit squared: of one side.
    pub areas: Vec<f64>,
    /// Per group i, the groups j that it sees, by ascending index.
    pub factors: Vec<Vec<Factor>>,
    /// Fraction of the flux leaving group i that hits nothing. For an exact or a sparse matrix this
    /// is the remainder: in a closed scene, the closure error of the row.
    pub open: Vec<Estimate>,
    /// Fraction of the flux leaving group i that hits the back of a surface.
    pub back: Vec<Estimate>,
    /// Meaning of a pair that is not in `factors`.
    pub absent: Missing,
}

/// Meaning of an absent factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The factor is zero: one is behind the other, or occluded entirely.
    Zero,
    /// No ray from either has hit the other; the factor is below the requested error, with few
    /// exceptions.
    Unmet,
}

/// Predicted size of a matrix, by [`ViewFactors::predicted_size`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatrixSize {
    /// Factors above zero.
    pub factors: usize,
    /// Memory for computing it, beyond the scene, bytes.
    pub bytes: usize,
}

/// A nonzero entry of a matrix of view factors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factor {
    /// Index of the group that receives.
    pub to: u32,
    /// The factor, 0 to 1.
    pub value: f64,
    /// Standard error of the value.
    pub error: f64,
}

/// A value and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    /// The sum of independent estimates: squares of errors add up.
    pub(super) fn sum(terms: impl IntoIterator<Item = Estimate>) -> Estimate {
        let (mut value, mut squares) = (0.0, 0.0);
        for term in terms {
            value += term.value;
            squares += term.error.powi(2);
        }
        Estimate { value, error: squares.sqrt() }
    }

    /// Both multiplied by `factor`.
    pub(super) fn times(self, factor: f64) -> Estimate {
        Estimate { value: factor * self.value, error: factor * self.error }
    }

    /// Both divided by `area`; zero if that is zero: a group without area neither emits nor
    /// receives.
    pub(super) fn over(self, area: f64) -> Estimate {
        if area == 0.0 {
            return Estimate::default();
        }
        Estimate { value: self.value / area, error: self.error / area }
    }
}

impl ViewFactors {
    /// Names and sides of the rows.
    pub fn rows(&self) -> MatrixRows {
        MatrixRows { names: self.names.clone(), back_of: self.back_of.clone() }
    }

    /// The name of a column of a table that is no group, such as `open`: in parentheses where a
    /// group has this name, so that no two columns are called the same.
    pub fn column_name(&self, name: &str) -> String {
        unused(name.into(), |name| self.names.iter().any(|group| group == name))
    }

    /// The factor from group `i` to group `j`; zero where absent.
    ///
    /// # Panics
    /// When there is no group `i`.
    pub fn factor(&self, i: usize, j: usize) -> Estimate {
        let row = &self.factors[i];
        match row.binary_search_by_key(&j, |f| f.to as usize) {
            Ok(k) => Estimate { value: row[k].value, error: row[k].error },
            Err(_) => Estimate::default(),
        }
    }
}
