//! Light from outside: a sky, visible in every direction without a surface, and a sun.
//!
//! ```text
//!          up        sun: a disc of half a degree
//!           │      ☼      L(direction): uniform, a distribution of the CIE or of Perez, or a
//!     ╭─────┼─────╮                     picture around the scene
//!   ╭─╯     │     ╰─╮
//!  ─┴───────┴───────┴─ horizon: skies by distributions are black below it
//! ```

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde::Serialize;

use super::sky_distribution::SkyDistribution;
use super::sky_map::SkyMap;
use super::{Rgb, Scene};
use crate::error::{Error, ErrorKind};

/// The light from outside of a scene: radiance by direction, and optionally a sun. Black by
/// default.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sky {
    /// Radiance in all directions, W/(m² sr) per channel; 0 if there is a map.
    uniform: Rgb,
    map: Option<Arc<SkyMap>>,
    sun: Option<Sun>,
}

/// The sun: a distant disc, half a degree wide, of uniform brightness.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Sun {
    /// Direction of its centre; of any length.
    pub direction: DVec3,
    /// Irradiance of a surface that faces it, W/m² per channel.
    pub irradiance: Rgb,
}

impl Sun {
    /// Sine of its angular radius, 959.63 arc seconds at the mean distance (Allen 1973).
    pub(crate) const SINE: f64 = 0.004_652_4;

    /// Tangent of its angular radius.
    pub(crate) fn tangent() -> f64 {
        Sun::SINE / (1.0 - Sun::SINE * Sun::SINE).sqrt()
    }

    /// Irradiance of a surface with this cosine of the angle to the sun, if unoccluded, W/m²; none
    /// if the horizon cuts the disc. Exact: the irradiance of a sphere follows the cosine as long
    /// as the whole sphere is visible.
    pub(crate) fn unoccluded(&self, cosine: f64) -> Option<Rgb> {
        (cosine >= Sun::SINE).then_some(self.irradiance * cosine)
    }

    /// A direction to its disc, unit length: a uniform distribution over the unit square becomes
    /// one over the disc.
    pub(crate) fn towards(&self, [x, y]: [f64; 2]) -> DVec3 {
        let (right, up) = self.direction.any_orthonormal_pair();
        let (sine, cosine) = libm::sincos(TAU * y);
        (self.direction + (right * cosine + up * sine) * (x.sqrt() * Sun::tangent())).normalize()
    }
}

impl From<Rgb> for Sky {
    /// [`Sky::uniform`].
    fn from(radiance: Rgb) -> Sky {
        Sky::uniform(radiance)
    }
}

impl Sky {
    /// The same `radiance` in every direction, W/(m² sr) per channel: unoccluded surfaces receive
    /// the irradiance π times that.
    pub fn uniform(radiance: Rgb) -> Sky {
        Sky { uniform: radiance, ..Sky::default() }
    }

    /// A sky of this `distribution`, `zenith` its radiance straight up, W/(m² sr) per channel. `up`
    /// and `towards_sun` may have any length; an overcast sky ignores the latter. The sun itself is
    /// not included: see [`Sky::with_sun`]. Below the horizon it is black.
    ///
    /// It is stored in pieces of 0.3° or less.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for a radiance that is negative or not finite, or a direction of length
    /// 0.
    pub fn new(
        distribution: SkyDistribution,
        zenith: Rgb,
        up: DVec3,
        towards_sun: DVec3,
    ) -> Result<Sky, Error> {
        check_light("radiance of the zenith", zenith)?;
        let (up, sun) = (unit("up", up)?, unit("towards the sun", towards_sun)?);
        let relative = distribution.relative_to_zenith(up.dot(sun));
        let turn = axes(up);
        let map = SkyMap::of_upper_hemisphere(turn, |direction| {
            relative(direction.dot(up), direction.dot(sun)) * zenith
        });
        Ok(Sky { map: Some(Arc::new(map)), ..Sky::default() })
    }

    /// An environment map: `pixels` of radiance, W/(m² sr) per channel, in lines of `width` from
    /// straight up to straight down, each a full turn. With `up` +y the middle of a line is towards
    /// −z and its right towards +x; with +z the middle is towards +y. For other axes it is the +y
    /// case turned by the shortest rotation.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for no pixels, lines of another length, a pixel that is negative or not
    /// finite, or no direction `up`.
    pub fn picture(width: u32, pixels: &[Rgb], up: DVec3) -> Result<Sky, Error> {
        let up = unit("up", up)?;
        if width == 0 || pixels.is_empty() || !pixels.len().is_multiple_of(width as usize) {
            let found = format!("{} pixels in lines of {width}", pixels.len());
            return Err(bad(found, "give whole lines, and at least one".into()));
        }
        for (k, &pixel) in pixels.iter().enumerate() {
            let (x, y) = (k % width as usize, k / width as usize);
            check_light(&format!("pixel {x} of line {y}"), pixel)?;
        }
        let map = SkyMap::of_picture(axes(up), width as usize, pixels);
        Ok(Sky { map: Some(Arc::new(map)), ..Sky::default() })
    }

    /// The same sky with this sun in front of it.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for an irradiance that is negative or not finite, or a direction of
    /// length 0.
    pub fn with_sun(self, sun: Sun) -> Result<Sky, Error> {
        check_light("irradiance of the sun", sun.irradiance)?;
        let sun = Sun { direction: unit("towards the sun", sun.direction)?, ..sun };
        Ok(Sky { sun: (sun.irradiance != Rgb::ZERO).then_some(sun), ..self })
    }

    /// The sun; its direction has unit length.
    pub fn sun(&self) -> Option<&Sun> {
        self.sun.as_ref()
    }

    /// Radiance from `direction` (towards the sky, unit length), W/(m² sr) per channel: without the
    /// sun.
    pub fn radiance(&self, direction: DVec3) -> Rgb {
        match &self.map {
            None => self.uniform,
            Some(map) => map.radiance(direction),
        }
    }

    /// Irradiance of a surface with unit `normal` that sees all of its half of the sky, W/m² per
    /// channel: without the sun. Of 2¹⁸ directions, dense as the cosine.
    pub fn irradiance(&self, normal: DVec3) -> Rgb {
        if let Some(radiance) = self.uniform_radiance() {
            return PI * radiance;
        }
        let count = 512;
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let radiance = |k: u32| {
            let [square, turn] = [k / count, k % count].map(|k| (f64::from(k) + 0.5) / 512.0);
            let (sine, cosine) = libm::sincos(TAU * turn);
            let across = square.sqrt() * (tangent * cosine + bitangent * sine);
            self.radiance(across + normal * (1.0 - square).sqrt())
        };
        (0..count * count).map(radiance).sum::<Rgb>() * (PI / f64::from(count * count))
    }

    /// Whether it has neither radiance nor a sun.
    pub fn is_black(&self) -> bool {
        self.brightest() == 0.0 && self.sun.is_none()
    }

    /// The radiance in all directions; none if they differ.
    pub fn uniform_radiance(&self) -> Option<Rgb> {
        self.map.is_none().then_some(self.uniform)
    }

    /// The radiance of the brightest piece, in its brightest channel, W/(m² sr).
    pub(crate) fn brightest(&self) -> f64 {
        let map = self.map.as_ref().map_or(0.0, |map| map.brightest());
        map.max(self.uniform.max_element())
    }

    /// The pieces; none if the sky is uniform.
    pub(crate) fn map(&self) -> Option<&SkyMap> {
        self.map.as_deref()
    }
}

impl Scene {
    /// The light from outside: black unless set.
    pub fn sky(&self) -> &Sky {
        &self.sky
    }

    /// The same scene under `sky`: a [`Sky`], or the radiance of a uniform one, W/(m² sr) per
    /// channel.
    ///
    /// # Errors
    /// [`ErrorKind::Scene`] for a radiance that is negative or not finite.
    pub fn with_sky(self, sky: impl Into<Sky>) -> Result<Scene, Error> {
        let sky = sky.into();
        check_light("radiance", sky.uniform)?;
        Ok(Scene { sky, ..self })
    }
}

fn bad(found: String, remedy: String) -> Error {
    Error::new(ErrorKind::Scene, "sky", found, remedy)
}

fn check_light(what: &str, light: Rgb) -> Result<(), Error> {
    if (light * PI).is_finite() && light.min_element() >= 0.0 {
        return Ok(());
    }
    let remedy = "give at least 0 in every channel, and finite";
    Err(bad(format!("{what} {light}"), remedy.into()))
}

fn unit(what: &str, direction: DVec3) -> Result<DVec3, Error> {
    let found = || bad(format!("{what} {direction}"), "give a direction that is not zero".into());
    direction.try_normalize().ok_or_else(found)
}

/// The rotation from the axes of the scene to those of a map, whose zenith is +z and whose pictures
/// have their middle towards +y: (x, −z, y) if `up` is +y.
fn axes(up: DVec3) -> DQuat {
    let upright = DQuat::from_rotation_arc(DVec3::Y, up).inverse();
    DQuat::from_rotation_arc(DVec3::Y, DVec3::Z) * upright
}
