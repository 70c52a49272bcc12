//! The estimated error of a result: statistics of what random points observe.
//!
//! **The measure.** Over the area of all surfaces that reflect, the root mean square of
//!
//! ```text
//!   e = |B − B_true| / max(|B_true|, floor)      floor: 5 % of the mean of |B_true|
//! ```
//!
//! with B the reflected radiosity (emission is known and has no error) and | | a length over the
//! channels. Surfaces that reflect nothing have neither error nor weight. Places that nobody sees
//! are left out: those that see backs in more than 95 % of their hemisphere, weighted by the
//! cosine, or in more than 40 % of it backs that nearly touch them, or on average nothing but what
//! touches them (a mean of 1/distance above 1e4 over the diagonal). They are inside a solid, under
//! what stands on them, or in a crack. Those that see surfaces in less than 1 % of their hemisphere
//! are left out too: what the sky gives them is exact, and would hide the error of others. The mean
//! is over the same places: a dark plane of a kilometre makes nothing on it brighter. A group has
//! the same figure over its own area, with the floor of the scene.
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
//! expected, each with the area that it stands for as its weight. The squared error of mesh and
//! sampling is the first, plus one standard error of that mean, less half the noise. Truncation is
//! the change of all further bounces: the next one times a growth that paths through the change
//! find, since light that is off in a gap of bright walls stays there. Light not shot is
//! added as if it fell like the ambient term. Dim points that see surfaces nearer than their
//! element is large are a part of their own, the gaps: what no mesh resolves is mostly there. This
//! file does no gathering: see [`estimator`](super::estimator). Where the light that is gathered is
//! itself off, no gather shows it; the [`judge`](super::judge) has paths for that.

use glam::DVec3;

use crate::bake::model;
use crate::gather::refinement_indicator::GAP_DIMNESS;
use crate::scene::Rgb;
use crate::visibility::buried;

/// An estimate of the error of vertex radiosity.
///
/// Over the area of all surfaces that reflect, or those of one group: the root mean square of the
/// error of the reflected radiosity, relative to it, where that counts as no less than 5 % of its
/// mean over the scene. The squares of the parts add up to that of the total.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct ErrorEstimate {
    /// All parts together.
    pub total: f64,
    /// Standard error of the total, since it is found at random points.
    pub uncertainty: f64,
    /// Radiosity is linear over the faces of the mesh, and light is not.
    pub mesh: f64,
    /// The same at dim points that see surfaces nearer than their element is large, in a gap or at
    /// its mouth: light changes there over lengths that a mesh of the whole scene does not resolve.
    pub gaps: f64,
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
        self.truncation.hypot(self.unshot).hypot(self.sources)
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
}

/// What was found at a random point of the surface.
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
    /// Share of the hemisphere in which nothing is seen.
    pub escaped: f64,
    /// Share in which back faces are seen.
    pub backface: f64,
    /// Mean of 1/distance over the hemisphere, per scene unit.
    pub inverse_distance: f64,
    /// Square root of the element's area, scene unit.
    pub size: f64,
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

/// What is known of the scene and of the solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Conditions<'a> {
    pub strata: &'a [Stratum],
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
    /// See [`Observation::weight`].
    weight: f64,
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
    /// Whether the point is in a gap.
    in_gap: bool,
    /// Reflected radiosity, W/m²: a length over the channels.
    reflected: f64,
    /// What all is relative to: that, or the floor where this is more, W/m².
    scale: f64,
}

/// The deviations of a stratum that has some.
struct StratumDeviations {
    stratum: Stratum,
    /// Its area less that of the excluded points.
    area: f64,
    deviations: Vec<Deviation>,
}

impl StratumDeviations {
    /// The same by light: places dimmer than `floor` (W/m²) weigh less in proportion, and their
    /// errors are relative to it.
    fn by_light(&self, floor: f64) -> StratumDeviations {
        let weight = |d: &Deviation| (d.reflected / floor).min(1.0);
        let lit = |d: &Deviation| {
            let scale = d.scale / d.reflected.max(floor);
            Deviation {
                weight: d.weight * weight(d),
                interpolation: d.interpolation * scale,
                noise: d.noise * scale * scale,
                next: d.next * scale,
                later: d.later * scale,
                residual: d.residual * scale * scale,
                ..*d
            }
        };
        let area = self.area * mean(&self.deviations, &weight);
        let deviations = self.deviations.iter().map(lit).collect();
        StratumDeviations { stratum: self.stratum, area, deviations }
    }
}

/// The error by what was observed at random points, spread evenly over each stratum.
pub(super) fn estimate(observations: &[Observation], conditions: &Conditions) -> Estimate {
    let mut observed = vec![0.0; conditions.strata.len()];
    let mut all: Vec<StratumDeviations> = conditions
        .strata
        .iter()
        .map(|&stratum| StratumDeviations { stratum, area: 0.0, deviations: vec![] })
        .collect();
    for observation in observations {
        observed[observation.stratum] += observation.weight;
        all[observation.stratum].deviations.extend(observation.deviation(conditions));
    }
    for (stratum, observed) in all.iter_mut().zip(observed) {
        let used: f64 = stratum.deviations.iter().map(|d| d.weight).sum();
        stratum.area = if used > 0.0 { stratum.stratum.area * used / observed } else { 0.0 };
    }
    all.retain(|stratum| stratum.area > 0.0);
    let passed = passed_share(observations, conditions);
    let further = FurtherBounces::new(&Means(&all), conditions);
    let parts = |strata: &[StratumDeviations], standard_errors: f64| {
        parts(strata, further, passed, standard_errors, conditions)
    };
    let whole = parts(&all, 1.0);
    let lit_floor = lit_floor(&Means(&all));
    let mut lit: Vec<StratumDeviations> = all.iter().map(|s| s.by_light(lit_floor)).collect();
    lit.retain(|stratum| stratum.area > 0.0);
    let by_light = parts(&lit, 1.0);
    let area: f64 = all.iter().map(|stratum| stratum.area).sum();
    let groups = all.iter().filter_map(|one| {
        let group = one.stratum.group?;
        let estimate = parts(std::slice::from_ref(one), 0.0);
        Some(GroupError { group, area_share: one.area / area, estimate })
    });
    let residual = Means(&all).of(|d| d.residual);
    let even = whole.sampling.powi(2) + whole.truncation.powi(2) + whole.unshot.powi(2);
    let spread = ErrorSpread {
        per_residual: whole.mesh.hypot(whole.gaps) / residual.max(1e-30).sqrt(),
        even: even.sqrt(),
    };
    Estimate { groups: groups.collect(), whole, by_light, spread }
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
fn lit_floor(means: &Means) -> f64 {
    let (flux, square) = (means.of(|d| d.reflected), means.of(|d| d.reflected.powi(2)));
    let mean = if flux > 0.0 { square / flux } else { 0.0 };
    (model::RADIOSITY_FLOOR * mean).max(f64::MIN_POSITIVE)
}

/// All parts over `strata`, with so many standard errors added to what scatters most; `passed` is
/// the share of the unshot light that bounces keep.
fn parts(
    strata: &[StratumDeviations],
    further: FurtherBounces,
    passed: f64,
    standard_errors: f64,
    conditions: &Conditions,
) -> ErrorEstimate {
    let means = Means(strata);
    let share_of = |in_gap: bool| {
        let noise = means.of(|d| if d.in_gap == in_gap { d.noise } else { 0.0 });
        let square =
            |d: &Deviation| if d.in_gap == in_gap { d.interpolation.length_squared() } else { 0.0 };
        // The largest errors are at rare points.
        let squares = means.of(square) + standard_errors * means.standard_error(square);
        ((squares - model::HALF * noise).max(model::MIN_ERROR_SHARE * squares), noise)
    };
    let (interpolation, noise) = share_of(false);
    let (gaps, _) = share_of(true);
    let sampling = (model::HALF * noise).min(model::MAX_SAMPLING_SHARE * interpolation);
    let mesh = interpolation - sampling;
    let area: f64 = strata.iter().map(|s| s.area).sum::<f64>().max(f64::MIN_POSITIVE);
    // Folded from +0: the sum of nothing is -0, which is printed as such.
    let ambient = strata.iter().fold(0.0, |sum, s| sum + s.stratum.ambient * s.area) / area;
    let unshot = ambient * passed * passed;
    // Light that was not shot is a part of what further bounces add.
    let truncation = (means.of(|d| further.square(d)) - unshot).max(0.0);
    let total = (interpolation + gaps + truncation + unshot).sqrt();
    let scatter = means.standard_error(|d| d.interpolation.length_squared() + further.square(d));
    ErrorEstimate {
        total,
        uncertainty: if total > 0.0 { scatter / (2.0 * total) } else { 0.0 },
        mesh: mesh.sqrt(),
        gaps: gaps.sqrt(),
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
        let dim_or_behind =
            truth.length() < GAP_DIMNESS * floor || self.backface > buried::NEAR_BACKS;
        let scale = truth.length().max(floor);
        Some(Deviation {
            weight: self.weight,
            interpolation: (self.interpolated - truth) / scale,
            noise: ((first - second) / scale).length_squared() / 2.0,
            next: (self.next - first) / scale,
            later: self.later / scale,
            residual: (self.element_residual / scale).powi(2),
            reflected: truth.length(),
            scale,
            in_gap: dim_or_behind && self.inverse_distance * self.size > 1.0,
        })
    }
}

/// Means over strata, each weighted by its area.
struct Means<'a>(&'a [StratumDeviations]);

impl Means<'_> {
    fn weighted(&self, of_stratum: impl Fn(&StratumDeviations) -> f64) -> f64 {
        let area: f64 = self.0.iter().map(|s| s.area).sum();
        let sum: f64 = self.0.iter().map(|s| s.area * of_stratum(s)).sum();
        if area > 0.0 { sum / area } else { 0.0 }
    }

    /// Mean of `value`.
    fn of(&self, value: impl Fn(&Deviation) -> f64) -> f64 {
        self.weighted(|s| mean(&s.deviations, &value))
    }

    /// Mean of the vector `value`.
    fn vector(&self, value: impl Fn(&Deviation) -> DVec3) -> DVec3 {
        let axis = |k: usize| self.of(|d| value(d)[k]);
        DVec3::new(axis(0), axis(1), axis(2))
    }

    /// Standard error of the mean of `value`, over points that are independent within each stratum.
    fn standard_error(&self, value: impl Fn(&Deviation) -> f64) -> f64 {
        let area: f64 = self.0.iter().map(|s| s.area).sum();
        let variance = |s: &StratumDeviations| {
            // A ratio of two sums over random points (Cochran 1977, equation 6.13).
            let middle = mean(&s.deviations, &value);
            let weight: f64 = s.deviations.iter().map(|d| d.weight).sum();
            let square = |d: &Deviation| (d.weight / weight * (value(d) - middle)).powi(2);
            (s.area / area).powi(2) * s.deviations.iter().map(square).sum::<f64>()
        };
        self.0.iter().map(variance).sum::<f64>().sqrt()
    }
}

/// Mean of `value`, by weight.
fn mean(deviations: &[Deviation], value: &impl Fn(&Deviation) -> f64) -> f64 {
    let weight: f64 = deviations.iter().map(|d| d.weight).sum();
    let sum: f64 = deviations.iter().map(|d| d.weight * value(d)).sum();
    if weight > 0.0 { sum / weight } else { 0.0 }
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
}

/// Share of the unshot light that is still missing after the bounces: each keeps what is reflected
/// of it and does not escape.
fn passed_share(observations: &[Observation], conditions: &Conditions) -> f64 {
    let escaped = observations.iter().map(|o| o.escaped).sum::<f64>();
    let escaped = escaped / observations.len().max(1) as f64;
    match conditions.bounces {
        Some(bounces) => (conditions.mean_albedo * (1.0 - escaped)).powf(bounces),
        None => 1.0,
    }
}

#[cfg(test)]
mod tests;
