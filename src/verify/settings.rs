//! Settings of a verification.

use std::time::Duration;

use crate::accuracy::Measure;
use crate::error::{Error, ErrorKind};

/// Settings of a verification.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Settings {
    /// The same seed gives the same points and paths.
    pub seed: u64,
    /// Which errors count.
    pub measure: Measure,
    /// The standard error wanted, as a share of the error of the whole scene.
    pub precision: f64,
    /// Points that each group has at least.
    pub points_per_group: usize,
    /// No round is begun that would end later; the first always is.
    pub time: Option<Duration>,
    /// Whether points count that are hidden: see the measure.
    pub hidden: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        let time = Some(Duration::from_secs(120));
        let measure = Measure::default();
        Settings { seed: 0, measure, precision: 0.1, points_per_group: 16, time, hidden: false }
    }
}

impl Settings {
    pub(super) fn check(&self) -> Result<(), Error> {
        let wrong =
            |place, found, remedy| Err(Error::new(ErrorKind::Setting, place, found, remedy));
        if !(self.precision > 0.0 && self.precision <= 1.0) {
            let found = self.precision.to_string();
            return wrong("precision", found, "give a share of the error above 0, and up to 1");
        }
        if !(2..=1 << 20).contains(&self.points_per_group) {
            let found = self.points_per_group.to_string();
            return wrong("points per group", found, "give at least 2, and no more than a million");
        }
        self.measure.check()
    }
}
