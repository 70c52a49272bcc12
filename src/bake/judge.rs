//! The estimate of a result held against paths: an unbiased measurement at random points.
//!
//! What random points gather says how far vertices are off from what lit them; where that is itself
//! off, no gather of it tells. Paths do ([`crate::verify`]): their mean has no bias, but noise. So
//! the error that is told is the estimate as far as the paths leave it open, and else theirs:
//!
//! ```text
//!              ┌──── open ────┐
//!   ──────┼────┼──────┼───────┼─────►  error        v: measured   s: its standard error
//!    estimate  √(v² − 4s² − β) v + s              β: how much too large v² is
//!         └───►│ told
//! ```
//!
//! What is told above the estimate is a part of its own, the *sources*: what the vertices gathered
//! from. Groups are many, so that it takes three standard errors there in the place of two. Below
//! the estimate is told only what the paths know better, by the standard error of each as a share
//! of itself: points that have missed what is rare find little, and s with it. Points and paths are
//! kept for all rounds of a bake.

use std::ops::ControlFlow;

use crate::accuracy::Measure;
use crate::bake::error_estimate::{ErrorEstimate, GroupError};
use crate::bake::estimator::{EstimatedError, negligible_reflection};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::scene::{Rgb, Scene};
use crate::verify::{
    Estimate as Measured, GroupError as MeasuredGroup, Limits, Progress, Settings, Solution,
    SurfacePoint, Verification, Verifier,
};

/// Standard errors that a measurement may be off by: of the whole, and of one of many groups, of
/// which some are off by more than two by chance.
const SURELY: f64 = 2.0;
const SURELY_OF_MANY: f64 = 3.0;

/// Paths that a result is measured by, at least.
pub(super) const MIN_PATHS: u64 = 1 << 18;

/// Paths that a result is measured by, at most, for `gathers` at vertices by `rays` each: one per 32
/// rays; and the same where it is in doubt whether the error is met, at least 2^21, of a second or
/// two. In a gap of 1 cm above a lamp the estimate of a small box was 7 % and its error 17.5 ± 2.1 %,
/// which 128 paths at each of 1024 points leave open, and 1024 do not.
pub(super) fn paths(gathers: u64, rays: u32) -> [u64; 2] {
    let paths = (gathers * u64::from(rays) / 32).max(MIN_PATHS);
    [paths, paths.max(1 << 21)]
}

/// Measures the results of a bake.
pub(super) struct Judge<'a> {
    scene: &'a Scene,
    measure: Measure,
    each_group: bool,
    /// None before the first result.
    verifier: Option<Verifier<'a>>,
}

impl<'a> Judge<'a> {
    /// Of results for `scene`, with more points where `each_group` is judged.
    pub fn new(scene: &'a Scene, measure: Measure, each_group: bool) -> Judge<'a> {
        Judge { scene, measure, each_group, verifier: None }
    }

    /// `found`, the estimate of `light`, held against paths: so many that it is known whether
    /// `error` is met, but no more than the first of `paths` in all, or the second where that is in
    /// doubt. `progress` is told how many points are done of how many; if it stops the measurement,
    /// the estimate stays as it is. So it does where nothing can be measured: in a scene without
    /// light, or where next to nothing is reflected.
    pub fn judge(
        &mut self,
        found: EstimatedError,
        light: &GatheredMesh,
        (error, [paths, paths_in_doubt]): (Option<f64>, [u64; 2]),
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> EstimatedError {
        let limits = Limits {
            error,
            each_group: self.each_group,
            paths: Some(paths),
            paths_in_doubt: Some(paths_in_doubt),
        };
        let mut stopped = false;
        let measured = self.verifier().and_then(|verifier| {
            verifier.measure_within(limits, light, &mut |p: &Progress| {
                let flow = progress(p.done, p.of);
                stopped |= flow.is_break();
                flow
            })
        });
        match measured {
            Ok(measured)
                if !stopped && measured.mean_reflected > negligible_reflection(self.scene) =>
            {
                held_against(found, &measured)
            }
            _ => found,
        }
    }

    fn verifier(&mut self) -> Result<&mut Verifier<'a>, Error> {
        let verifier = match self.verifier.take() {
            Some(verifier) => verifier,
            None => {
                // Rare errors take many points of few paths.
                Verifier::starting_with(self.scene, self.settings(), (1024, 16))?
            }
        };
        Ok(self.verifier.insert(verifier))
    }

    fn settings(&self) -> Settings {
        Settings {
            // Other points than those of a later measurement.
            seed: 0x7261_6469_6f73,
            measure: self.measure,
            precision: 0.1,
            points_per_group: if self.each_group { 64 } else { 2 },
            time: None,
            ..Settings::default()
        }
    }
}

impl Solution for GatheredMesh {
    fn reflected(&self, scene: &Scene, point: &SurfacePoint) -> Option<Rgb> {
        let (surface, t) = (&self.surface, point.triangle);
        let place = surface.face_at(&self.mesh, t, scene.barycentric(t, point.position))?;
        Some(surface.reflected_at(scene, t, &place))
    }

    fn places(&self) -> usize {
        self.surface.positions.len()
    }
}

/// `found` where `measured` leaves it open.
fn held_against(found: EstimatedError, measured: &Verification) -> EstimatedError {
    let EstimatedError { whole, by_light, groups, mut vertices } = found;
    let Some(error) = measured.error else {
        return EstimatedError { whole, by_light, groups, vertices };
    };
    let told = whole.held_against(error, SURELY, (measured.bias, measured.paths));
    let told = ErrorEstimate { tail: told.tail.max(measured.tail.unwrap_or(0.0)), ..told };
    let growth = if whole.total > 0.0 { told.total / whole.total } else { 1.0 };
    vertices.iter_mut().for_each(|error| *error *= growth);
    let of_group = |group: GroupError| {
        let same = measured.groups.iter().find(|other| other.group == group.group as usize);
        let hold = |other: &MeasuredGroup| {
            let paths = (other.bias, measured.paths);
            Some(group.estimate.held_against(other.error?, SURELY_OF_MANY, paths))
        };
        GroupError { estimate: same.and_then(hold).unwrap_or(group.estimate), ..group }
    };
    let groups = groups.into_iter().map(of_group).collect();
    EstimatedError { whole: told, by_light, groups, vertices }
}

impl ErrorEstimate {
    /// The estimate as far as `measured` leaves it open, which is off by up to `surely` standard
    /// errors: by so many `paths` a point, and with a square that is too large by about `bias`.
    fn held_against(
        self,
        measured: Measured,
        surely: f64,
        (bias, paths): (f64, usize),
    ) -> ErrorEstimate {
        let Measured { value, standard_error } = measured;
        let low = (value.powi(2) - (surely * standard_error).powi(2) - bias).max(0.0).sqrt();
        let know_more = standard_error * self.total <= self.uncertainty * value;
        let high = if know_more { value + standard_error } else { f64::INFINITY };
        let told = self.total.clamp(low, high);
        if told >= self.total {
            let sources = (told.powi(2) - self.total.powi(2)).sqrt();
            let is_open = told == self.total;
            let uncertainty = if is_open { self.uncertainty } else { standard_error };
            return ErrorEstimate { total: told, uncertainty, sources, paths, ..self };
        }
        let share = told / self.total;
        ErrorEstimate {
            total: told,
            uncertainty: standard_error,
            mesh: share * self.mesh,
            sampling: share * self.sampling,
            truncation: share * self.truncation,
            unshot: share * self.unshot,
            paths,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_stand_where_paths_leave_them_open() {
        let uncertainty = 0.0125;
        let parts = ErrorEstimate {
            total: 0.05,
            uncertainty,
            mesh: 0.03,
            sampling: 0.04,
            ..Default::default()
        };
        let told = |value, standard_error| {
            let told = parts.held_against(Measured { value, standard_error }, SURELY, (0.0, 64));
            let ErrorEstimate { total, mesh, sampling, truncation, unshot, sources, .. } = told;
            let squares = [mesh, sampling, truncation, unshot, sources].map(|p| p * p);
            assert!((squares.iter().sum::<f64>().sqrt() - total).abs() < 1e-15, "parts add up");
            total
        };
        // Nothing is known but that it is no more than 0.1.
        assert_eq!(told(0.0, 0.1), 0.05);
        assert_eq!(told(0.1, 0.06), 0.05);
        assert_eq!(told(0.05, 0.01), 0.05);
        // Known exactly.
        assert_eq!(told(0.2, 0.0), 0.2);
        assert_eq!(told(0.01, 0.0), 0.01);
        // Known to a quarter of itself.
        assert!((told(0.1, 0.025) - 0.1 * 0.75f64.sqrt()).abs() < 1e-15);
        assert_eq!(told(0.02, 0.005), 0.025);
        // Less than that, where the estimate is known to a quarter of itself too: it stands.
        assert_eq!(told(0.02, 0.0051), 0.05);
        assert_eq!(told(0.01, 0.02), 0.05);
        // Known to be no more than the noise of what it is relative to.
        let measured = Measured { value: 0.1, standard_error: 0.0 };
        assert_eq!(parts.held_against(measured, SURELY, (0.01, 64)).total, 0.05);
    }
}
