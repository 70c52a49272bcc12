//! The light of a scene for commands that measure in it: how far it is baked, and by what.

use std::path::Path;

use clap::Args;
use radiosity::{Backend, BakeResult, BakeSettings, BakeTarget, Error, Scene};

use crate::args::{DeviceOptions, SHARE, value};
use crate::progress;
use crate::scene_options::{Input, SceneOptions};

/// The light, and how exact what is measured in it is to be.
#[derive(Args)]
pub struct LightOptions {
    /// Error of values, as a share: 95 % of them are off by less
    #[arg(long, value_name = "SHARE", default_value = "0.05", value_parser = value::<f64>(SHARE))]
    error: f64,
    #[command(flatten)]
    pub reading: SceneOptions,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Light, and the device that it came from.
pub struct Light {
    pub baked: BakeResult,
    pub device: Backend,
}

impl LightOptions {
    /// How far off what is measured may be, as a share.
    pub fn error(&self) -> f64 {
        self.error
    }

    /// Says whether the error that was asked for is reached.
    pub fn print_outcome(&self, is_reached: bool) {
        // In the digits that it was asked in.
        let asked = (100.0 * self.error) as f32;
        match is_reached {
            true => say!("{asked} % reached at 95 % of the points"),
            false => say!("{asked} % missed: some points are off by more; their errors say which"),
        }
    }

    /// The scene of an OBJ file. Prints warnings.
    pub fn scene(&self, path: &Path) -> Result<Scene, Error> {
        self.reading.read(path).map(|Input { scene, .. }| scene)
    }

    /// Bakes `scene` as far as it takes. Ctrl-C stops it with what there is.
    pub fn bake(&self, scene: Scene) -> Result<Light, Error> {
        let device = self.device.open()?;
        // The light may be three times further off than what is measured in it, as one gather pass
        // than the next: errors of vertices are averaged over all that a point sees. Light that is
        // missed altogether is not averaged; hence 0.3 at most. Plain choice.
        let error = (3.0 * self.error).min(self.error.max(0.3));
        let baked = progress::of_bake(|unshot_goal, report| {
            let look = |settings: &mut BakeSettings| unshot_goal.set(settings.solve.solver.unshot);
            BakeTarget::Error(error).bake_with(scene, &device, look, report)
        })?;
        let device = if warn_of_failure(&baked).is_some() { Backend::Cpu } else { device };
        Ok(Light { baked, device })
    }
}

/// Prints the warning that rays on the CPU took the place of the device, if they did.
pub fn warn_of_failure(baked: &BakeResult) -> Option<String> {
    let error = baked.device_failure.as_ref()?;
    let warning = format!("rays on the CPU took the place of the device: {error}");
    eprintln!("warning: {warning}");
    Some(warning)
}
