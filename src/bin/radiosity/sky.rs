//! The light from outside, as the command line names it.

use std::path::{Path, PathBuf};

use clap::Args;
use radiosity::glam::DVec3;
use radiosity::io::read_radiance;
use radiosity::scene::SkyDistribution;
use radiosity::{Error, ErrorKind, Rgb, Scene, Sky, Sun};

use crate::args::{self, Parsed, Stop, give};
use crate::measured_sky::MeasuredSky;
use crate::sun::{GivenSun, SunPlace, angle_between, sun_at, sun_towards};

/// What `--sky` takes.
const SKIES: &str = "a radiance r,g,b, none, overcast, cie1 to cie15, perez:CLEARNESS,BRIGHTNESS, \
     irradiance:DNI,DHI, or a picture";

/// The light from outside.
#[derive(Args)]
pub struct SkyOptions {
    /// Sky: radiance r,g,b; none; above the horizon overcast, cie1 to cie15,
    /// perez:CLEARNESS,BRIGHTNESS or irradiance:DNI,DHI; a picture FILE.exr or FILE.hdr [default: 1
    /// if nothing emits]
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
    /// Direction of north, for --sun-at and --weather [default: -z; +y where +z is up]
    #[arg(long, value_name = "x,y,z", hide = true, value_parser = direction)]
    north: Option<DVec3>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    Uniform(Rgb),
    Overcast,
    Cie(u32),
    /// Clearness and brightness.
    Perez(f64, f64),
    Picture(PathBuf),
    /// That of Perez and the sun, by their irradiance.
    Irradiance(MeasuredSky),
}

/// Sky and sun as numbers.
pub struct Resolved {
    pub kind: Option<Kind>,
    pub zenith: Rgb,
    pub sun: Option<Sun>,
}

impl SkyOptions {
    /// Which way is up, if that was said.
    pub fn up(&self) -> Option<DVec3> {
        self.up
    }

    /// Whether the light depends on which way is up.
    pub fn needs_up(&self) -> bool {
        !matches!(self.kind, None | Some(Kind::Uniform(_)))
            || self.given_sun().is_some_and(GivenSun::is_by_time)
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

    /// Says that the weather of a year takes the place of all skies: the scene is read under one.
    ///
    /// # Errors
    /// [`Stop::Usage`] where a sky or a sun is given.
    pub fn be_of_weather(&mut self) -> Result<(), Stop> {
        if !self.is_default() {
            return Err(Stop::usage("--weather brings sky and sun: leave out --sky and --sun"));
        }
        self.kind = Some(Kind::Uniform(Rgb::ONE));
        Ok(())
    }

    /// Direction of north, if given.
    pub fn north(&self) -> Option<DVec3> {
        self.north
    }

    /// Says that light is in lumens: irradiance by `--sky irradiance` is converted.
    pub fn be_photometric(&mut self) {
        if let Some(Kind::Irradiance(given)) = &mut self.kind {
            given.is_photometric = true;
        }
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
        let has_own = matches!(self.kind, Some(Kind::Irradiance(_)));
        if (is_even || has_own) && self.zenith.is_some() {
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
        let Resolved { kind, zenith, sun } = self.resolved(up)?;
        let towards_sun = sun.map_or(up, |sun| sun.direction);
        let spread = |distribution: Option<SkyDistribution>| {
            let words = || self.kind.as_ref().map_or_else(String::new, Kind::words);
            let wrong = || bad("sky", words(), SKIES);
            Sky::new(distribution.ok_or_else(wrong)?, zenith, up, towards_sun)
        };
        let sky = match &kind {
            None => Sky::default(),
            Some(Kind::Uniform(radiance)) => (*radiance).into(),
            Some(Kind::Overcast) => spread(Some(SkyDistribution::OVERCAST))?,
            Some(Kind::Cie(number)) => spread(SkyDistribution::cie(*number))?,
            Some(Kind::Perez(clearness, brightness)) => {
                let angle = angle_between(up, towards_sun);
                spread(SkyDistribution::perez(*clearness, *brightness, angle))?
            }
            Some(Kind::Picture(path)) => {
                let (width, mut pixels) = read_radiance(path)?;
                pixels.iter_mut().for_each(|pixel| *pixel *= zenith);
                Sky::picture(width, &pixels, up)?
            }
            Some(Kind::Irradiance(_)) => Sky::default(),
        };
        // A directional lamp of the file shines on under another sky.
        let sun = sun.or(scene.sky().sun().copied());
        scene.with_sky(match sun {
            Some(sun) => sky.with_sun(sun)?,
            None => sky,
        })
    }

    /// What is odd about it over `scene`, which is under it.
    pub fn warning(&self, scene: &Scene) -> Option<String> {
        let (Some(GivenSun { place: SunPlace::Towards(given), .. }), Some(sun)) =
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

    /// Kind of the sky, radiance of its zenith and the sun, where `up` is up.
    fn resolved(&self, up: DVec3) -> Result<Resolved, Error> {
        let zenith = self.zenith.unwrap_or(Rgb::ONE);
        let Some(Kind::Irradiance(given)) = self.kind else {
            let sun = self.given_sun().map(|given| given.sun(up, self.north)).transpose()?;
            return Ok(Resolved { kind: self.kind.clone(), zenith, sun });
        };
        given.resolved(self.given_sun(), up, self.north)
    }

    /// The same in words that give it again; none where a radiance says all.
    pub fn words(&self, scene: &Scene) -> Option<String> {
        if scene.sky().uniform_radiance().is_some() && scene.sky().sun().is_none() {
            return None;
        }
        let Resolved { kind, zenith, sun } = self.resolved(scene.up()).ok()?;
        // A dark one says where a sky is bright.
        let sun = scene.sky().sun().copied().or(sun);
        let mut words = vec![kind.as_ref().map_or_else(|| "none".into(), Kind::words)];
        if !matches!(kind, None | Some(Kind::Uniform(_))) {
            words.push(format!("--zenith {}", list(zenith)));
            words.push(format!("--up {}", list(scene.up())));
        }
        if let Some(Sun { direction, irradiance }) = sun {
            words.push(format!("--sun {}={}", list(direction), list(irradiance)));
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
            Kind::Irradiance(given) => given.words(),
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
        if let Some(numbers) = text.strip_prefix("irradiance:") {
            return MeasuredSky::parse(numbers).map(Kind::Irradiance).ok_or_else(wrong);
        }
        match text {
            "none" => Ok(Kind::Uniform(Rgb::ZERO)),
            "overcast" => Ok(Kind::Overcast),
            _ if Path::new(text).extension().is_some() => Ok(Kind::Picture(text.into())),
            _ => Err(wrong()),
        }
    }
}

pub fn bad(option: &str, found: String, remedy: &str) -> Error {
    Error::new(ErrorKind::Setting, format!("--{option}"), found, remedy)
}

/// `x,y,z`, not zero.
pub fn direction(text: &str) -> Parsed<DVec3> {
    let expected = "a direction x,y,z that is not zero";
    let direction = DVec3::from_array(args::numbers(expected)(text)?);
    direction.try_normalize().ok_or_else(|| give(expected))
}
