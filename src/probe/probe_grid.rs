//! A regular grid of probes in a box.

use glam::DVec3;

use crate::error::{Error, ErrorKind};
use crate::scene::Aabb;

/// Probes in the middles of the cells of a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeGrid {
    /// Lowest corner of the box, scene unit.
    pub low: DVec3,
    /// Edges of a cell, scene unit.
    pub spacing: DVec3,
    /// Cells along x, y and z.
    pub counts: [usize; 3],
}

impl ProbeGrid {
    /// A grid with `counts` cells along x, y and z of `bounds`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for no cells, or more than four million, or a box that is not finite.
    pub fn with_counts(bounds: &Aabb, counts: [usize; 3]) -> Result<ProbeGrid, Error> {
        let product: f64 = counts.iter().map(|&n| n as f64).product();
        let size = bounds.size();
        let [a, b, c] = counts;
        let wrong = |found: String, remedy| {
            Err(Error::new(ErrorKind::Setting, "grid of probes", found, remedy))
        };
        if !(bounds.low.is_finite() && size.is_finite() && size.min_element() >= 0.0) {
            return wrong(
                format!("a box from {} to {}", bounds.low, bounds.high),
                "give a finite one",
            );
        }
        // 1 GiB of probes.
        if !(1.0..=4e6).contains(&product) {
            return wrong(format!("{a} by {b} by {c} probes"), "give one to four million");
        }
        let spacing = size / DVec3::from_array(counts.map(|n| n as f64));
        Ok(ProbeGrid { low: bounds.low, spacing, counts })
    }

    /// Cells of about `spacing` (scene unit) in `bounds`.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a spacing that is not above 0; those of
    /// [`ProbeGrid::with_counts`].
    pub fn with_spacing(bounds: &Aabb, spacing: f64) -> Result<ProbeGrid, Error> {
        if !(spacing.is_finite() && spacing > 0.0) {
            let remedy = "give a length above 0";
            return Err(Error::new(
                ErrorKind::Setting,
                "spacing of probes",
                spacing.to_string(),
                remedy,
            ));
        }
        // A count too large for an integer saturates, and is refused as too large.
        let count = |size: f64| (size / spacing).round().max(1.0) as usize;
        ProbeGrid::with_counts(bounds, bounds.size().to_array().map(count))
    }

    /// Positions of the probes: those along x follow one another, then rows along y, then layers
    /// along z.
    pub fn positions(&self) -> Vec<DVec3> {
        let [columns, rows, layers] = self.counts;
        let at = |k: usize| {
            let cell = [k % columns, k / columns % rows, k / columns / rows];
            self.low + self.spacing * DVec3::from_array(cell.map(|n| n as f64 + 0.5))
        };
        (0..columns * rows * layers).map(at).collect()
    }

    /// Width of the region that a probe represents: the shortest edge of a cell that is not flat,
    /// scene unit.
    pub fn size(&self) -> f64 {
        let edges = self.spacing.to_array().into_iter().filter(|edge| *edge > 0.0);
        edges.reduce(f64::min).unwrap_or(1.0)
    }
}
