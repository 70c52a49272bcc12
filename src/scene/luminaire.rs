//! Luminaires: lamps given by their intensity in each direction.
//!
//! ```text
//!               ┌──── opening ────┐
//!               │        ●────────┼──► C = 0°        position: the middle of the opening
//!               └────────┼────────┘                  E = I(direction) cos θ / d²
//!                        ▼ aim, γ = 0°
//! ```
//!
//! They are not surfaces: rays do not hit them, and pictures do not show them. All points of an
//! opening have the same distribution, scaled by their fraction of the opening: only the far field
//! is known (IES Lighting Handbook, 10th edition 2011, 9.7: the far field).

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::derived::Derived;
use super::{IntensityDistribution, Pole, Rgb, Scene, WarningKind};
use crate::error::{Error, ErrorKind};
use crate::geometry::aabb::Aabb;

/// A lamp with a measured distribution of light.
#[derive(Clone, Debug, PartialEq)]
pub struct Luminaire {
    /// Intensity by direction, W/sr. Many luminaires may share one.
    pub intensity: Arc<IntensityDistribution>,
    /// Middle of the opening, scene unit.
    pub position: DVec3,
    /// Direction of aim, γ = 0°: straight down for ceiling lamps. Of any length.
    pub aim: DVec3,
    /// Direction of C = 0°; only its component at right angles to `aim` counts. Seen from behind,
    /// that is from above if it aims down, C runs counter-clockwise.
    pub c0: DVec3,
    /// Luminous opening.
    pub opening: Opening,
    /// Factor of intensities, per channel.
    pub scale: Rgb,
}

/// The luminous part of a luminaire: a box or an upright cylinder, flat or of no size at all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Opening {
    /// Extent along C = 0°, along C = 90° and along the aim; scene unit, metres in files.
    pub size: DVec3,
    /// Whether the first two are diameters.
    pub is_round: bool,
}

impl Luminaire {
    /// A point that emits `intensity` from `position`, aims along `aim` (of any length) and has C =
    /// 0° towards +x, or +y if it aims along x.
    pub fn new(
        intensity: impl Into<Arc<IntensityDistribution>>,
        position: DVec3,
        aim: DVec3,
    ) -> Luminaire {
        let is_along_x = DVec3::X.reject_from(aim.normalize_or(DVec3::Z)).length() < 1e-6;
        let c0 = if is_along_x { DVec3::Y } else { DVec3::X };
        let (opening, scale) = (Opening::default(), Rgb::ONE);
        Luminaire { intensity: intensity.into(), position, aim, c0, opening, scale }
    }

    /// The same, given in metres, for a scene whose unit is `metres` long: converts the opening and
    /// the inverse square of distances to that unit, so that irradiance stays per m².
    pub fn in_unit_of(mut self, metres: f64) -> Luminaire {
        self.opening.size /= metres;
        self.scale /= metres * metres;
        self
    }

    /// Flux per channel, W; lumens if intensities are candela.
    pub fn flux(&self) -> Rgb {
        self.intensity.flux() * self.scale
    }

    /// The same with orthonormal axes.
    fn checked(mut self, number: usize) -> Result<Luminaire, Error> {
        let bad = |found: String, remedy: &str| {
            Error::new(ErrorKind::Scene, format!("luminaire {number}"), found, remedy)
        };
        let Luminaire { position, aim, c0, scale, .. } = self;
        if !position.is_finite() {
            return Err(bad(format!("position {position}"), "all three must be finite"));
        }
        let unit = aim.try_normalize();
        self.aim = unit.ok_or_else(|| bad(format!("aim {aim}"), "give a direction, not zero"))?;
        let across =
            c0.try_normalize().and_then(|c0| c0.reject_from_normalized(self.aim).try_normalize());
        let remedy = "give a direction across the aim";
        self.c0 = across.ok_or_else(|| bad(format!("C = 0° towards {c0}"), remedy))?;
        let size = self.opening.size;
        if !(size.is_finite() && size.min_element() >= 0.0) {
            return Err(bad(format!("opening {size}"), "give at least 0 each way, and finite"));
        }
        if !(self.flux().is_finite() && scale.is_finite() && scale.min_element() >= 0.0) {
            return Err(bad(format!("scale {scale}"), "give at least 0 per channel, and finite"));
        }
        Ok(self)
    }

    /// Towards C = 90°, unit length.
    fn c90(&self) -> DVec3 {
        self.c0.cross(self.aim)
    }

    /// The diagonal of the opening, scene unit.
    pub(crate) fn extent(&self) -> f64 {
        self.opening.size.length()
    }

    /// The box around the opening along the scene's axes.
    pub(crate) fn bounds(&self) -> Aabb {
        let [x, y, z] = [self.c0, self.c90(), self.aim].map(DVec3::abs);
        let half =
            0.5 * (self.opening.size.x * x + self.opening.size.y * y + self.opening.size.z * z);
        Aabb { low: self.position - half, high: self.position + half }
    }

    /// The axis that polar angles of the intensity turn from, unit length.
    pub(crate) fn pole(&self) -> DVec3 {
        match self.intensity.pole() {
            Pole::Aim => self.aim,
            Pole::C0 => self.c0,
            Pole::C90 => self.c90(),
        }
    }

    /// Area of the opening as it is seen along unit `direction`, scene unit squared.
    pub(crate) fn projected_area(&self, direction: DVec3) -> f64 {
        let [x, y, z] = [self.c0, self.c90(), self.aim].map(|axis| axis.dot(direction).abs());
        let DVec3 { x: length, y: width, z: height } = self.opening.size;
        match self.opening.is_round {
            false => length * width * z + height * (width * x + length * y),
            // An ellipse, and the width of its shadow.
            true => PI / 4.0 * length * width * z + height * libm::hypot(length * y, width * x),
        }
    }

    /// The distance from `at` to the box around the opening, scene unit.
    pub(crate) fn distance_to_box(&self, at: DVec3) -> f64 {
        let local = [self.c0, self.c90(), self.aim].map(|axis| (at - self.position).dot(axis));
        let beyond = DVec3::from_array(local).abs() - self.opening.size / 2.0;
        beyond.max(DVec3::ZERO).length()
    }

    /// A point of the opening: a uniform distribution over the unit cube becomes one over the
    /// opening.
    pub(crate) fn point(&self, [x, y, z]: [f64; 3]) -> DVec3 {
        let [x, y] = match self.opening.is_round {
            false => [x - 0.5, y - 0.5],
            true => {
                let (sine, cosine) = libm::sincos(std::f64::consts::TAU * y);
                [0.5 * x.sqrt() * cosine, 0.5 * x.sqrt() * sine]
            }
        };
        let local = self.opening.size * DVec3::new(x, y, z - 0.5);
        self.position + local.x * self.c0 + local.y * self.c90() + local.z * self.aim
    }

    /// Intensity along a unit `direction`, W/sr in units of the scale.
    pub(crate) fn intensity_along(&self, direction: DVec3) -> f64 {
        let local = [self.c0, self.c90(), self.aim].map(|axis| direction.dot(axis));
        self.intensity.along(DVec3::from_array(local))
    }

    /// Irradiance at `at` with this unit `normal` if all light comes from `point`, unoccluded; in
    /// units of the scale, 0 behind the surface and at `point` itself.
    pub(crate) fn irradiance(&self, point: DVec3, at: DVec3, normal: DVec3) -> f64 {
        let (direction, distance) = (at - point).normalize_and_length();
        let cosine = -normal.dot(direction);
        // NaN at distance 0.
        if cosine.is_nan() || cosine <= 0.0 {
            return 0.0;
        }
        let irradiance = self.intensity_along(direction) * cosine / (distance * distance);
        if irradiance.is_finite() { irradiance } else { 0.0 }
    }
}

impl Scene {
    /// The luminaires; none by default. Their axes are orthonormal.
    pub fn luminaires(&self) -> &[Luminaire] {
        &self.luminaires
    }

    /// The same scene with its luminaires replaced by these. Removes the warning about a scene
    /// without light.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for a position, an opening or a scale that is not finite, an opening or
    /// scale below 0, or axes that are zero or parallel.
    pub fn with_luminaires(mut self, luminaires: Vec<Luminaire>) -> Result<Scene, Error> {
        let numbered = (1..).zip(luminaires);
        self.luminaires =
            numbered.map(|(k, luminaire)| luminaire.checked(k)).collect::<Result<_, _>>()?;
        self.derived = Derived::default();
        if !self.luminaires.is_empty() {
            self.warnings.retain(|warning| warning.kind != WarningKind::NoLight);
        }
        Ok(self)
    }

    /// Whether there is light that no surface emits: a sky, the sun, luminaires. It is gathered.
    pub(crate) fn has_light_of_no_surface(&self) -> bool {
        !self.sky.is_black() || !self.luminaires.is_empty()
    }

    /// Whether there is light from known directions, which casts sharp shadows: the sun and
    /// luminaires.
    pub(crate) fn has_directional_light(&self) -> bool {
        self.sky.sun().is_some() || !self.luminaires.is_empty()
    }
}
