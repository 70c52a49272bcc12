//! The estimated error of a result: statistics of what random points observe.
//!
//! The measure is that of [`accuracy`](crate::accuracy).
//!
//! **How it is estimated.** At each point the reflected radiosity that the vertices interpolate to
//! is compared with two independent gathers there, `a` and `b`, and with a gather `c` of the result
//! itself (one more bounce):
//!
//! ```text
//! interpolated − (a+b)/2   mesh + sampling + noise of the two gathers
//!     a − b                noise of one gather, twice: sampling
//!     c − a                what one more bounce would change: truncation
//! ```
//!
//! Points are spread over the groups as well as the area: each group is a stratum, and means are
//! those of the strata, weighted by area. Within a stratum there are more points where errors are
//! expected, each with the area that it stands for as its weight. The points with the largest
//! squares are the tail; all that follows is over the others. The squared error of mesh and
//! sampling is the first, plus one standard error of that mean, less half the noise. Truncation is
//! the change of all further bounces: the next one times a growth that paths through the change
//! find, since light that is off in a gap of bright walls stays there. Light not shot is added as
//! if it fell like the ambient term. This file does no gathering: see
//! [`estimator`](super::estimator). Where the light that is gathered is itself off, no gather shows
//! it; the [`validator`](super::validator) has paths for that.

use glam::DVec3;

use crate::accuracy::tail::{Trimmed, trimmed};
use crate::scene::Rgb;

/// Variance of the mean of two gathers over that of one, and of the linear interpolant between
/// three vertices of independent errors over that of one of them (∫ Σ λᵢ² over a triangle = 1/2).
pub(super) const AVERAGED_VARIANCE: f64 = 0.5;

/// An estimate of the error of vertex radiosity.
///
/// By the measure of [`accuracy`](crate::accuracy), over all surfaces that reflect or those of one
/// group. The squares of the parts add up to that of the total.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Standard error of the total, by the scatter of the random points.
    pub uncertainty: f64,
    /// Root mean square over the tail, which the total leaves out.
    pub tail: f64,
    /// Radiosity is linear over the faces of the mesh, and light is not.
    pub mesh: f64,
    /// Gathers take a finite number of pixels or rays: half the mean squared difference of two
    /// independently rotated gathers.
    pub sampling: f64,
    /// Gathering stops after some bounces: what all further ones would add.
    pub truncation: f64,
    /// Light that was not shot, if it fell as evenly as the ambient term.
    pub unshot: f64,
    /// What the vertices gathered from is off: the error that paths find at random points beyond
    /// all other parts, where elements blur light that gets on from there.
    pub sources: f64,
    /// An upper bound: no more than this share of all radiosity times area is missing because it
    /// was not shot, in the worst channel.
    pub unshot_bound: f64,
    /// Random points that were used.
    pub samples: usize,
    /// Paths by which the error was measured at each of some more; none if it was not.
    pub paths: usize,
}

impl ErrorEstimate {
    /// What is left of it for whatever gathers this light anew, as texels do: truncation, unshot
    /// light and sources, about; none of these is made less by finer places.
    pub fn of_light(&self) -> f64 {
        libm::hypot(libm::hypot(self.truncation, self.unshot), self.sources)
    }

    /// That of `samples` points alone: by the rays that gathered there and by the paths, so many,
    /// that corrected what they gathered from.
    pub(crate) fn at_points(
        samples: usize,
        sampling: f64,
        sources: f64,
        paths: usize,
    ) -> ErrorEstimate {
        let total = libm::hypot(sampling, sources);
        ErrorEstimate { total, sampling, sources, samples, paths, ..ErrorEstimate::default() }
    }
}

/// The estimated error of one group of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct GroupError {
    /// The group, as an index of [`Scene::groups`](crate::Scene::groups).
    pub group: u32,
    /// Its share of the area that reflects.
    pub area_share: f64,
    /// The error over its area. [`ErrorEstimate::unshot_bound`] is that of the scene.
    pub estimate: ErrorEstimate,
    /// Share of the squared errors of the scene's tail that is on the group.
    pub tail_share: f64,
}

/// Gathers at a random point of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Observation {
    /// Index of the stratum that the point stands for.
    pub stratum: usize,
    /// Area that the point stands for, up to a factor that is the same for all of the stratum.
    pub weight: f64,
    /// Reflected radiosity that the vertices interpolate to, W/m².
    pub interpolated: Rgb,
    /// Reflected radiosity by two gathers there, rotated independently, W/m².
    pub gathered: [Rgb; 2],
    /// Reflected radiosity by a gather of the result itself, with the rays of the first, W/m².
    pub next: Rgb,
    /// What all bounces after that would add, W/m²: without bias, and with noise.
    pub later: Rgb,
    /// What the middle of the element may be off by, up to a common factor, W/m².
    pub element_residual: f64,
    /// Whether the point is hidden by what touches its surface or encloses it, so that nobody sees
    /// it, or sees next to nothing itself.
    pub excluded: bool,
    /// Share of the hemisphere without surfaces.
    pub escaped: f64,
}

/// A part of the surfaces that reflect, over which points are spread evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stratum {
    /// The group that it is; none for all the small ones together.
    pub group: Option<u32>,
    /// Length unit squared.
    pub area: f64,
    /// Mean square of the ambient term over the radiosity that it falls on, by area.
    pub ambient: f64,
}

/// Properties of the scene and of the solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conditions<'a> {
    pub strata: &'a [Stratum],
    /// The floor of the measure, and the share of the area that is its tail.
    pub floor: f64,
    pub tail: f64,
    /// Radiosity below which errors are relative to this instead, W/m².
    pub radiosity_floor: f64,
    /// Mean albedo over the area that scatters light, of the channel in which it is highest.
    pub mean_albedo: f64,
    /// Bounces of what was shot that vertices have gathered; none if the light is that of the
    /// elements.
    pub bounces: Option<f64>,
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

/// The estimate of a result.
pub(super) struct Estimate {
    pub whole: ErrorEstimate,
    /// The whole where the light is: with a floor that is relative to the mean radiosity by light
    /// and not by area, below which places weigh less. However much there is of a dark plane, a lit
    /// room on it counts as it does without; in ordinary scenes it is about the whole.
    pub by_light: ErrorEstimate,
    /// The same group by group, in the order of the strata.
    pub groups: Vec<GroupError>,
    pub spread: ErrorSpread,
}

/// A point's observation, relative to the reflected radiosity there.
#[derive(Clone, Copy)]
struct Deviation {
    /// Area that the point stands for, scene unit squared.
    area: f64,
    /// Share of that area that is not in the tail.
    kept: f64,
    /// Of the interpolated radiosity from the gathered one.
    interpolation: DVec3,
    /// Squared noise of one gather.
    noise: f64,
    /// What one more bounce would add.
    next: DVec3,
    /// What all bounces after that would, with noise.
    later: DVec3,
    /// Squared element residual.
    residual: f64,
    /// Reflected radiosity, W/m²: a length over the channels.
    reflected: f64,
    /// What all is relative to: that, or the floor where this is more, W/m².
    scale: f64,
}

/// The deviations of a stratum that has some.
#[derive(Clone)]
struct StratumDeviations {
    stratum: Stratum,
    /// Those of its points that are not excluded.
    deviations: Vec<Deviation>,
}

impl StratumDeviations {
    /// The same by light: points dimmer than `floor` (W/m²) stand for less area in proportion, and
    /// their errors are relative to it.
    fn by_light(&self, floor: f64) -> StratumDeviations {
        let lit = |d: &Deviation| {
            let scale = d.scale / d.reflected.max(floor);
            Deviation {
                area: d.area * (d.reflected / floor).min(1.0),
                interpolation: d.interpolation * scale,
                noise: d.noise * scale * scale,
                next: d.next * scale,
                later: d.later * scale,
                residual: d.residual * scale * scale,
                ..*d
            }
        };
        let deviations = self.deviations.iter().map(lit).collect();
        StratumDeviations { stratum: self.stratum, deviations }
    }

    /// Area of its points, scene unit squared.
    fn area(&self) -> f64 {
        self.deviations.iter().map(|d| d.area).sum()
    }
}

/// The error by what was observed at random points, spread evenly over each stratum.
pub(super) fn estimate(observations: &[Observation], conditions: &Conditions) -> Estimate {
    let mut observed = vec![0.0; conditions.strata.len()];
    let mut all: Vec<StratumDeviations> = conditions
        .strata
        .iter()
        .map(|&stratum| StratumDeviations { stratum, deviations: vec![] })
        .collect();
    for observation in observations {
        observed[observation.stratum] += observation.weight;
        all[observation.stratum].deviations.extend(observation.deviation(conditions));
    }
    for (stratum, observed) in all.iter_mut().zip(observed) {
        let per_weight = if observed > 0.0 { stratum.stratum.area / observed } else { 0.0 };
        stratum.deviations.iter_mut().for_each(|d| d.area *= per_weight);
    }
    all.retain(|stratum| stratum.area() > 0.0);
    let passed = passed_share(observations, conditions);
    let further = FurtherBounces::new(&Means(&all), conditions);
    let parts = |strata: &mut [StratumDeviations], standard_errors: f64| {
        let tail = split_off_tail(strata, &further, conditions.tail);
        parts(strata, further, passed, standard_errors, tail, conditions)
    };
    let lit_floor = lit_floor(&Means(&all), conditions);
    let mut lit: Vec<StratumDeviations> = all.iter().map(|s| s.by_light(lit_floor)).collect();
    lit.retain(|stratum| stratum.area() > 0.0);
    let by_light = parts(&mut lit, 1.0);
    let whole = parts(&mut all, 1.0);
    let area: f64 = all.iter().map(StratumDeviations::area).sum();
    let tails: Vec<f64> = all.iter().map(|stratum| tail_square(stratum, &further)).collect();
    let of_all: f64 = tails.iter().sum();
    let groups = all.iter().zip(tails).filter_map(|(one, tail)| {
        let group = one.stratum.group?;
        let estimate = parts(&mut [one.clone()], 0.0);
        let tail_share = if of_all > 0.0 { tail / of_all } else { 0.0 };
        Some(GroupError { group, area_share: one.area() / area, estimate, tail_share })
    });
    let groups = groups.collect();
    let residual = Means(&all).of(|d| d.residual);
    let even = whole.sampling.powi(2) + whole.truncation.powi(2) + whole.unshot.powi(2);
    let spread =
        ErrorSpread { per_residual: whole.mesh / residual.max(1e-30).sqrt(), even: even.sqrt() };
    Estimate { groups, whole, by_light, spread }
}

/// Splits the points with the largest errors off, a share `tail` of the area; the squared error at
/// the cut.
fn split_off_tail(strata: &mut [StratumDeviations], further: &FurtherBounces, tail: f64) -> f64 {
    let point = |d: &Deviation| (d.area, further.error_square(d));
    let points: Vec<(f64, f64)> =
        strata.iter().flat_map(|s| s.deviations.iter().map(point)).collect();
    let Trimmed { kept, cut } = trimmed(&points, tail);
    let deviations = strata.iter_mut().flat_map(|s| &mut s.deviations);
    deviations.zip(kept).for_each(|(deviation, kept)| deviation.kept = kept);
    cut
}

/// Squared error times area that the points of a stratum have in the tail; without the noise of
/// the gathers, as far as that is known.
fn tail_square(stratum: &StratumDeviations, further: &FurtherBounces) -> f64 {
    let of_point = |d: &Deviation| {
        let square = further.error_square(d) - AVERAGED_VARIANCE * d.noise;
        d.area * (1.0 - d.kept) * square.max(0.0)
    };
    stratum.deviations.iter().map(of_point).sum()
}

/// Mean length of the reflected radiosity that was gathered at the points that are not excluded, by
/// the area that they stand for, W/m²; none if there are no such points.
pub(super) fn mean_reflected(observations: &[Observation], strata: &[Stratum]) -> Option<f64> {
    let mut all = vec![0.0; strata.len()];
    for observation in observations {
        all[observation.stratum] += observation.weight;
    }
    let (mut sum, mut area) = (0.0, 0.0);
    for observation in observations.iter().filter(|observation| !observation.excluded) {
        let of_stratum = strata[observation.stratum].area / all[observation.stratum];
        let [first, second] = observation.gathered;
        sum += observation.weight * of_stratum * (first + second).length() / 2.0;
        area += observation.weight * of_stratum;
    }
    (area > 0.0).then(|| sum / area)
}

/// [`StratumDeviations::by_light`]'s floor, W/m²: as that of the measure, of the mean radiosity
/// that a reflected photon leaves.
fn lit_floor(means: &Means, conditions: &Conditions) -> f64 {
    let (flux, square) = (means.of(|d| d.reflected), means.of(|d| d.reflected.powi(2)));
    let mean = if flux > 0.0 { square / flux } else { 0.0 };
    (conditions.floor * mean).max(f64::MIN_POSITIVE)
}

/// All parts over `strata`, with `standard_errors` added to the squares of the interpolation; the
/// tail is cut off at the square `cut`, and `passed` is the share of the unshot light that bounces
/// keep.
fn parts(
    strata: &[StratumDeviations],
    further: FurtherBounces,
    passed: f64,
    standard_errors: f64,
    cut: f64,
    conditions: &Conditions,
) -> ErrorEstimate {
    let means = Means(strata);
    let noise = means.of(|d| d.noise);
    let square = |d: &Deviation| d.interpolation.length_squared();
    // The largest errors are at rare points.
    let squares = means.of(square) + standard_errors * means.standard_error(cut, square);
    // A difference of two estimates may be negative: a tenth of the squares remains, and of that
    // 0.3 are the mesh's, whose own error noise hides.
    let interpolation = (squares - AVERAGED_VARIANCE * noise).max(0.1 * squares);
    let sampling = (AVERAGED_VARIANCE * noise).min(0.7 * interpolation);
    let mesh = interpolation - sampling;
    let area: f64 = strata.iter().map(StratumDeviations::area).sum();
    let area = area.max(f64::MIN_POSITIVE);
    // Folded from +0: the sum of nothing is -0, which is printed as such.
    let ambient = strata.iter().fold(0.0, |sum, s| sum + s.stratum.ambient * s.area()) / area;
    let unshot = ambient * passed * passed;
    // Light that was not shot is a part of what further bounces add.
    let truncation = (means.of(|d| further.square(d)) - unshot).max(0.0);
    let total = (interpolation + truncation + unshot).sqrt();
    let scatter = means.standard_error(cut, |d| further.error_square(d));
    let tails: f64 = strata.iter().map(|stratum| tail_square(stratum, &further)).sum();
    let tail_area = conditions.tail * area;
    ErrorEstimate {
        total,
        uncertainty: if total > 0.0 { scatter / (2.0 * total) } else { 0.0 },
        tail: if tail_area > 0.0 { (tails / tail_area).sqrt() } else { 0.0 },
        mesh: mesh.sqrt(),
        sampling: sampling.sqrt(),
        truncation: truncation.sqrt(),
        unshot: unshot.sqrt(),
        unshot_bound: conditions.unshot_bound,
        sources: 0.0,
        paths: 0,
        samples: strata.iter().map(|s| s.deviations.len()).sum(),
    }
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
        let scale = truth.length().max(floor);
        Some(Deviation {
            area: self.weight,
            kept: 1.0,
            interpolation: (self.interpolated - truth) / scale,
            noise: ((first - second) / scale).length_squared() / 2.0,
            next: (self.next - first) / scale,
            later: self.later / scale,
            residual: (self.element_residual / scale).powi(2),
            reflected: truth.length(),
            scale,
        })
    }
}

/// Means over strata, by area; without the tail.
struct Means<'a>(&'a [StratumDeviations]);

impl Means<'_> {
    fn deviations(&self) -> impl Iterator<Item = &Deviation> {
        self.0.iter().flat_map(|stratum| &stratum.deviations)
    }

    /// Area that is not in the tail, scene unit squared.
    fn counted(&self) -> f64 {
        self.deviations().map(|d| d.area * d.kept).sum()
    }

    /// Mean of `value`.
    fn of(&self, value: impl Fn(&Deviation) -> f64) -> f64 {
        let sum: f64 = self.deviations().map(|d| d.area * d.kept * value(d)).sum();
        let counted = self.counted();
        if counted > 0.0 { sum / counted } else { 0.0 }
    }

    /// Mean of the vector `value`.
    fn vector(&self, value: impl Fn(&Deviation) -> DVec3) -> DVec3 {
        let axis = |k: usize| self.of(|d| value(d)[k]);
        DVec3::new(axis(0), axis(1), axis(2))
    }

    /// Standard error of the mean of `value`, over points that are independent within each stratum,
    /// with values of the tail winsorised to `cut` (Tukey and McLaughlin 1963).
    fn standard_error(&self, cut: f64, value: impl Fn(&Deviation) -> f64) -> f64 {
        let winsorised = |d: &Deviation| {
            let value = value(d);
            if d.kept < 1.0 { d.kept * value + (1.0 - d.kept) * value.min(cut) } else { value }
        };
        let variance = |s: &StratumDeviations| {
            // A ratio of two sums over random points (Cochran 1977, equation 6.13).
            let sum: f64 = s.deviations.iter().map(|d| d.area * winsorised(d)).sum();
            let middle = sum / s.area();
            let square = |d: &Deviation| (d.area * (winsorised(d) - middle)).powi(2);
            s.deviations.iter().map(square).sum::<f64>()
        };
        let variance: f64 = self.0.iter().map(variance).sum();
        if variance > 0.0 { variance.sqrt() / self.counted() } else { 0.0 }
    }
}

/// What all further bounces add, next to what is known of it at each point.
#[derive(Clone, Copy)]
struct FurtherBounces {
    /// All further bounces over the next one.
    growth: f64,
    /// Square of what they add at every point where no vertices have gathered.
    even: f64,
}

impl FurtherBounces {
    /// For a change that each bounce multiplies by λ, growth is 1/(1 − λ): found as
    /// 1 + ⟨next, later⟩ / ⟨next, next⟩, in which the noise of what is later is averaged. The
    /// elements' own light is off by the mean of what the points gathered, and all that gathers it.
    fn new(means: &Means, conditions: &Conditions) -> FurtherBounces {
        if conditions.bounces.is_none() {
            let albedo = conditions.mean_albedo;
            let series = means.vector(|d| d.interpolation).length() / (1.0 - albedo);
            return FurtherBounces { growth: 1.0, even: (series * albedo).powi(2) };
        }
        let square = means.of(|d| d.next.length_squared());
        let later = means.of(|d| d.next.dot(d.later));
        let growth = if square > 0.0 { 1.0 + (later / square).max(0.0) } else { 1.0 };
        FurtherBounces { growth, even: 0.0 }
    }

    /// Squared, at a point.
    fn square(&self, deviation: &Deviation) -> f64 {
        (self.growth * deviation.next).length_squared() + self.even
    }

    /// Squared error of a point: of what it interpolates, with noise, and of further bounces.
    fn error_square(&self, deviation: &Deviation) -> f64 {
        deviation.interpolation.length_squared() + self.square(deviation)
    }
}

/// Share of the unshot light that is still missing after the bounces: each keeps what is reflected
/// of it and does not escape.
fn passed_share(observations: &[Observation], conditions: &Conditions) -> f64 {
    let escaped = observations.iter().map(|o| o.escaped).sum::<f64>();
    let escaped = escaped / observations.len().max(1) as f64;
    match conditions.bounces {
        Some(bounces) => libm::pow(conditions.mean_albedo * (1.0 - escaped), bounces),
        None => 1.0,
    }
}

#[cfg(test)]
mod tests;
