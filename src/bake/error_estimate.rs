//! The estimated error of a result: statistics of what random points observe.
//!
//! At each point the radiosity that the vertices interpolate to is compared with two independent
//! gathers there, `a` and `b`, and with a gather `c` of the result itself (one more bounce):
//!
//! ```text
//! interpolated − (a+b)/2   mesh + sampling + noise of the two gathers
//!     a − b                noise of one gather, twice: sampling
//!     c − a                what one more gather pass would change: truncation
//! ```
//!
//! All are relative to the radiosity, and averaged over the points as squares. The squared error of
//! mesh and sampling is the first, plus one standard error of that mean, less half the noise; that
//! of truncation continues the change as a geometric series in the mean reflectance. Light not shot
//! is added as if it fell like the ambient term. This file does no gathering: see
//! [`estimator`](super::estimator).

use glam::DVec3;

use crate::bake::model;
use crate::scene::Rgb;
use crate::visibility::buried;

/// An estimate of the error of vertex radiosity: root mean square over the area, relative to the
/// radiosity. The squares of the parts add up to that of the total.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Radiosity is linear over the faces of the mesh, and light is not.
    pub mesh: f64,
    /// Gathers take a finite number of pixels or rays: half the mean squared difference of two
    /// independently rotated gathers.
    pub sampling: f64,
    /// Gathering stops after some passes over all vertices: the change under one more, extrapolated
    /// by the geometric series in the mean reflectance.
    pub truncation: f64,
    /// Light that was not shot, if it fell as evenly as the ambient term.
    pub unshot: f64,
    /// An exact upper bound: no more than this share of all radiosity times area is missing because
    /// it was not shot, in the worst channel.
    pub unshot_bound: f64,
    /// Random points that were used.
    pub samples: usize,
}

/// What was found at a random point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Radiosity that the vertices interpolate to, W/m².
    pub interpolated: Rgb,
    /// The part of it that is emitted, W/m².
    pub emitted: Rgb,
    /// Radiosity by two gathers there, rotated independently, W/m².
    pub gathered: [Rgb; 2],
    /// Radiosity by a gather of the result itself, with the rays of the first, W/m².
    pub next: Rgb,
    /// What the middle of the element may be off by, up to a common factor, W/m².
    pub element_residual: f64,
    /// Whether the surface reflects nothing there, or the point is buried under another surface:
    /// the error there is none, or cannot be known.
    pub excluded: bool,
    /// Share of the hemisphere in which nothing is seen.
    pub escaped: f64,
    /// Share in which back faces are seen.
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, per scene unit.
    pub inverse_distance: f64,
}

/// What is known of the scene and of the solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conditions {
    /// See [`radiosity_floor`], W/m².
    pub radiosity_floor: f64,
    /// Mean distance below which a dim or hidden point is in a gap, scene unit.
    pub gap: f64,
    /// Mean reflectance over the area, of the channel in which it is highest.
    pub mean_reflectance: f64,
    /// Times that all vertices have gathered; none if the light is that of the elements.
    pub gather_passes: Option<u32>,
    /// Root mean square of the ambient term over the radiosity it falls on.
    pub ambient: f64,
    /// See [`ErrorEstimate::unshot_bound`].
    pub unshot_bound: f64,
}

/// How the error is spread over the vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ErrorSpread {
    /// Error of the mesh per element residual.
    pub per_residual: f64,
    /// Relative error of all other parts, the same everywhere.
    pub even: f64,
}

/// A point's observation, relative to the radiosity there.
struct Deviation {
    /// Of the interpolated radiosity from the gathered one.
    interpolation: DVec3,
    /// Squared noise of one gather.
    noise: f64,
    /// Change under one more pass.
    next: DVec3,
    /// Squared element residual.
    residual: f64,
}

/// Radiosity below which errors are relative to this instead, W/m²: a share of the mean reflected
/// radiosity. What is darker is not worth most of the elements.
pub(super) fn radiosity_floor(reflected: impl ExactSizeIterator<Item = Rgb>) -> f64 {
    let count = reflected.len().max(1) as f64;
    let sum = reflected.map(glam::DVec3::length).sum::<f64>();
    (model::RADIOSITY_FLOOR * sum / count).max(f64::MIN_POSITIVE)
}

/// The error by what was observed at random points, spread evenly over the area.
pub(super) fn estimate(
    observations: &[Observation],
    conditions: &Conditions,
) -> (ErrorEstimate, ErrorSpread) {
    let deviations: Vec<Deviation> =
        observations.iter().filter_map(|o| o.deviation(conditions)).collect();
    let used = deviations.len().max(1) as f64;
    // Of points that reflect nothing all is known: their error is none.
    let share = used / observations.len().max(1) as f64;
    let (interpolation, sampling) = interpolation_and_sampling(&deviations);
    let mesh = interpolation - sampling;
    let unshot = unshot(observations, conditions) / share.max(1e-30);
    // Light that was not shot is a part of what one more pass would change.
    let truncation = (truncation(&deviations, conditions) - unshot).max(0.0);
    let residual = mean(&deviations, |d| d.residual);
    let estimate = ErrorEstimate {
        total: ((interpolation + truncation + unshot) * share).sqrt(),
        mesh: (mesh * share).sqrt(),
        sampling: (sampling * share).sqrt(),
        truncation: (truncation * share).sqrt(),
        unshot: (unshot * share).sqrt(),
        unshot_bound: conditions.unshot_bound,
        samples: observations.len(),
    };
    let spread = ErrorSpread {
        per_residual: (mesh / residual.max(1e-30)).sqrt(),
        even: (sampling + truncation + unshot).sqrt(),
    };
    (estimate, spread)
}

impl Observation {
    /// The observation relative to the radiosity; none where there is no judging it.
    fn deviation(&self, conditions: &Conditions) -> Option<Deviation> {
        if self.excluded {
            return None;
        }
        let floor = conditions.radiosity_floor;
        let [first, second] = self.gathered;
        let truth = (first + second) / 2.0;
        let dim_or_behind = truth.length() < floor || self.backface > buried::HIDDEN_SAMPLE;
        if dim_or_behind && self.inverse_distance * conditions.gap > 1.0 {
            return None;
        }
        let scale = truth.length().max(self.interpolated.length()).max(floor);
        Some(Deviation {
            interpolation: (self.interpolated - truth) / scale,
            noise: ((first - second) / scale).length_squared() / 2.0,
            next: (self.next - first) / scale,
            residual: (self.element_residual / scale).powi(2),
        })
    }
}

fn mean(deviations: &[Deviation], value: impl Fn(&Deviation) -> f64) -> f64 {
    deviations.iter().map(value).sum::<f64>() / deviations.len().max(1) as f64
}

/// Squared error of mesh and sampling together, and of sampling alone.
fn interpolation_and_sampling(deviations: &[Deviation]) -> (f64, f64) {
    let count = deviations.len().max(1) as f64;
    let noise = mean(deviations, |d| d.noise);
    let squares = mean(deviations, |d| d.interpolation.length_squared());
    // The largest errors are at rare points: one standard error of the mean is added to it.
    let variance = mean(deviations, |d| (d.interpolation.length_squared() - squares).powi(2));
    let squares = squares + (variance / count).sqrt();
    let interpolation = (squares - model::HALF * noise).max(model::MIN_ERROR_SHARE * squares);
    let sampling = (model::HALF * noise).min(model::MAX_SAMPLING_SHARE * interpolation);
    (interpolation, sampling)
}

/// Squared error of stopping after some passes.
fn truncation(deviations: &[Deviation], conditions: &Conditions) -> f64 {
    let gathered = conditions.gather_passes.is_some();
    // The elements' own light is changed by a first pass to what was gathered at the points.
    let change = |d: &Deviation| if gathered { d.next } else { -d.interpolation };
    let count = deviations.len().max(1) as f64;
    let bias = deviations.iter().map(change).sum::<DVec3>() / count;
    let reflectance = conditions.mean_reflectance;
    let series = bias.length() / (1.0 - reflectance);
    if gathered {
        // Both gathers cast the same rays, so that their difference has little noise.
        mean(deviations, |d| (change(d) - bias).length_squared()) + series * series
    } else {
        (series * reflectance).powi(2)
    }
}

/// Squared error of light that was not shot, over all points: each gather pass keeps the share of
/// it that is reflected and does not escape.
fn unshot(observations: &[Observation], conditions: &Conditions) -> f64 {
    let escaped = observations.iter().map(|o| o.escaped).sum::<f64>();
    let escaped = escaped / observations.len().max(1) as f64;
    let passed = match conditions.gather_passes {
        Some(passes) => (conditions.mean_reflectance * (1.0 - escaped)).powi(passes as i32),
        None => 1.0,
    };
    (conditions.ambient * passed).powi(2)
}

#[cfg(test)]
mod tests;
