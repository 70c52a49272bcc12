//! Spacing of points and distance from walls: EN 12464-1.

use crate::error::{Error, ErrorKind};

/// Layout of a grid. Lengths are in metres, as in the standard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSettings {
    /// Length of a metre in the scene's unit: 1000 where that is a millimetre.
    pub metre: f64,
    /// Width of the strip left out along the edges, m. EN 12464-1: 0.5 along walls, none where the
    /// task reaches to the edge.
    pub strip: f64,
    /// Largest edge of a cell, m; by EN 12464-1 if `None`.
    pub spacing: Option<f64>,
}

impl Default for GridSettings {
    /// Metres, the standard's spacing, and its strip along walls.
    fn default() -> GridSettings {
        GridSettings { metre: 1.0, strip: 0.5, spacing: None }
    }
}

impl GridSettings {
    /// Points along the two edges of a plane, given their lengths in the scene's unit: the least
    /// odd numbers for which no cell is longer than
    ///
    /// ```text
    /// p = 0.2 · 5^(log10 d) m,  at most 10 m                       (EN 12464-1:2011, 4.4)
    /// ```
    ///
    /// or the spacing set instead. d is the longer edge in metres, or the shorter one where the
    /// other is at least twice as long. Odd numbers have a point in the middle.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for settings out of range, or more than a million points.
    pub fn counts(&self, edges: [f64; 2]) -> Result<[usize; 2], Error> {
        let [a, b] = edges.map(|edge| edge / self.metre);
        self.checked()?;
        let (long, short) = (a.max(b), a.min(b));
        // EN 12464-1:2011, 4.4.
        let d = if long >= 2.0 * short { short } else { long };
        let by_norm = (0.2 * libm::pow(5f64, libm::log10(d))).min(10.0);
        let p = self.spacing.unwrap_or(by_norm);
        // The next odd number; 1e-9 keeps rounding of a whole number of cells from adding one.
        let counts = [a, b].map(|edge| (edge / p * (1.0 - 1e-9) / 2.0 - 0.5).ceil() * 2.0 + 1.0);
        let counts = counts.map(|n| n.max(1.0));
        if counts[0] * counts[1] <= 1e6 {
            return Ok(counts.map(|n| n as usize));
        }
        let found = format!("a plane of {a} m by {b} m with {p} m between its points");
        let remedy = "give a larger spacing, or the metre as it is in the scene's unit";
        Err(Error::new(ErrorKind::Setting, "measuring grid", found, remedy))
    }

    /// The strip in the scene's unit.
    pub(super) fn strip_in_scene(&self) -> Result<f64, Error> {
        self.checked().map(|settings| settings.strip * settings.metre)
    }

    /// The same settings, if they are in range.
    pub(super) fn checked(&self) -> Result<&GridSettings, Error> {
        let is_length = |x: f64| x.is_finite() && x > 0.0;
        let checks = [
            ("length of a metre", self.metre, is_length(self.metre)),
            ("strip", self.strip, self.strip == 0.0 || is_length(self.strip)),
            ("spacing", self.spacing.unwrap_or(1.0), is_length(self.spacing.unwrap_or(1.0))),
        ];
        match checks.iter().find(|check| !check.2) {
            None => Ok(self),
            Some((name, value, _)) => {
                let place = format!("{name} of a measuring grid");
                let remedy = "give a finite length above 0";
                Err(Error::new(ErrorKind::Setting, place, value.to_string(), remedy))
            }
        }
    }
}
