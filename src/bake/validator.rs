//! Validation of an estimated error by paths: an unbiased measurement at random points.
//!
//! Gathers at random points show how far vertices differ from their sources. If the sources have an
//! error, no gather of them shows it. Paths do ([`crate::verify`]): their mean has no bias, but
//! noise. So the estimate is clamped to the interval that the measurement leaves open:
//!
//! ```text
//!              ┌──── open ────┐
//!   ──────┼────┼──────┼───────┼─────►  error        v: measured   s: its standard error
//!    estimate  √(v² − 4s² − β) v + s              β: bias of v²
//!         └───►│ clamped
//! ```
//!
//! What clamping adds is a part of its own, the *sources*. Groups use 3 s instead of 2 s, since
//! there are many comparisons. The estimate is lowered only if the relative standard error of the
//! measurement is the smaller one: points that miss rare errors have small v and s. Points and
//! paths are kept for all rounds of a bake.

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

/// Standard errors that the measurement of the whole may be off by.
const SIGMAS: f64 = 2.0;

/// The same of a group: of many, some are off by more than two by chance.
const SIGMAS_PER_GROUP: f64 = 3.0;

/// Minimum of the limits of paths per measurement.
pub(super) const MIN_PATHS: u64 = 1 << 18;

/// Points of a measurement where the time is over, and the paths over all of them: some 0.1 s on
/// two cores, which leave the error of an even light uncertain by a tenth of itself. Plain choice.
const POINTS_AT_ONCE: usize = 256;
const PATHS_AT_ONCE: usize = 1 << 15;

/// Limits of paths per measurement, for `gathers` at vertices by `rays` each: one path per 32 rays;
/// and the same where it is in doubt whether the error is met, at least 2^21, of a second or two.
/// In a gap of 1 cm above a lamp the estimate of a small box was 7 % and its error 17.5 ± 2.1 %,
/// which 128 paths at each of 1024 points leave open, and 1024 do not.
pub(super) fn paths(gathers: u64, rays: u32) -> [u64; 2] {
    let paths = (gathers * u64::from(rays) / 32).max(MIN_PATHS);
    [paths, paths.max(1 << 21)]
}

/// Measures the results of a bake.
pub(super) struct Validator<'a> {
    scene: &'a Scene,
    measure: Measure,
    each_group: bool,
    /// None before the first result.
    verifier: Option<Verifier<'a>>,
    /// Of measurements at once.
    at_once: Option<Verifier<'a>>,
}

/// The light `share` · B + `even` that is nearest to the truth, where a bake has the reflected
/// radiosity B, by the square of the relative error over some points.
#[derive(Clone, Copy, Debug)]
pub(super) struct LinearFit {
    /// In [0, 1].
    pub share: f64,
    /// W/m² per channel.
    pub even: Rgb,
}

impl LinearFit {
    /// By the points that were `measured` and count, without the tail; none if there is no light.
    fn new(measured: &Verification, measure: Measure) -> Option<LinearFit> {
        let floor = measure.floor * measured.mean_reflected;
        let points = measured.points.iter().filter(|point| !point.hidden).map(|point| {
            let size = point.measured.length().max(floor);
            ((1.0 - point.tail) / (size * size), point.solution, point.measured)
        });
        let points: Vec<(f64, Rgb, Rgb)> = points.collect();
        let weights: f64 = points.iter().map(|&(weight, ..)| weight).sum();
        let mean = |of: fn(&(f64, Rgb, Rgb)) -> Rgb| {
            points.iter().map(|point| point.0 * of(point)).sum::<Rgb>() / weights
        };
        let (solution, truth) = (mean(|point| point.1), mean(|point| point.2));
        let (mut common, mut own) = (0.0, 0.0);
        for (weight, s, t) in points {
            common += weight * (s - solution).dot(t - truth);
            own += weight * (s - solution).length_squared();
        }
        let share = if own > 0.0 { (common / own).clamp(0.0, 1.0) } else { 1.0 };
        let even = (truth - share * solution).max(Rgb::ZERO);
        even.is_finite().then_some(LinearFit { share, even })
    }
}

impl<'a> Validator<'a> {
    /// For results of `scene`, with more points where `each_group` is to meet the target.
    pub fn new(scene: &'a Scene, measure: Measure, each_group: bool) -> Validator<'a> {
        Validator { scene, measure, each_group, verifier: None, at_once: None }
    }

    /// The `estimated` error of `light`, clamped to a measurement by as many paths as it takes to
    /// decide whether `error` is met, at most the first of the two limits, or the second where that
    /// is in doubt. `progress` gets the number of points done and in total; if it stops the
    /// measurement, the estimate is unchanged, as in a scene without light, or where next to
    /// nothing is reflected.
    pub fn validate(
        &mut self,
        estimated: EstimatedError,
        light: &GatheredMesh,
        error: Option<f64>,
        [paths, paths_in_doubt]: [u64; 2],
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
                clamp_to_measurement(estimated, &measured)
            }
            _ => estimated,
        }
    }

    /// The `estimated` error of `light` with the whole as it is measured at a few points at once,
    /// plus a standard error, and the best fit to the truth there; unchanged where nothing can be
    /// measured.
    pub fn measured_at_once(
        &mut self,
        mut estimated: EstimatedError,
        light: &GatheredMesh,
    ) -> (EstimatedError, Option<LinearFit>) {
        let settings = Settings { points_per_group: 0, ..self.settings() };
        let verifier = match self.at_once.take() {
            Some(verifier) => Ok(verifier),
            None => Verifier::starting_with(self.scene, settings, POINTS_AT_ONCE, 0),
        };
        let measured = verifier
            .and_then(|verifier| self.at_once.insert(verifier).measure_once(PATHS_AT_ONCE, light));
        match measured {
            Ok(measured) if measured.mean_reflected > negligible_reflection(self.scene) => {
                // The measurement decides.
                estimated.whole.uncertainty = f64::INFINITY;
                let fit = LinearFit::new(&measured, self.measure);
                (clamp_to_measurement(estimated, &measured), fit)
            }
            _ => (estimated, None),
        }
    }

    fn verifier(&mut self) -> Result<&mut Verifier<'a>, Error> {
        let verifier = match self.verifier.take() {
            Some(verifier) => verifier,
            None => {
                // Rare errors take many points of few paths.
                Verifier::starting_with(self.scene, self.settings(), 1024, 16)?
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

    fn vertices(&self) -> usize {
        self.surface.positions.len()
    }
}

/// `estimated` within the interval that `measured` leaves open.
fn clamp_to_measurement(estimated: EstimatedError, measured: &Verification) -> EstimatedError {
    let Some(error) = measured.error else { return estimated };
    let EstimatedError { whole, by_light, groups, mut vertices } = estimated;
    let clamped = ErrorEstimate {
        tail: whole.tail.max(measured.tail.unwrap_or(0.0)),
        ..whole.clamped(error, SIGMAS, measured.bias, measured.paths)
    };
    let growth = if whole.total > 0.0 { clamped.total / whole.total } else { 1.0 };
    vertices.iter_mut().for_each(|error| *error *= growth);
    let of_group = |group: GroupError| {
        let same = measured.groups.iter().find(|other| other.group == group.group as usize);
        let clamped = |other: &MeasuredGroup| {
            let (error, paths) = (other.error?, measured.paths);
            Some(group.estimate.clamped(error, SIGMAS_PER_GROUP, other.bias, paths))
        };
        GroupError { estimate: same.and_then(clamped).unwrap_or(group.estimate), ..group }
    };
    let groups = groups.into_iter().map(of_group).collect();
    EstimatedError { whole: clamped, by_light, groups, vertices }
}

impl ErrorEstimate {
    /// The estimate clamped to `measured` less `sigmas` standard errors and plus one; `bias` is
    /// that of the measured square, and `paths` their number at each point.
    fn clamped(self, measured: Measured, sigmas: f64, bias: f64, paths: usize) -> ErrorEstimate {
        let Measured { value, standard_error } = measured;
        let low = (value.powi(2) - (sigmas * standard_error).powi(2) - bias).max(0.0).sqrt();
        let know_more = standard_error * self.total <= self.uncertainty * value;
        let high = if know_more { value + standard_error } else { f64::INFINITY };
        let clamped = self.total.clamp(low, high);
        if clamped >= self.total {
            let sources = (clamped.powi(2) - self.total.powi(2)).sqrt();
            let is_open = clamped == self.total;
            let uncertainty = if is_open { self.uncertainty } else { standard_error };
            return ErrorEstimate { total: clamped, uncertainty, sources, paths, ..self };
        }
        let share = clamped / self.total;
        ErrorEstimate {
            total: clamped,
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
        let clamped = |value, standard_error| {
            let clamped = parts.clamped(Measured { value, standard_error }, SIGMAS, 0.0, 64);
            let ErrorEstimate { total, mesh, sampling, truncation, unshot, sources, .. } = clamped;
            let squares = [mesh, sampling, truncation, unshot, sources].map(|p| p * p);
            assert!((squares.iter().sum::<f64>().sqrt() - total).abs() < 1e-15, "parts add up");
            total
        };
        // Nothing is known but that it is no more than 0.1.
        assert_eq!(clamped(0.0, 0.1), 0.05);
        assert_eq!(clamped(0.1, 0.06), 0.05);
        assert_eq!(clamped(0.05, 0.01), 0.05);
        // Known exactly.
        assert_eq!(clamped(0.2, 0.0), 0.2);
        assert_eq!(clamped(0.01, 0.0), 0.01);
        // Known to a quarter of itself.
        assert!((clamped(0.1, 0.025) - 0.1 * 0.75f64.sqrt()).abs() < 1e-15);
        assert_eq!(clamped(0.02, 0.005), 0.025);
        // Less than that, where the estimate is known to a quarter of itself too: it stands.
        assert_eq!(clamped(0.02, 0.0051), 0.05);
        assert_eq!(clamped(0.01, 0.02), 0.05);
        // Known to be no more than the noise of what it is relative to.
        let measured = Measured { value: 0.1, standard_error: 0.0 };
        assert_eq!(parts.clamped(measured, SIGMAS, 0.01, 64).total, 0.05);
    }
}
