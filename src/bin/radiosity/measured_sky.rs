//! A sky with its sun by measured irradiance: `--sky irradiance:DNI,DHI`.

use std::f64::consts::PI;

use chrono::Datelike;
use radiosity::glam::DVec3;
use radiosity::scene::{LuminousEfficacy, SolarIrradiance};
use radiosity::{Error, Rgb, Sky, Sun};

use crate::args;
use crate::sky::{Kind, Resolved, bad};
use crate::sun::{GivenSun, angle_between};

/// Irradiance of sun and sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasuredSky {
    /// Direct normal and diffuse horizontal irradiance, W/m².
    direct_normal: f64,
    diffuse_horizontal: f64,
    /// Dew point, degrees Celsius.
    dew_point: f64,
    /// Whether the light is in lumens instead of watts.
    pub is_photometric: bool,
}

/// That of 2 cm of water, the mean of the data that the model of efficacy is fitted to.
pub const DEW_POINT: f64 = 11.0;

impl MeasuredSky {
    /// `DNI,DHI` or `DNI,DHI,DEW_POINT`.
    pub fn parse(text: &str) -> Option<MeasuredSky> {
        let mut numbers = args::list("")(text).ok()?;
        if numbers.len() == 2 {
            numbers.push(DEW_POINT);
        }
        let [direct_normal, diffuse_horizontal, dew_point] = numbers.try_into().ok()?;
        let is_fine = |x: f64| x.is_finite() && x >= 0.0;
        let all_fine = is_fine(direct_normal) && is_fine(diffuse_horizontal);
        (all_fine && dew_point.is_finite()).then_some(MeasuredSky {
            direct_normal,
            diffuse_horizontal,
            dew_point,
            is_photometric: false,
        })
    }

    pub fn words(&self) -> String {
        let MeasuredSky { direct_normal, diffuse_horizontal, dew_point, .. } = self;
        format!("irradiance:{direct_normal},{diffuse_horizontal},{dew_point}")
    }

    /// The sky of Perez and its sun, which stands where it is `given`.
    pub fn resolved(
        &self,
        given: Option<&GivenSun>,
        up: DVec3,
        north: Option<DVec3>,
    ) -> Result<Resolved, Error> {
        let place = given.filter(|given| given.irradiance.is_none()).ok_or_else(|| {
            let found = "no direction of the sun without an irradiance of its own".into();
            bad("sky", found, "add --sun x,y,z or --sun-at LAT,LON,TIME, without =E")
        })?;
        let direction = place.direction(up, north)?;
        let time = place.time()?;
        let sun_zenith = angle_between(up, direction);
        let light = SolarIrradiance {
            direct_normal: self.direct_normal,
            diffuse_horizontal: self.diffuse_horizontal,
            sun_zenith,
            extraterrestrial: time.map_or(SolarIrradiance::SOLAR_CONSTANT, |time| {
                SolarIrradiance::extraterrestrial_on(time.ordinal())
            }),
        };
        let efficacy = match self.is_photometric {
            true => light.efficacy(self.dew_point),
            false => LuminousEfficacy { direct: 1.0, diffuse: 1.0 },
        };
        let irradiance = Rgb::splat(self.direct_normal * efficacy.direct);
        let sun = Some(Sun { direction, irradiance });
        let Some(distribution) = light.distribution() else {
            return Ok(Resolved { kind: None, zenith: Rgb::ONE, sun });
        };
        let relative = Sky::new(distribution, Rgb::ONE, up, direction)?.irradiance(up).x;
        let diffuse = self.diffuse_horizontal * efficacy.diffuse;
        // One whose zenith is black has no radiance relative to it; then as if uniform.
        let (kind, zenith) = match relative > 0.0 {
            true => {
                (Kind::Perez(light.clearness().min(12.01), light.brightness()), diffuse / relative)
            }
            false => (Kind::Cie(5), diffuse / PI),
        };
        Ok(Resolved { kind: Some(kind), zenith: Rgb::splat(zenith), sun })
    }
}
