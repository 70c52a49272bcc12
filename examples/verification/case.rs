//! Cases with known answers.

/// A quantity whose value is known, and the value here.
pub struct Case {
    pub name: String,
    /// Where the right value is from.
    pub source: String,
    pub quantity: String,
    pub right: f64,
    pub here: f64,
    /// Largest |here − right| allowed.
    pub band: f64,
}

/// Cases of one kind.
pub struct Section {
    pub title: &'static str,
    /// What the bands follow from.
    pub bands: &'static str,
    pub cases: Vec<Case>,
}

impl Case {
    pub fn deviation(&self) -> f64 {
        self.here - self.right
    }

    /// Not so where the value is not a number.
    pub fn is_passed(&self) -> bool {
        self.deviation().abs() <= self.band
    }
}
