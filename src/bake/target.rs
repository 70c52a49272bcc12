//! What is asked of a bake: an error, or a time. All settings follow from it.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use crate::backend::Backend;
use crate::bake::controller::ErrorTarget;
use crate::bake::in_time::bake_in_time;
use crate::bake::progress::BakeProgress;
use crate::bake::result::BakeResult;
use crate::bake::settings::BakeSettings;
use crate::bake::to_error::bake_to_error;
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;
use crate::visibility::lit_sides;

/// What is asked of a bake.
///
/// ```no_run
/// # use std::ops::ControlFlow;
/// # use radiosity::{Backend, BakeTarget, load_scene};
/// # fn main() -> Result<(), radiosity::Error> {
/// let scene = load_scene("scenes/cornell_box.obj")?;
/// let baked = BakeTarget::Error(0.02).bake(scene, &Backend::Cpu, |_| ControlFlow::Continue(()))?;
/// println!("{:.1} % off, by estimate", 100.0 * baked.estimate.total);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum BakeTarget {
    /// Root mean square error of the reflected radiosity over the area, as a share of it, in (0,
    /// 1): [`ErrorEstimate`](crate::bake::ErrorEstimate) has the definition. The bake ends when the
    /// estimated error is well below, or where it will not fall any further: see
    /// [`BakeResult::outcome`].
    Error(f64),
    /// The same for every group of the scene, however small its share of the area is.
    ErrorEach(f64),
    /// Wall time, above 0. Vertices gather what is emitted and exchange it, and the bake goes on to
    /// one error after the other, each from the light of the one before; nothing is shot. When the
    /// time is over, what there is comes back with its estimated error. A tenth is left to that
    /// estimate; the time is exceeded where reading the geometry alone takes longer.
    Time(Duration),
    /// An error, but no longer than a wall time: as [`BakeTarget::Time`], ended when this error is
    /// reached. [`BakeResult::outcome`] tells whether it was.
    Within {
        /// As in [`BakeTarget::Error`].
        error: f64,
        /// Whether every group is to have it, as in [`BakeTarget::ErrorEach`].
        each_group: bool,
        /// As in [`BakeTarget::Time`].
        time: Duration,
    },
}

impl BakeTarget {
    /// The target [`BakeTarget::Time`], in seconds of wall time.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a time that is not above 0 or not finite.
    pub fn seconds(seconds: f64) -> Result<BakeTarget, Error> {
        let time = Duration::try_from_secs_f64(seconds).ok().filter(|time| !time.is_zero());
        match time {
            Some(time) => Ok(BakeTarget::Time(time)),
            None => Err(not_a_time(seconds)),
        }
    }

    /// Bakes `scene` until the target is met. `progress` may stop it at any time: what was reached
    /// is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an error outside (0, 1) or a time of 0; [`ErrorKind::Scene`] for
    /// light whose squares numbers do not hold; [`ErrorKind::Device`] and [`ErrorKind::Memory`]
    /// when the device cannot even start. One that fails later is in
    /// [`BakeResult::device_failure`].
    pub fn bake(
        self,
        scene: impl Into<Arc<Scene>>,
        backend: &Backend,
        progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        self.bake_with(scene, backend, |_| {}, progress)
    }

    /// As [`BakeTarget::bake`], with some settings made by hand.
    ///
    /// `overrides` is called with all settings whenever the bake has chosen some: once at the start
    /// of a bake to an error, with those of [`BakeSettings::for_error`]; once when the number of
    /// rays was chosen by what a few of them find; and after every estimate above the target, with
    /// those of the next round; within a time for each further error too. It may change any
    /// setting, and must set the same ones to the same values at every call: what it sets stays,
    /// and the bake changes the others. Settings of the solve count at the first call
    /// only, since light is shot once; [`BakeSettings::gather`] may be taken away at the first call
    /// and not later.
    ///
    /// # Errors
    /// Those of [`BakeTarget::bake`], and [`ErrorKind::Setting`] for a setting out of range.
    pub fn bake_with(
        self,
        scene: impl Into<Arc<Scene>>,
        backend: &Backend,
        overrides: impl Fn(&mut BakeSettings),
        mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        let scene = lit_sides::resolved(scene.into());
        check_light(&scene)?;
        match self {
            BakeTarget::Error(error) | BakeTarget::ErrorEach(error) => {
                let each_group = matches!(self, BakeTarget::ErrorEach(_));
                let target = ErrorTarget { error, each_group, overrides: &overrides, within: None };
                bake_to_error(target, scene, backend, &mut progress)
            }
            BakeTarget::Time(time) => {
                check_time(time)?;
                bake_in_time(time, None, scene, backend, &overrides, &mut progress)
            }
            BakeTarget::Within { error, each_group, time } => {
                check_time(time)?;
                let goal = ErrorTarget { error, each_group, overrides: &overrides, within: None };
                bake_in_time(time, Some(goal), scene, backend, &overrides, &mut progress)
            }
        }
    }
}

fn check_time(time: Duration) -> Result<(), Error> {
    if time.is_zero() { Err(not_a_time(0.0)) } else { Ok(()) }
}

fn not_a_time(seconds: f64) -> Error {
    let place = format!("{seconds} seconds");
    Error::new(ErrorKind::Setting, place, "not a time to work in", "give a time above 0")
}

/// Checks that squares of the brightest light of `scene` in any channel, and their sums, are in the
/// range of numbers.
fn check_light(scene: &Scene) -> Result<(), Error> {
    let surfaces = (0..scene.triangles().len()).map(|t| scene.exitance(t).max_element());
    let sun = scene.sky().sun().map_or(0.0, |sun| sun.irradiance.max_element());
    let brightest = surfaces.fold(scene.sky().brightest().max(sun), f64::max);
    if brightest == 0.0 || (1e-32..=1e32).contains(&brightest) {
        return Ok(());
    }
    let found = format!("the brightest is {brightest:e}");
    let remedy = "give all light in a unit in which it is between 1e-32 and 1e32";
    Err(Error::new(ErrorKind::Scene, "light", found, remedy))
}
