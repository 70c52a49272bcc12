//! What is asked of a bake.

use std::collections::BTreeMap;
use std::time::Duration;

use radiosity::backend::AdapterKind;
use radiosity::backend::gpu::Gpu;
use radiosity::glam::DVec3;
use radiosity::io::Input;
use radiosity::{Backend, BakeTarget, Error, ErrorKind, Rgb, Scene, SceneSettings, Sky, Sun};
use serde::Deserialize;

/// See `js/index.d.ts`, which has the same names.
#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "camelCase")]
pub struct Options {
    error: Option<f64>,
    time: Option<f64>,
    each_group: bool,
    emit: BTreeMap<String, Colour>,
    transmit: BTreeMap<String, Colour>,
    sky: Option<Colour>,
    sun: Option<GivenSun>,
    strict: bool,
    device: Device,
}

/// What casts rays: the CPU, a device by WebGPU, or that where it can be opened.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(rename_all = "camelCase")]
enum Device {
    #[default]
    Cpu,
    Gpu,
    Auto,
}

/// A number for all channels, or three.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
enum Colour {
    Grey(f64),
    Rgb([f64; 3]),
}

impl From<Colour> for Rgb {
    fn from(colour: Colour) -> Rgb {
        match colour {
            Colour::Grey(value) => Rgb::splat(value),
            Colour::Rgb(channels) => Rgb::from_array(channels),
        }
    }
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct GivenSun {
    direction: [f64; 3],
    irradiance: Colour,
}

impl Options {
    /// From JSON.
    pub fn parse(text: &str) -> Result<Options, Error> {
        serde_json::from_str(text).map_err(|e| {
            let remedy = "see the types of the package for what they can be";
            Error::new(ErrorKind::Setting, "options", e.to_string(), remedy)
        })
    }

    /// The scene of a file, by these options.
    pub fn scene(&self, file: Input<'_>) -> Result<Scene, Error> {
        let mut settings = SceneSettings::default();
        let colours = |of: &BTreeMap<String, Colour>| {
            of.iter().map(|(name, colour)| (name.clone(), Rgb::from(*colour))).collect()
        };
        (settings.emit, settings.transmit) = (colours(&self.emit), colours(&self.transmit));
        settings.strict = self.strict;
        settings.sky = match (self.sky, self.sun) {
            (Some(sky), _) => Some(Rgb::from(sky).into()),
            (None, Some(_)) => Some(Sky::default()),
            (None, None) => None,
        };
        let scene = settings.load(file)?;
        let Some(GivenSun { direction, irradiance }) = self.sun else { return Ok(scene) };
        let sun = Sun { direction: DVec3::from_array(direction), irradiance: irradiance.into() };
        let sky = scene.sky().clone().with_sun(sun)?;
        scene.with_sky(sky)
    }

    /// What casts rays, and why that is not the device that was wanted.
    pub fn backend(&self) -> Result<(Backend, Option<Error>), Error> {
        match self.device {
            Device::Cpu => Ok((Backend::Cpu, None)),
            Device::Gpu => Ok((gpu()?, None)),
            Device::Auto => Ok(gpu().map_or_else(|e| (Backend::Cpu, Some(e)), |gpu| (gpu, None))),
        }
    }

    /// How far to bake: to 5 % if nothing is said.
    pub fn target(&self) -> Result<BakeTarget, Error> {
        let time = self.time.map(|seconds| {
            let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero());
            time.ok_or_else(|| {
                let found = seconds.to_string();
                Error::new(ErrorKind::Setting, "time", found, "give seconds above 0")
            })
        });
        let each_group = self.each_group;
        Ok(match (self.error, time.transpose()?) {
            (None, Some(time)) => BakeTarget::Time(time),
            (Some(error), Some(time)) => BakeTarget::Within { error, each_group, time },
            (error, None) if each_group => BakeTarget::ErrorEach(error.unwrap_or(0.05)),
            (error, None) => BakeTarget::Error(error.unwrap_or(0.05)),
        })
    }
}

/// The browser's device: it casts rays even if it is software.
fn gpu() -> Result<Backend, Error> {
    #[cfg(target_family = "wasm")]
    crate::suspend::allow_waits();
    let gpu = Gpu::new(None)?;
    let is_software = gpu.adapter().kind == AdapterKind::Cpu;
    Ok(Backend::Gpu(if is_software { gpu.assuming(AdapterKind::Other) } else { gpu }))
}
