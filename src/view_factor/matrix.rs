//! The matrix itself: areas, factors and their errors, as plain data.
//!
//! Rows leave, columns receive. A row's factors, its open share and what meets backs sum to one.

/// The matrix of area-averaged form factors between the groups of a scene, sparse, with a standard
/// error beside every factor.
///
/// All vectors have one entry a group, in the order of
/// [`Scene::groups`](crate::scene::Scene::groups). F_ij is the fraction of the flux leaving group i
/// (the row) that arrives at fronts of group j (the column), 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFactors {
    /// Names of the groups, in the order of rows and columns.
    pub names: Vec<String>,
    /// Radiating area of each group, length unit squared; both sides of a two-sided group.
    pub areas: Vec<f64>,
    /// Per group i, the groups j that it sees, by ascending index.
    pub factors: Vec<Vec<Factor>>,
    /// Fraction of the flux leaving group i that meets nothing. Of an exact or a sparse matrix this
    /// is what is left over: in a closed scene, the closure error of the row.
    pub open: Vec<Estimate>,
    /// Fraction of the flux leaving group i that meets the back of a surface.
    pub back: Vec<Estimate>,
    /// What it means that a pair is not in `factors`.
    pub absent: Missing,
}

/// What it means that there is no factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Missing {
    /// The factor is zero: one is behind the other, or all is hidden.
    Zero,
    /// No pixel or ray from one has met the other; the factor may be small.
    NotSeen,
    /// No ray from either has met the other; the factor is below the error asked for, but for few.
    Unmet,
}

/// How large a matrix will be, by [`ViewFactors::predicted_size`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MatrixSize {
    /// Factors above zero.
    pub factors: usize,
    /// Memory that making it takes, beyond the scene.
    pub bytes: usize,
}

/// One nonzero of a matrix of view factors.
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
    /// Both divided by `area`; zero if that is zero: a group without area neither gives nor takes.
    pub(super) fn over(self, area: f64) -> Estimate {
        if area == 0.0 {
            return Estimate::default();
        }
        Estimate { value: self.value / area, error: self.error / area }
    }
}

impl ViewFactors {
    /// The factor from group `i` to group `j`; zero where there is none.
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
