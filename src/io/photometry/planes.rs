//! Half-planes of measured intensities, unfolded by their symmetry.

use crate::error::Error;
use crate::scene::{IntensityDistribution, Pole};

/// Intensities by angle in half-planes, degrees and cd.
#[derive(Debug, Default)]
pub struct Planes {
    /// The angles within each plane, common to all planes.
    pub angles: Vec<f64>,
    /// The angle of each plane, and its intensities.
    pub planes: Vec<(f64, Vec<f64>)>,
}

/// Largest difference of equal angles in files, degrees.
pub const ANGLE_TOLERANCE: f64 = 1e-3;

impl Planes {
    /// Scales intensities by `factor`; negative ones, such as an instrument's noise, become 0.
    pub fn scale(&mut self, factor: f64, warnings: &mut Vec<String>) {
        let mut negative = 0;
        for value in self.planes.iter_mut().flat_map(|(_, values)| values) {
            negative += usize::from(*value < 0.0);
            *value = (*value * factor).max(0.0);
        }
        if negative > 0 {
            warnings.push(format!("{negative} intensities below 0 are taken as 0"));
        }
    }

    /// Sorts planes and the angles in them, and removes duplicates.
    pub fn sort(&mut self, warnings: &mut Vec<String>) {
        let ascend = |angles: &[f64]| angles.windows(2).all(|a| a[0] < a[1]);
        let planes: Vec<f64> = self.planes.iter().map(|plane| plane.0).collect();
        if ascend(&self.angles) && ascend(&planes) {
            return;
        }
        warnings.push("angles that do not ascend are sorted, and repeated ones left out".into());
        let mut order: Vec<usize> = (0..self.angles.len()).collect();
        order.sort_by(|&a, &b| self.angles[a].total_cmp(&self.angles[b]));
        order.dedup_by(|a, b| self.angles[*a] == self.angles[*b]);
        let picked = |values: &[f64]| order.iter().map(|&k| values[k]).collect();
        self.planes.iter_mut().for_each(|(_, values)| *values = picked(values));
        self.angles = picked(&self.angles);
        self.planes.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.planes.dedup_by(|a, b| a.0 == b.0);
    }

    /// The angles of the first and last plane.
    pub fn span(&self) -> Option<[f64; 2]> {
        Some([self.planes.first()?.0, self.planes.last()?.0])
    }

    /// Adds the mirror images of all planes beyond the last, which lies in the mirror.
    pub fn mirror_at_last(&mut self) {
        let Some([_, mirror]) = self.span() else { return };
        let images = self.planes.iter().rev().skip(1);
        let images: Vec<_> = images.map(|(a, values)| (2.0 * mirror - a, values.clone())).collect();
        self.planes.extend(images);
    }

    /// Whether the planes cover a full turn except for one step.
    pub fn can_close(&self) -> bool {
        let widest = self.planes.windows(2).map(|p| p[1].0 - p[0].0).fold(0.0, f64::max);
        let open = self.span().map(|[first, last]| first + 360.0 - last);
        open.is_some_and(|open| open > 0.0 && open <= widest + ANGLE_TOLERANCE)
    }

    /// Adds the first plane once more, a turn further.
    pub fn close(&mut self) {
        if let Some((angle, values)) = self.planes.first().cloned() {
            self.planes.push((angle + 360.0, values));
        }
    }

    /// The same with both angles exchanged: along planes becomes across them.
    pub fn transposed(&self) -> Planes {
        let column = |(k, &angle): (usize, &f64)| {
            (angle, self.planes.iter().map(|(_, values)| values[k]).collect())
        };
        Planes {
            angles: self.planes.iter().map(|plane| plane.0).collect(),
            planes: self.angles.iter().enumerate().map(column).collect(),
        }
    }

    /// The distribution whose azimuths are those of the planes, around `pole`.
    pub fn distribution(self, pole: Pole) -> Result<IntensityDistribution, Error> {
        let azimuths: Vec<f64> = self.planes.iter().map(|plane| plane.0).collect();
        let values = self.planes.into_iter().flat_map(|(_, values)| values).collect();
        Ok(IntensityDistribution::new(&azimuths, &self.angles, values)?.around(pole))
    }
}
