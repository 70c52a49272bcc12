//! One dial: an accuracy, or a time, and everything else follows.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::backend::Backend;
use crate::bake::settings::BakeSettings;
use crate::bake::{BakeProgress, BakeResult, Goal};
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

/// An accuracy to be reached.
pub struct Accuracy<'a> {
    /// Root mean square error of vertex radiosity over the area, as a share of it, in (0, 1).
    pub error: f64,
    /// What is to be set by hand, after everything else was chosen.
    pub adjust: &'a dyn Fn(&mut BakeSettings),
}

impl Accuracy<'_> {
    /// Bakes `scene` until the estimated error is well below the one asked for; or, where it will not
    /// fall any further, as far as it goes: see [`BakeResult::certificate`]. `progress` may stop it at any
    /// time: what was reached is returned.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for an error outside (0, 1) or an adjusted setting out of range;
    /// [`ErrorKind::Device`] and [`ErrorKind::Memory`] when the device cannot even start. One that
    /// fails later is in [`BakeResult::failure`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        device: &Backend,
        mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        if !(self.error > 0.0 && self.error < 1.0) {
            let place = format!("error {}", self.error);
            let remedy = "ask for a share above 0 and below 1, such as 0.02";
            return Err(Error::new(ErrorKind::Setting, place, "out of range", remedy));
        }
        let scene = scene.into();
        let mut effort = BakeSettings::for_error(self.error, &scene);
        (self.adjust)(&mut effort);
        effort.bake_until(&scene, device, &Goal::Error(self.error, self.adjust), &mut progress)
    }
}

/// A time to be used well.
pub struct Budget<'a> {
    /// Seconds of wall time.
    pub seconds: f64,
    /// What is to be set by hand, after everything else was chosen.
    pub adjust: &'a dyn Fn(&mut BakeSettings),
}

/// The first accuracy to be tried, which takes little.
const FIRST: f64 = 0.2;

/// An accuracy that is so many times finer takes that many times, to this power, as long.
const COST: f64 = 1.5;

/// Share of the time left that the next accuracy is chosen for: what it will take is a guess.
const PRUDENCE: f64 = 0.5;

/// Less than this much finer is not worth a start from nothing.
const WORTHWHILE: f64 = 1.3;

impl Budget<'_> {
    /// Bakes `scene` to one accuracy after the other, each chosen by how long the one before took,
    /// for as long as another fits in. What did not get done in time is stopped, and the last that
    /// did is returned; if none did, what was reached. No state is saved ([`BakeSettings::state`]): it would
    /// be that of many solves.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] for a time that is not above 0; else those of [`Accuracy::bake`].
    pub fn bake(
        &self,
        scene: impl Into<Arc<Scene>>,
        device: &Backend,
        mut progress: impl FnMut(&BakeProgress) -> ControlFlow<()>,
    ) -> Result<BakeResult, Error> {
        let limit = Duration::try_from_secs_f64(self.seconds).ok().filter(|d| !d.is_zero());
        let Some(limit) = limit else {
            let place = format!("{} seconds", self.seconds);
            let remedy = "give a time above 0";
            return Err(Error::new(ErrorKind::Setting, place, "not a time to work in", remedy));
        };
        let (start, scene) = (Instant::now(), scene.into());
        let (mut best, mut error) = (None, FIRST);
        let adjust = |effort: &mut BakeSettings| {
            (self.adjust)(effort);
            effort.state = None;
        };
        loop {
            let (begun, mut late, mut stopped) = (Instant::now(), false, false);
            let baked = Accuracy { error, adjust: &adjust }.bake(scene.clone(), device, |p| {
                stopped |= progress(p).is_break();
                late |= start.elapsed() >= limit;
                if stopped || late { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            let baked = match (baked, best) {
                (Err(error), Some(best)) if error.is_device_error() => {
                    return Ok(BakeResult { failure: Some(error), ..best });
                }
                (baked, last) => {
                    best = last;
                    baked?
                }
            };
            if stopped || late {
                return Ok(best.unwrap_or(baked));
            }
            best = Some(baked);
            let left = limit.saturating_sub(start.elapsed()).as_secs_f64();
            let finer = (PRUDENCE * left / begun.elapsed().as_secs_f64()).powf(1.0 / COST);
            if finer < WORTHWHILE {
                break;
            }
            error /= finer;
        }
        Ok(best.expect("one is done"))
    }
}
