//! The light from outside, as the command line names it.

use std::f64::consts::FRAC_PI_2;
use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::glam::{DQuat, DVec3};
use radiosity::io::read_radiance;
use radiosity::scene::SkyDistribution;
use radiosity::{Error, ErrorKind, Rgb, Scene, Sky, Sun};
use solar_positioning::{Location, SolarPositions, delta_t};

use crate::args::{self, Parsed, give};

/// What `--sky` takes.
const SKIES: &str =
    "a radiance r,g,b, none, overcast, cie1 to cie15, perez:CLEARNESS,BRIGHTNESS, or a picture";

/// The light from outside.
#[derive(Args)]
pub struct SkyOptions {
    /// Sky: radiance r,g,b of a uniform one; none; above the horizon overcast, cie1 to cie15 or
    /// perez:CLEARNESS,BRIGHTNESS; a picture FILE.exr or FILE.hdr [default: 1 if nothing emits]
    #[arg(long = "sky", value_name = "SKY", value_parser = Kind::parse)]
    kind: Option<Kind>,
    /// Radiance of the sky at the zenith, or factor of a picture [default: 1]
    #[arg(long, value_name = "r,g,b", value_parser = args::rgb)]
    zenith: Option<Rgb>,
    /// Sun: direction towards the sun, and irradiance E or r,g,b of a surface that faces it, W/m²
    #[arg(long, value_name = "x,y,z=E", overrides_with = "sun_at", value_parser = sun_towards)]
    sun: Option<GivenSun>,
    /// The same by degrees north and east and a time, as 48.1,11.6,2026-06-21T12:00:00+02:00=800
    #[arg(long, value_name = "LAT,LON,TIME=E", overrides_with = "sun", value_parser = sun_at)]
    sun_at: Option<GivenSun>,
    /// Direction away from the ground [default: +y or +z, by names, comments, lamps and geometry]
    #[arg(long, value_name = "x,y,z", value_parser = direction)]
    up: Option<DVec3>,
    /// Direction of north, for --sun-at [default: -z; +y where +z is up]
    #[arg(long, value_name = "x,y,z", hide = true, value_parser = direction)]
    north: Option<DVec3>,
}

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    Uniform(Rgb),
    Overcast,
    Cie(u32),
    /// Clearness and brightness.
    Perez(f64, f64),
    Picture(PathBuf),
}

/// Where the sun is, and its irradiance.
type GivenSun = (SunPlace, Rgb);

#[derive(Clone, Debug, PartialEq)]
enum SunPlace {
    Towards(DVec3),
    /// Degrees north and east, and the time (RFC 3339).
    At([f64; 2], String),
}

impl SkyOptions {
    /// Which way is up, if that was said.
    pub fn up(&self) -> Option<DVec3> {
        self.up
    }

    /// Whether the light depends on which way is up.
    pub fn needs_up(&self) -> bool {
        !matches!(self.kind, None | Some(Kind::Uniform(_)))
            || matches!(self.given_sun(), Some((SunPlace::At(..), _)))
    }

    /// Whether it is the overcast sky, for which the daylight factor is defined (CIE S 011/E:2003,
    /// types 1 and 16).
    pub fn is_overcast(&self) -> bool {
        matches!(self.kind, Some(Kind::Overcast | Kind::Cie(1)))
    }

    /// Whether nothing was said, so that a scene without light gets one that nobody asked for.
    pub fn is_default(&self) -> bool {
        self.kind.is_none() && self.given_sun().is_none()
    }

    fn given_sun(&self) -> Option<&GivenSun> {
        self.sun.as_ref().or(self.sun_at.as_ref())
    }

    /// A sky to read the scene with, before its up axis is known: black only if this one is.
    pub fn while_reading(&self) -> Option<Sky> {
        match self.kind {
            _ if self.is_default() => None,
            Some(Kind::Uniform(sky)) if self.given_sun().is_none() => Some(sky.into()),
            _ => Some(Rgb::ONE.into()),
        }
    }

    /// `scene` under this sky, and the sky in words that give it again.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for numbers that mean no sky, a time that is none, or a sun below the
    /// horizon; those of reading a picture.
    pub fn over(&self, scene: Scene) -> Result<Scene, Error> {
        let is_even = matches!(self.kind, None | Some(Kind::Uniform(_)));
        if is_even && self.zenith.is_some() {
            let found = "a radiance for a sky that differs by direction, and no such --sky".into();
            return Err(bad(
                "zenith",
                found,
                "add --sky overcast or another, or write --sky r,g,b",
            ));
        }
        if is_even && self.given_sun().is_none() {
            return Ok(scene);
        }
        let up = scene.up();
        let sun = self.sun(up)?;
        let towards_sun = sun.map_or(up, |sun| sun.direction);
        let zenith = self.zenith.unwrap_or(Rgb::ONE);
        let spread = |distribution: Option<SkyDistribution>| {
            let words = || self.kind.as_ref().map_or_else(String::new, Kind::words);
            let wrong = || bad("sky", words(), SKIES);
            Sky::new(distribution.ok_or_else(wrong)?, zenith, up, towards_sun)
        };
        let sky = match &self.kind {
            None => Sky::default(),
            Some(Kind::Uniform(radiance)) => (*radiance).into(),
            Some(Kind::Overcast) => spread(Some(SkyDistribution::OVERCAST))?,
            Some(Kind::Cie(number)) => spread(SkyDistribution::cie(*number))?,
            Some(Kind::Perez(clearness, brightness)) => {
                let angle = up.normalize().angle_between(towards_sun);
                spread(SkyDistribution::perez(*clearness, *brightness, angle))?
            }
            Some(Kind::Picture(path)) => {
                let (width, mut pixels) = read_radiance(path)?;
                pixels.iter_mut().for_each(|pixel| *pixel *= zenith);
                Sky::picture(width, &pixels, up)?
            }
        };
        scene.with_sky(match sun {
            Some(sun) => sky.with_sun(sun)?,
            None => sky,
        })
    }

    /// What is odd about it over `scene`, which is under it.
    pub fn warning(&self, scene: &Scene) -> Option<String> {
        let (Some((SunPlace::Towards(given), _)), Some(sun)) =
            (self.given_sun(), scene.sky().sun())
        else {
            return None;
        };
        let up = scene.up();
        let list = |v: DVec3| v.to_array().map(|x| (x + 0.0).to_string()).join(",");
        (sun.direction.dot(up) < 0.0).then(|| {
            format!(
                "the sun is below the horizon where {} is up: {} points towards it; did you \
                 mean {}?",
                list(up),
                list(*given),
                list(-*given)
            )
        })
    }

    fn sun(&self, up: DVec3) -> Result<Option<Sun>, Error> {
        let Some((place, irradiance)) = self.given_sun().cloned() else { return Ok(None) };
        let direction = match place {
            SunPlace::Towards(direction) => direction,
            SunPlace::At(place, time) => self.direction_at(place, &time, up)?,
        };
        let unit = direction.try_normalize();
        let unit = unit.ok_or_else(|| bad("sun", direction.to_string(), "give a direction"))?;
        Ok(Some(Sun { direction: unit, irradiance }))
    }

    /// Towards the sun at a place and time, without refraction.
    fn direction_at(
        &self,
        [latitude, longitude]: [f64; 2],
        time: &str,
        up: DVec3,
    ) -> Result<DVec3, Error> {
        let wrong = |found: String| {
            bad("sun-at", found, "give degrees north and east, and a time with its offset from UTC")
        };
        let when = chrono::DateTime::parse_from_rfc3339(time);
        let when = when.map_err(|e| wrong(format!("time {time}: {e}")))?;
        let sun = delta_t::estimate_from_date_like(&when).and_then(|delta| {
            let location = Location { latitude, longitude };
            SolarPositions::new().at(&when, location, 0.0, delta, None)
        });
        let sun = sun.map_err(|e| wrong(e.to_string()))?;
        let (elevation, azimuth) =
            (FRAC_PI_2 - sun.zenith_angle().to_radians(), sun.azimuth().to_radians());
        if elevation <= 0.0 {
            let found = format!("the sun {:.1}° below the horizon", -elevation.to_degrees());
            return Err(bad("sun-at", found, "give a time at which it is day"));
        }
        let up = up.normalize();
        // Where −z is north for +y up.
        let default = DQuat::from_rotation_arc(DVec3::Y, up) * DVec3::NEG_Z;
        let north = self.north.unwrap_or(default).reject_from_normalized(up).try_normalize();
        let north = north.ok_or_else(|| bad("north", "it along up".into(), "give another"))?;
        let level = azimuth.cos() * north + azimuth.sin() * north.cross(up);
        Ok(elevation.cos() * level + elevation.sin() * up)
    }

    /// The same in words that give it again; none where a radiance says all.
    pub fn words(&self, scene: &Scene) -> Option<String> {
        if scene.sky().uniform_radiance().is_some() && scene.sky().sun().is_none() {
            return None;
        }
        let mut words = vec![self.kind.as_ref().map_or_else(|| "none".into(), Kind::words)];
        if !matches!(self.kind, None | Some(Kind::Uniform(_))) {
            words.push(format!("--zenith {}", list(self.zenith.unwrap_or(Rgb::ONE))));
            words.push(format!("--up {}", list(scene.up())));
        }
        if let Some(Sun { direction, irradiance }) = scene.sky().sun() {
            words.push(format!("--sun {}={}", list(*direction), list(*irradiance)));
        }
        Some(words.join(" "))
    }
}

/// `x,y,z`.
fn list(v: DVec3) -> String {
    v.to_array().map(|x| x.to_string()).join(",")
}

impl Kind {
    /// The same as the value of `--sky`.
    fn words(&self) -> String {
        match self {
            Kind::Uniform(radiance) => list(*radiance),
            Kind::Overcast => "overcast".into(),
            Kind::Cie(number) => format!("cie{number}"),
            Kind::Perez(clearness, brightness) => format!("perez:{clearness},{brightness}"),
            Kind::Picture(path) => path.display().to_string(),
        }
    }

    fn parse(text: &str) -> Parsed<Kind> {
        let wrong = || give(SKIES);
        if let Ok(radiance) = args::rgb(text) {
            return Ok(Kind::Uniform(radiance));
        }
        if let Some(number) = text.strip_prefix("cie") {
            let number = number.parse().ok().filter(|&n| SkyDistribution::cie(n).is_some());
            return number.map(Kind::Cie).ok_or_else(wrong);
        }
        if let Some(numbers) = text.strip_prefix("perez:") {
            let numbers = numbers.split_once(',').ok_or_else(wrong)?;
            let number = |text: &str| text.trim().parse().map_err(|_| wrong());
            return Ok(Kind::Perez(number(numbers.0)?, number(numbers.1)?));
        }
        match text {
            "none" => Ok(Kind::Uniform(Rgb::ZERO)),
            "overcast" => Ok(Kind::Overcast),
            _ if Path::new(text).extension().is_some() => Ok(Kind::Picture(text.into())),
            _ => Err(wrong()),
        }
    }
}

fn bad(option: &str, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::Setting, format!("--{option}"), found, remedy)
}

/// `x,y,z`, not zero.
fn direction(text: &str) -> Parsed<DVec3> {
    let expected = "a direction x,y,z that is not zero";
    let direction = DVec3::from_array(args::numbers(expected)(text)?);
    direction.try_normalize().ok_or_else(|| give(expected))
}

/// `x,y,z=IRRADIANCE`.
fn sun_towards(text: &str) -> Parsed<GivenSun> {
    let expected = "x,y,z=IRRADIANCE: the direction towards the sun, and W/m²";
    let (direction, irradiance) = text.split_once('=').ok_or_else(|| give(expected))?;
    let direction = DVec3::from_array(args::numbers(expected)(direction)?);
    let irradiance = args::rgb(irradiance).map_err(|_| give(expected))?;
    Ok((SunPlace::Towards(direction), irradiance))
}

/// `LATITUDE,LONGITUDE,TIME=IRRADIANCE`.
fn sun_at(text: &str) -> Parsed<GivenSun> {
    let sun = || {
        let (at, irradiance) = text.split_once('=')?;
        let [latitude, longitude, time] = at.split(',').collect::<Vec<_>>().try_into().ok()?;
        let place = [latitude.trim().parse().ok()?, longitude.trim().parse().ok()?];
        Some((SunPlace::At(place, time.trim().into()), args::rgb(irradiance).ok()?))
    };
    let expected = "LATITUDE,LONGITUDE,TIME=IRRADIANCE, as in \
                    48.1,11.6,2026-06-21T12:00:00+02:00=800";
    sun().ok_or_else(|| give(expected))
}
