//! The sun, as the command line names it, and where it stands at a place and time.

use std::f64::consts::FRAC_PI_2;

use chrono::{DateTime, FixedOffset};
use radiosity::glam::{DQuat, DVec3};
use radiosity::{Error, ErrorKind, Rgb, Sun};
use solar_positioning::{Location, SolarPositions, delta_t};

use crate::args::{self, Parsed, give};

/// Where the sun is, and its irradiance, if given.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenSun {
    pub place: SunPlace,
    pub irradiance: Option<Rgb>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum SunPlace {
    Towards(DVec3),
    At(Site, String),
}

/// A place on the Earth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Site {
    /// Degrees north.
    pub latitude: f64,
    /// Degrees east.
    pub longitude: f64,
}

impl GivenSun {
    /// Whether it follows from a place and a time.
    pub fn is_by_time(&self) -> bool {
        matches!(self.place, SunPlace::At(..))
    }

    /// The sun where `up` and `north` are these directions of the scene.
    pub fn sun(&self, up: DVec3, north: Option<DVec3>) -> Result<Sun, Error> {
        let irradiance = self.irradiance.ok_or_else(|| {
            let remedy = "write =E behind it, or --sky irradiance:DNI,DHI";
            bad("sun", "no irradiance of the sun".into(), remedy)
        })?;
        Ok(Sun { direction: self.direction(up, north)?, irradiance })
    }

    /// Towards the sun, unit length.
    pub fn direction(&self, up: DVec3, north: Option<DVec3>) -> Result<DVec3, Error> {
        let SunPlace::At(site, _) = self.place else {
            let SunPlace::Towards(direction) = self.place else { return Ok(up) };
            let unit = direction.try_normalize();
            return unit.ok_or_else(|| bad("sun", direction.to_string(), "give a direction"));
        };
        let time = self.time()?.ok_or_else(|| wrong("no time".into()))?;
        let sky = Compass::new(up, north)?;
        let direction = site.towards_sun(&time, &sky).map_err(wrong)?;
        let elevation = FRAC_PI_2 - angle_between(direction, sky.up);
        if elevation <= 0.0 {
            let found = format!("the sun {:.1}° below the horizon", -elevation.to_degrees());
            return Err(bad("sun-at", found, "give a time at which it is day"));
        }
        Ok(direction)
    }

    /// The time that it is given for, if any.
    pub fn time(&self) -> Result<Option<DateTime<FixedOffset>>, Error> {
        let SunPlace::At(_, time) = &self.place else { return Ok(None) };
        let when = DateTime::parse_from_rfc3339(time);
        when.map(Some).map_err(|e| wrong(format!("time {time}: {e}")))
    }
}

fn wrong(found: String) -> Error {
    bad("sun-at", found, "give degrees north and east, and a time with its offset from UTC")
}

fn bad(option: &str, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::Setting, format!("--{option}"), found, remedy)
}

/// Directions of the scene.
pub struct Compass {
    pub up: DVec3,
    north: DVec3,
}

/// Angle between two directions of any length, radians.
pub fn angle_between(a: DVec3, b: DVec3) -> f64 {
    libm::acos((a.dot(b) / (a.length() * b.length())).clamp(-1.0, 1.0))
}

impl Compass {
    /// With −z, or +y where +z is up, as the default of north.
    pub fn new(up: DVec3, north: Option<DVec3>) -> Result<Compass, Error> {
        let up = up.normalize();
        let default = DQuat::from_rotation_arc(DVec3::Y, up) * DVec3::NEG_Z;
        let north = north.unwrap_or(default).reject_from_normalized(up).try_normalize();
        let north = north.ok_or_else(|| bad("north", "it along up".into(), "give another"))?;
        Ok(Compass { up, north })
    }
}

impl Site {
    /// Towards the sun at a time, without refraction: within 0.0003° (Reda and Andreas 2003). An
    /// error says what is wrong in words.
    pub fn towards_sun(
        &self,
        time: &DateTime<FixedOffset>,
        compass: &Compass,
    ) -> Result<DVec3, String> {
        let Site { latitude, longitude } = *self;
        let sun = delta_t::estimate_from_date_like(time).and_then(|delta| {
            let location = Location { latitude, longitude };
            SolarPositions::new().at(time, location, 0.0, delta, None)
        });
        let sun = sun.map_err(|e| e.to_string())?;
        let (elevation, azimuth) =
            (FRAC_PI_2 - sun.zenith_angle().to_radians(), sun.azimuth().to_radians());
        let Compass { up, north } = *compass;
        let level = libm::cos(azimuth) * north + libm::sin(azimuth) * north.cross(up);
        Ok(libm::cos(elevation) * level + libm::sin(elevation) * up)
    }
}

/// The value, and the irradiance behind `=`, if there is any.
fn with_irradiance(text: &str) -> Option<(&str, Option<Rgb>)> {
    let Some((value, irradiance)) = text.split_once('=') else { return Some((text, None)) };
    args::rgb(irradiance).ok().map(|irradiance| (value, Some(irradiance)))
}

/// `x,y,z=IRRADIANCE`.
pub fn sun_towards(text: &str) -> Parsed<GivenSun> {
    let expected = "x,y,z=IRRADIANCE: the direction towards the sun, and W/m²";
    let (direction, irradiance) = with_irradiance(text).ok_or_else(|| give(expected))?;
    let direction = DVec3::from_array(args::numbers(expected)(direction)?);
    Ok(GivenSun { place: SunPlace::Towards(direction), irradiance })
}

/// `LATITUDE,LONGITUDE,TIME=IRRADIANCE`.
pub fn sun_at(text: &str) -> Parsed<GivenSun> {
    let sun = || {
        let (at, irradiance) = with_irradiance(text)?;
        let [latitude, longitude, time] = at.split(',').collect::<Vec<_>>().try_into().ok()?;
        let site = Site {
            latitude: latitude.trim().parse().ok()?,
            longitude: longitude.trim().parse().ok()?,
        };
        Some(GivenSun { place: SunPlace::At(site, time.trim().into()), irradiance })
    };
    let expected = "LATITUDE,LONGITUDE,TIME=IRRADIANCE, as in \
                    48.1,11.6,2026-06-21T12:00:00+02:00=800";
    sun().ok_or_else(|| give(expected))
}
