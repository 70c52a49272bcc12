//! The light of a scene for commands that measure in it: how far it is baked, and by what.

use std::cell::Cell;
use std::path::Path;

use radiosity::{Backend, BakeResult, BakeTarget, Error, Scene, Solver};

use crate::args::{self, Device, Stop};
use crate::scene_options::SceneOptions;
use crate::{interrupt, progress};

/// Help on what is taken.
macro_rules! light_usage {
    () => {
        "\
\x20 --error X         how far off what is measured may be, root mean square, as a share: 0.05 for
                    5 % [0.05]
  --adapter NAME    a graphics adapter with NAME in its name; WGPU_ADAPTER_NAME does the same
  --cpu             rays on the CPU instead of hemicubes
  --sky, --sun, --emit, --transmit, --sides, --specular, --max-reflectance, --strict, …
                    what the scene is and what lights it: as in `radiosity bake --help`"
    };
}
pub(crate) use light_usage;

/// Error of the light over that of what is measured in it: what vertices are off by is averaged
/// over all that a point sees. That of a gather pass over the next one's, as in a bake.
const LIGHT_COARSENING: f64 = 3.0;

/// Error of the light at most: what is missed altogether is not averaged. Chosen by hand.
const MAX_LIGHT_ERROR: f64 = 0.3;

/// Noise of what is measured over its error. Chosen by hand.
const NOISE_SHARE: f64 = 0.5;

/// What is said of the light.
pub struct LightOptions {
    pub reading: SceneOptions,
    error: f64,
    device: Device,
}

/// Light, and the device that it came from.
pub struct Light {
    pub baked: BakeResult,
    pub device: Backend,
}

impl LightOptions {
    pub fn new() -> LightOptions {
        LightOptions { reading: SceneOptions::default(), error: 0.05, device: Device::Gpu(None) }
    }

    /// Takes option `name` with its value, if it is one of these.
    pub fn option(&mut self, name: &str, parser: &mut lexopt::Parser) -> Result<bool, Stop> {
        match name {
            "error" => self.error = args::value(parser, "error", "a share, such as 0.1 for 10 %")?,
            "adapter" => self.device = Device::named(parser)?,
            "cpu" => self.device = Device::Cpu,
            _ => return self.reading.option(name, parser),
        }
        Ok(true)
    }

    /// How far off what is measured may be, as a share.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// The noise that what is measured may have, as a share of it.
    pub fn noise(&self) -> f64 {
        (NOISE_SHARE * self.error).min(1.0)
    }

    /// The scene of an OBJ file, its sides resolved, and the user told what is odd about it.
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        let scene = progress::of_reading(path, || {
            Ok::<_, Error>(self.reading.load(path)?.resolve_sides())
        })?;
        self.reading.print_warnings(&scene);
        Ok(scene)
    }

    /// Bakes `scene` as far as it takes. Ctrl-C stops it with what there is.
    pub fn bake(&self, scene: Scene) -> Result<Light, Error> {
        let device = progress::of_stage("opening the device", || self.device.open())?;
        interrupt::catch();
        let error = (LIGHT_COARSENING * self.error).min(MAX_LIGHT_ERROR.max(self.error));
        let unshot = Cell::new(Solver::default().unshot);
        let baked = progress::of_bake(
            || unshot.get(),
            |report| {
                let look = |settings: &mut radiosity::BakeSettings| {
                    unshot.set(settings.solve.solver.unshot);
                };
                BakeTarget::Error(error).bake_with(scene, &device, look, report)
            },
        )?;
        match &baked.device_failure {
            Some(error) => {
                eprintln!("warning: rays on the CPU took the place of the device: {error}");
                Ok(Light { baked, device: Backend::Cpu })
            }
            None => Ok(Light { baked, device }),
        }
    }
}
