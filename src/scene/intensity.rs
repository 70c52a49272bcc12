//! Intensity by direction, as measured by goniometers: bilinear between the measured angles.
//!
//! ```text
//!                 ╲  azimuth: C-planes, 0° to 360° around the pole
//!        ──────────●──────────► C = 0°
//!                  │╲
//!           polar  │ ╲   I(C, γ) at the crossings; in a cell linear in both angles
//!           angle γ│  ╲
//!                  ▼ pole: γ = 0°
//! ```

use std::cmp::Ordering;
use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use serde::Serialize;

use crate::error::{Error, ErrorKind};

/// Intensity by direction, W/sr; candela if a scene's numbers are photometric. Bilinear in the two
/// angles; 0 outside the given angles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct IntensityDistribution {
    /// Radians, ascending; a single one means rotational symmetry.
    azimuths: Vec<f64>,
    /// Radians from the pole, ascending, in [0, π].
    polar: Vec<f64>,
    /// For each azimuth, the values at all polar angles.
    values: Vec<f64>,
    pole: Pole,
}

/// The axis of a luminaire that the angles of an [`IntensityDistribution`] turn around.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub enum Pole {
    /// The aim; azimuths from C = 0° towards C = 90°. Type C of the IES, and EULUMDAT.
    #[default]
    Aim,
    /// Towards C = 0°; azimuths from the aim towards C = 90°. Type B.
    C0,
    /// Towards C = 90°; azimuths from the aim towards C = 0°. Type A.
    C90,
}

/// Largest difference of a span of azimuths from a full turn if it is closed, degrees: above the
/// rounding of files.
const TURN_TOLERANCE: f64 = 1e-6;

impl IntensityDistribution {
    /// For `azimuths` and `polar` angles, both in degrees and ascending, and for each azimuth the
    /// values at all polar angles, W/sr. A single azimuth means rotational symmetry.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for no azimuth or fewer than two polar angles, angles that do not
    /// ascend, azimuths of more than a turn, polar angles outside [0, 180], a number of values
    /// other than azimuths × polar angles, or one that is negative or not finite.
    pub fn new(
        azimuths: &[f64],
        polar: &[f64],
        values: Vec<f64>,
    ) -> Result<IntensityDistribution, Error> {
        let bad = |found: String, remedy: &str| {
            Err(Error::new(ErrorKind::Scene, "intensity distribution", found, remedy))
        };
        if azimuths.is_empty() || polar.len() < 2 {
            let found = format!("{} azimuths, {} polar angles", azimuths.len(), polar.len());
            return bad(found, "give one azimuth and two polar angles at least");
        }
        for angles in [azimuths, polar] {
            // Comparisons with NaN are not ascending.
            let ascends =
                |k: usize| angles[k].partial_cmp(&angles[k - 1]) == Some(Ordering::Greater);
            if let Some(k) = (1..angles.len()).find(|&k| !ascends(k)) {
                let found = format!("{}° after {}°", angles[k], angles[k - 1]);
                return bad(found, "angles must ascend");
            }
        }
        let (first, last) = (azimuths[0], azimuths[azimuths.len() - 1]);
        if !(first.is_finite() && last - first <= 360.0 + TURN_TOLERANCE) {
            return bad(format!("azimuths {first}° to {last}°"), "they must be of one turn");
        }
        let (low, high) = (polar[0], polar[polar.len() - 1]);
        if !(low >= 0.0 && high <= 180.0) {
            return bad(format!("polar angles {low}° to {high}°"), "they must be 0° to 180°");
        }
        if values.len() != azimuths.len() * polar.len() {
            let found = format!("{} values for {} angles", values.len(), azimuths.len());
            return bad(found, "give one for each azimuth and polar angle");
        }
        if let Some(value) = values.iter().find(|v| !(v.is_finite() && **v >= 0.0)) {
            return bad(format!("intensity {value}"), "give at least 0, and finite");
        }
        let radians = |angles: &[f64]| angles.iter().map(|a| a.to_radians()).collect();
        let (azimuths, polar) = (radians(azimuths), radians(polar));
        Ok(IntensityDistribution { azimuths, polar, values, pole: Pole::Aim })
    }

    /// The same with angles around `pole`.
    pub fn around(self, pole: Pole) -> IntensityDistribution {
        IntensityDistribution { pole, ..self }
    }

    /// `intensity` in all directions, W/sr.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] when it is negative or not finite.
    pub fn isotropic(intensity: f64) -> Result<IntensityDistribution, Error> {
        IntensityDistribution::new(&[0.0], &[0.0, 180.0], vec![intensity; 2])
    }

    /// Intensity along a direction of unit length in the frame of the luminaire, x towards C = 0°,
    /// y towards C = 90° and z along the aim; W/sr.
    pub fn along(&self, direction: DVec3) -> f64 {
        let DVec3 { x, y, z } = direction;
        let [x, y, z] = match self.pole {
            Pole::Aim => [x, y, z],
            Pole::C0 => [z, y, x],
            Pole::C90 => [z, x, y],
        };
        let Some((row, down)) = cell(&self.polar, libm::atan2(libm::hypot(x, y), z)) else {
            return 0.0;
        };
        let at = |column: usize| {
            let values = &self.values[column * self.polar.len() + row..];
            values[0] + down * (values[1] - values[0])
        };
        if self.azimuths.len() == 1 {
            return at(0);
        }
        let first = self.azimuths[0];
        let azimuth = first + (libm::atan2(y, x) - first).rem_euclid(TAU);
        let Some((column, across)) = cell(&self.azimuths, azimuth) else {
            return if self.is_closed() { at(0) } else { 0.0 };
        };
        let (before, after) = (at(column), at(column + 1));
        before + across * (after - before)
    }

    /// Total flux, W; lumens if intensities are candela. Exact: the integral of
    /// [`IntensityDistribution::along`] over each cell. Between polar angles m ∓ h, with
    /// intensities I₀ and I₁ there,
    ///
    /// ```text
    /// ∫ I sin γ dγ = (I₀ + I₁) sin m sin h + (I₁ − I₀) cos m (sin h / h − cos h)
    /// ```
    pub fn flux(&self) -> f64 {
        let of_column = |column: usize| -> f64 {
            let values = &self.values[column * self.polar.len()..];
            let ring = |(angles, values): (&[f64], &[f64])| {
                let (middle, half) = (angles[0].midpoint(angles[1]), (angles[1] - angles[0]) / 2.0);
                let (even, odd) =
                    (libm::sin(middle) * libm::sin(half), libm::cos(middle) * bend(half));
                values[0] * (even - odd) + values[1] * (even + odd)
            };
            self.polar.windows(2).zip(values.windows(2)).map(ring).sum()
        };
        if self.azimuths.len() == 1 {
            return TAU * of_column(0);
        }
        let wedges = self.azimuths.windows(2).enumerate();
        wedges.map(|(k, a)| (a[1] - a[0]) * (of_column(k) + of_column(k + 1)) / 2.0).sum()
    }

    /// Whether nothing goes to directions of 90° and more from the pole, which is the aim.
    pub(crate) fn is_dark_behind(&self) -> bool {
        let behind = |k: usize| self.polar[k % self.polar.len()] > FRAC_PI_2 + 1e-9;
        // At 90° itself one value means the next cell, too.
        let last_front = self.polar.partition_point(|&angle| angle <= FRAC_PI_2 + 1e-9);
        let reaches_behind = last_front < self.polar.len() && last_front > 0;
        let is_lit =
            |k: usize| behind(k) || reaches_behind && k % self.polar.len() == last_front - 1;
        self.pole == Pole::Aim
            && (0..self.values.len()).filter(|&k| is_lit(k)).all(|k| self.values[k] == 0.0)
    }

    /// The largest intensity, W/sr.
    pub fn peak(&self) -> f64 {
        self.values.iter().copied().fold(0.0, f64::max)
    }

    /// The largest intensity between two polar angles, radians, W/sr.
    pub(crate) fn peak_between(&self, [low, high]: [f64; 2]) -> f64 {
        let mut peak = 0.0;
        for values in self.values.chunks_exact(self.polar.len()) {
            for edge in [low, high] {
                if let Some((row, down)) = cell(&self.polar, edge) {
                    peak = f64::max(peak, values[row] + down * (values[row + 1] - values[row]));
                }
            }
            let within = |&(angle, _): &(&f64, &f64)| (low..=high).contains(angle);
            let inner = self.polar.iter().zip(values).filter(within).map(|(_, value)| *value);
            peak = inner.fold(peak, f64::max);
        }
        peak
    }

    /// The axis that the polar angles are measured from.
    pub(crate) fn pole(&self) -> Pole {
        self.pole
    }

    /// Whether azimuths cover a full turn.
    fn is_closed(&self) -> bool {
        let span = self.azimuths[self.azimuths.len() - 1] - self.azimuths[0];
        span >= TAU - TURN_TOLERANCE.to_radians()
    }
}

/// sin h / h − cos h, by its series for small h, where the two are nearly equal.
fn bend(h: f64) -> f64 {
    let square = h * h;
    match h < 0.1 {
        true => {
            let inner = 1.0 / 840.0 - square / 45360.0;
            square * (1.0 / 3.0 - square * (1.0 / 30.0 - square * inner))
        }
        false => libm::sin(h) / h - libm::cos(h),
    }
}

/// The step of ascending `angles` that contains `angle`, and its fraction of the step, in [0, 1];
/// none outside of them. An angle outside by the rounding of a turn counts as inside.
fn cell(angles: &[f64], angle: f64) -> Option<(usize, f64)> {
    let rounding = TAU * f64::EPSILON;
    let (first, last) = (angles[0], angles[angles.len() - 1]);
    if angle < first - rounding || angle > last + rounding {
        return None;
    }
    let k = angles.partition_point(|&a| a <= angle).clamp(1, angles.len() - 1) - 1;
    Some((k, ((angle - angles[k]) / (angles[k + 1] - angles[k])).clamp(0.0, 1.0)))
}
