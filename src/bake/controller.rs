//! What is refined after an estimate, by the [model] of error and cost.

use crate::bake::error_estimate::{ErrorEstimate, GroupError};
use crate::bake::model;
use crate::progress::Instant;
use std::time::Duration;

use crate::bake::settings::{BakeSettings, GatherSettings, SolveSettings};
use crate::work::now;

/// An error to be reached.
#[derive(Clone, Copy)]
pub(super) struct ErrorTarget<'a> {
    /// Root mean square error, relative, in (0, 1).
    pub error: f64,
    /// Whether every group of the scene is to meet it, and not only the whole.
    pub each_group: bool,
    /// Changes the settings after every choice of the bake.
    pub overrides: &'a dyn Fn(&mut BakeSettings),
    /// Of a bake within a time: when that is over, and the error to which it goes on meanwhile.
    pub within: Option<Within>,
}

/// A limit of time, and what to do with time that is left.
#[derive(Clone, Copy)]
pub(super) struct Within {
    /// When vertices stop gathering.
    pub gather_until: Instant,
    /// When the estimate of the error has to be done.
    pub deadline: Instant,
    /// The error at which the bake ends earlier, in [0, 1).
    pub least_error: f64,
}

/// The errors that are compared with a target.
#[derive(Clone, Copy)]
pub(super) struct TargetErrors<'e> {
    /// The measure that is asked for.
    pub whole: &'e ErrorEstimate,
    /// The same weighted by light instead of area: bright surfaces are to meet the target too.
    pub by_light: &'e ErrorEstimate,
    pub groups: &'e [GroupError],
}

impl ErrorTarget<'_> {
    /// The smallest error that the bake may have in the end, as far as that is known: within a time
    /// alone, 5 %.
    pub fn finest(&self) -> f64 {
        self.within.map_or(self.error, |within| within.least_error.max(0.05).min(self.error))
    }

    /// The time until the estimate of the error begins; without a limit, any.
    pub fn time_left(&self) -> Duration {
        let left = |within: Within| within.gather_until.saturating_duration_since(now());
        self.within.map_or(Duration::MAX, left)
    }

    /// Whether the time is over.
    pub fn is_late(&self) -> bool {
        self.within.is_some_and(|within| now() >= within.deadline)
    }

    /// The next target of a bake that goes on from one with these errors, if it does.
    pub fn next(&self, errors: TargetErrors) -> Option<Self> {
        let least = self.within?.least_error;
        let groups = self.required(errors.groups).map(|group| cautious(&group.estimate));
        let reached = groups.fold(errors.whole.total.max(errors.by_light.total), f64::max);
        let error = (reached * model::IMPROVEMENT_IN_TIME).min(self.error).max(least);
        (self.error > least && error > 0.0).then_some(ErrorTarget { error, ..*self })
    }

    /// Whether the estimate is below the target by the margin of safety, so that the bake can end.
    pub fn is_met(&self, errors: TargetErrors) -> bool {
        let limit = model::SAFETY * self.error;
        // A measurement by paths includes what the estimate may miss.
        let whole = if errors.whole.sources > 0.0 { model::TARGET_FRACTION } else { model::SAFETY };
        errors.by_light.total <= limit && self.is_below(whole * self.error, errors)
    }

    /// Whether the estimate is at most the target; of a bake that was `stopped`, which has fewer
    /// points, whether it is below by the margin of safety.
    pub fn is_reached(&self, errors: TargetErrors, stopped: bool) -> bool {
        if stopped { self.is_met(errors) } else { self.is_below(self.error, errors) }
    }

    fn is_below(&self, error: f64, TargetErrors { whole, groups, .. }: TargetErrors) -> bool {
        whole.total <= error && self.required(groups).all(|g| cautious(&g.estimate) <= error)
    }

    /// The groups that are to meet the error.
    fn required<'g>(&self, groups: &'g [GroupError]) -> impl Iterator<Item = &'g GroupError> {
        groups.iter().filter(|_| self.each_group)
    }

    /// Whether the uncertainty leaves open whether the target is met.
    pub fn is_undecided(&self, TargetErrors { whole, groups, .. }: TargetErrors) -> bool {
        let limit = model::SAFETY * self.error;
        let is_open = |least: f64, most: f64| least <= limit && limit < most;
        // The whole has one standard error in it already.
        is_open(whole.total - 2.0 * whole.uncertainty, whole.total)
            || self.required(groups).any(|g| is_open(g.estimate.total, cautious(&g.estimate)))
    }

    /// The two halves of `settings` after the overrides.
    pub fn overridden(
        &self,
        mut settings: BakeSettings,
    ) -> (SolveSettings, Option<GatherSettings>) {
        (self.overrides)(&mut settings);
        (settings.solve, settings.gather)
    }
}

/// The error of a group with one standard error added: the largest errors are at rare points. The
/// whole has it already.
pub(super) fn cautious(estimate: &ErrorEstimate) -> f64 {
    estimate.total + estimate.uncertainty
}

/// What has to be done for vertices to be as the settings say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// All vertices gather what is emitted, and exchange it, by few rays; then all passes.
    FirstLight,
    /// All gather passes, from the light that was shot.
    AllPasses,
    /// All vertices gather once more, after a `bounce` what they gathered themselves; then elements
    /// are split.
    AllVertices { bounce: bool },
    /// All further bounces of what vertices have gathered.
    Bounces,
    /// Elements are split, and new vertices gather.
    Split,
}

impl Step {
    /// What has to be done again where settings become `new`.
    pub fn between(old: &GatherSettings, new: &GatherSettings) -> Step {
        let bounce = new.refinement.gather_passes != old.refinement.gather_passes;
        if (new.rays, new.noise_tolerance) != (old.rays, old.noise_tolerance) {
            Step::AllVertices { bounce }
        } else if bounce {
            Step::Bounces
        } else {
            Step::Split
        }
    }
}

/// The noise tolerance of vertices where `target` is asked for.
pub(super) fn noise_tolerance(target: f64) -> f64 {
    // Vertices whose rays disagree by three times the error allowed for sampling get more of them.
    3.0 * model::allowed_sampling(target)
}

/// `gather` with as many rays for each of the first `vertices` as bring `sampling`, the error of
/// those it has, down to its share of the `target`.
pub(super) fn with_rays_for(
    gather: &GatherSettings,
    sampling: f64,
    target: f64,
    vertices: usize,
) -> GatherSettings {
    let allowed = model::allowed_sampling(target);
    let rays = f64::from(gather.rays) * model::ray_factor(sampling, allowed);
    let mut chosen = gather.clone();
    // They come in powers of two.
    let rays = rays.max(model::min_rays(vertices)).min(*model::RAYS.end());
    chosen.rays = 1 << libm::log2(rays).round() as u32;
    chosen.noise_tolerance = noise_tolerance(target);
    chosen
}

/// `gather` refined where parts of the estimate are above the cap that meets the `target`: for the
/// whole and, where every group is to meet it, for those that do not.
pub(super) fn refined(
    gather: &GatherSettings,
    TargetErrors { whole, by_light, groups }: TargetErrors,
    target: &ErrorTarget,
) -> GatherSettings {
    let mut refined = gather.clone();
    let allowed = model::allowed_error(target.error);
    let mut steps = Steps::default();
    // Of the whole the one that is further off.
    let worst = if by_light.total > whole.total { by_light } else { whole };
    if worst.total > model::SAFETY * target.error {
        steps = Steps::to(&with_sources_in_mesh(worst, whole.sources), allowed);
        if let Some(step) = steps.mesh {
            refined.refinement.mesh_error *= step;
            refined.refinement.min_edge *= step;
            refined.refinement.interpolation_tolerance *= step;
        }
    }
    for group in target.required(groups) {
        if cautious(&group.estimate) <= model::SAFETY * target.error {
            continue;
        }
        // What is uncertain may be an error of the elements too.
        let ErrorEstimate { total, sources, .. } = group.estimate;
        let uncertain = (cautious(&group.estimate).powi(2) - total.powi(2)).sqrt();
        let missed = libm::hypot(sources, uncertain);
        let own = Steps::to(&with_sources_in_mesh(&group.estimate, missed), allowed);
        steps = steps.both(own);
        if let Some(step) = own.mesh {
            let factors = &mut refined.refinement.group_factors;
            let k = group.group as usize;
            factors.resize(factors.len().max(k + 1), 1.0);
            // What the whole is refined by does for its groups too.
            factors[k] *= (step / steps.mesh.unwrap_or(1.0)).min(1.0);
        }
    }
    if steps.bounce {
        // It takes few rays, and by its light there may be less to split.
        refined = gather.clone();
        refined.refinement.gather_passes += 1;
        return refined;
    }
    if let Some((rays, noise)) = steps.sampling {
        refined.rays = (f64::from(gather.rays) * rays).min(*model::RAYS.end()) as u32;
        refined.noise_tolerance *= noise;
    }
    refined
}

/// `gather` with all further bounces where these are above the cap that meets the `target` and
/// nothing else of the estimate can be lowered.
pub(super) fn with_bounces(
    gather: &GatherSettings,
    TargetErrors { whole, by_light, groups }: TargetErrors,
    target: &ErrorTarget,
) -> GatherSettings {
    let needs_bounces = |estimate: &ErrorEstimate| {
        let ErrorEstimate { sampling, mesh, truncation, unshot, .. } = *estimate;
        let (bounces, rest) = (libm::hypot(truncation, unshot), libm::hypot(mesh, sampling));
        let allowed = model::allowed_error(target.error);
        bounces > model::water_filling_cap([bounces], rest, allowed)
    };
    let groups = target.required(groups).map(|group| &group.estimate);
    let mut refined = gather.clone();
    if [whole, by_light].into_iter().chain(groups).any(needs_bounces) {
        refined.refinement.gather_passes += 1;
    }
    refined
}

/// `estimate` with the `sources` added to the error of the mesh: all bounces are counted, so that
/// elements are the cause.
fn with_sources_in_mesh(estimate: &ErrorEstimate, sources: f64) -> ErrorEstimate {
    ErrorEstimate { mesh: libm::hypot(estimate.mesh, sources), ..*estimate }
}

/// By how much settings are to be refined.
#[derive(Clone, Copy, Debug, Default)]
struct Steps {
    /// Factors of the rays and of the noise tolerance.
    sampling: Option<(f64, f64)>,
    /// Factor of the tolerances and of the smallest edge.
    mesh: Option<f64>,
    /// Whether all vertices are to gather once more.
    bounce: bool,
}

impl Steps {
    /// What brings `estimate` to `allowed`. A further bounce shoots what was left unshot, too.
    fn to(estimate: &ErrorEstimate, allowed: f64) -> Steps {
        let ErrorEstimate { sampling, mesh, truncation, unshot, .. } = *estimate;
        let bounces = libm::hypot(truncation, unshot);
        let cap = |bounces: f64, lowers_sampling: bool| match lowers_sampling {
            true => model::water_filling_cap([sampling, mesh, bounces], 0.0, allowed),
            false => model::water_filling_cap([mesh, bounces], sampling, allowed),
        };
        let growth = |cap: f64| model::vertex_growth(mesh, cap);
        // With more rays every vertex gathers again; finer elements alone may cost less.
        let cap_with_rays = cap(bounces, true);
        let cost_with_rays = growth(cap_with_rays) * model::ray_factor(sampling, cap_with_rays);
        let cost_of_mesh = growth(cap(bounces, false)) - 1.0;
        let lowers_sampling = sampling > cap_with_rays
            && (cost_with_rays < cost_of_mesh || !model::leaves_budget(sampling, allowed));
        // All further bounces take few rays, and leave more of the error to the elements.
        let saved = growth(cap(bounces, lowers_sampling)) - growth(cap(0.0, lowers_sampling));
        let cap = cap(bounces, lowers_sampling);
        Steps {
            sampling: lowers_sampling
                .then(|| (model::ray_step(sampling, cap), model::noise_step(sampling, cap))),
            mesh: (mesh > cap).then(|| model::mesh_step(mesh, cap)),
            bounce: bounces > cap || saved > 1.0 / f64::from(model::COARSE_RAY_DIVISOR),
        }
    }

    /// The larger of the steps that concern all of the scene; the mesh is that of `self`.
    fn both(self, other: Steps) -> Steps {
        let sampling = match (self.sampling, other.sampling) {
            (Some(a), Some(b)) => Some((a.0.max(b.0), a.1.min(b.1))),
            (a, b) => a.or(b),
        };
        Steps { sampling, bounce: self.bounce || other.bounce, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Scene, Triangle};
    use glam::DVec3;

    fn settings() -> GatherSettings {
        let corners = [0, 1, 2];
        let triangle = Triangle { corners, group: 0, material: 0, smoothing: None };
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y];
        let names = vec!["all".to_string()];
        let materials = vec![Material::grey("grey", 0.5)];
        let scene = Scene::new(positions, vec![triangle], names, materials).unwrap();
        BakeSettings::for_error(0.02, &scene).gather.unwrap()
    }

    fn target(error: f64, each_group: bool) -> ErrorTarget<'static> {
        ErrorTarget { error, each_group, overrides: &|_| (), within: None }
    }

    fn errors<'e>(whole: &'e ErrorEstimate, groups: &'e [GroupError]) -> TargetErrors<'e> {
        TargetErrors { whole, by_light: whole, groups }
    }

    #[test]
    fn what_is_bright_meets_the_target_too() {
        let gather = settings();
        let [met, missed] =
            [0.001, 0.1].map(|mesh| ErrorEstimate { total: mesh, mesh, ..Default::default() });
        let target = target(0.02, false);
        let by_light = TargetErrors { whole: &met, by_light: &missed, groups: &[] };
        assert!(!target.is_met(by_light) && target.is_reached(by_light, false));
        let new = refined(&gather, by_light, &target);
        assert!(new.refinement.min_edge < gather.refinement.min_edge);
        let dark = TargetErrors { whole: &missed, by_light: &met, groups: &[] };
        assert!(!target.is_met(dark) && !target.is_reached(dark, false));
    }

    #[test]
    fn only_parts_above_cap_are_refined() {
        let gather = settings();
        let small = ErrorEstimate { total: 0.5, ..ErrorEstimate::default() };
        let cases = [
            (ErrorEstimate { mesh: 0.05, ..small }, Step::Split),
            (ErrorEstimate { truncation: 0.05, ..small }, Step::Bounces),
            (ErrorEstimate { sampling: 0.05, ..small }, Step::AllVertices { bounce: false }),
        ];
        for (estimate, step) in cases {
            let new = refined(&gather, errors(&estimate, &[]), &target(0.02, false));
            assert_eq!(Step::between(&gather, &new), step, "{estimate:?}");
            let finer = new.refinement.mesh_error < gather.refinement.mesh_error;
            assert_eq!(finer, estimate.mesh > 0.0);
            assert_eq!(new.rays > gather.rays, estimate.sampling > 0.0);
            assert_eq!(
                new.refinement.gather_passes > gather.refinement.gather_passes,
                estimate.truncation > 0.0
            );
        }
        // A bounce comes first, and alone: it changes what there is to split and to cast.
        for (mesh, sampling) in [(0.05, 0.0), (0.0, 0.05)] {
            let both = ErrorEstimate { mesh, sampling, truncation: 0.05, ..small };
            let new = refined(&gather, errors(&both, &[]), &target(0.02, false));
            assert_eq!(Step::between(&gather, &new), Step::Bounces);
            assert_eq!(new.refinement.mesh_error, gather.refinement.mesh_error);
            assert_eq!(new.rays, gather.rays);
        }
        let met = ErrorEstimate { mesh: 0.01, sampling: 0.005, ..small };
        let new = refined(&gather, errors(&met, &[]), &target(0.02, false));
        assert_eq!(new, gather, "0.0112 is below 0.9 · 0.85 · 0.02");
    }

    #[test]
    fn bounces_come_where_they_cost_less_than_the_elements_they_save() {
        let gather = settings();
        let target = target(0.1, false);
        // Allowed are 0.0765. Bounces of 0.04 stay, where the mesh has 0.065 left; without
        // them it has 0.0765: a mesh of 0.09 takes (0.09/0.065)^1.6 = 1.68 times the vertices
        // or 1.30 times, and bounces a quarter of what these cost. Of 0.02, next to nothing.
        for (truncation, wanted) in [(0.04, Step::Bounces), (0.02, Step::Split)] {
            let estimate =
                ErrorEstimate { total: 0.5, mesh: 0.09, truncation, ..Default::default() };
            let new = refined(&gather, errors(&estimate, &[]), &target);
            assert_eq!(Step::between(&gather, &new), wanted, "{truncation}");
        }
    }

    #[test]
    fn bounces_are_lowered_where_nothing_else_can_be() {
        let gather = settings();
        // Allowed are 0.0153: of it the least budget is left, 0.1 of the square.
        let cases = [(0.05, 0.0, false), (0.05, 0.0047, false), (0.05, 0.0049, true)];
        for (mesh, truncation, wanted) in cases {
            let estimate = ErrorEstimate { total: 0.5, mesh, truncation, ..Default::default() };
            let new = with_bounces(&gather, errors(&estimate, &[]), &target(0.02, false));
            let is_bounce = new != gather && Step::between(&gather, &new) == Step::Bounces;
            assert_eq!(is_bounce, wanted, "{estimate:?}");
            let same = GatherSettings { refinement: gather.refinement.clone(), ..new };
            assert_eq!(same, gather, "nothing else changes");
        }
    }

    #[test]
    fn rays_that_all_vertices_would_cast_again_are_the_last_resort() {
        let gather = settings();
        let of =
            |sampling, mesh| ErrorEstimate { total: 0.5, sampling, mesh, ..Default::default() };
        // Allowed are 0.0153. Sampling alone is above half of that squared, but to lower the mesh
        // beside it takes (0.012/0.0095)^1.6 = 1.5 times the vertices, less than to cast all
        // again.
        let new = refined(&gather, errors(&of(0.012, 0.012), &[]), &target(0.02, false));
        assert_eq!(Step::between(&gather, &new), Step::Split);
        assert!(new.refinement.mesh_error < gather.refinement.mesh_error);
        // Where next to nothing is left for the mesh, rays are cheaper.
        let new = refined(&gather, errors(&of(0.0152, 0.012), &[]), &target(0.02, false));
        assert_eq!(Step::between(&gather, &new), Step::AllVertices { bounce: false });
    }

    #[test]
    fn groups_above_target_are_refined_alone() {
        let gather = settings();
        let met = ErrorEstimate { total: 0.01, mesh: 0.01, ..ErrorEstimate::default() };
        let missed = ErrorEstimate { total: 0.1, mesh: 0.1, ..met };
        let group =
            |group, estimate| GroupError { group, area_share: 0.1, estimate, tail_share: 0.0 };
        let groups = [group(1, met), group(3, missed)];
        for each_group in [false, true] {
            let target = target(0.02, each_group);
            assert_eq!(target.is_met(errors(&met, &groups)), !each_group);
            let new = refined(&gather, errors(&met, &groups), &target);
            if each_group {
                let factors = &new.refinement.group_factors;
                assert_eq!(factors[..], [1.0, 1.0, 1.0, 0.5]);
            } else {
                assert_eq!(new, gather);
            }
        }
        // What is uncertain takes more points, if these can decide.
        let wide = ErrorEstimate { uncertainty: 0.02, ..met };
        assert!(target(0.02, true).is_undecided(errors(&met, &[group(0, wide)])));
        assert!(!target(0.02, true).is_undecided(errors(&met, &groups)));
        assert!(!target(0.02, false).is_undecided(errors(&met, &[group(0, wide)])));
        let close = ErrorEstimate { total: 0.0175, uncertainty: 0.001, ..met };
        assert!(target(0.02, false).is_undecided(errors(&close, &[])));
        assert!(!target(0.01, false).is_undecided(errors(&close, &[])));
    }

    #[test]
    fn pilot_chooses_rays_by_sampling_law() {
        let gather = settings();
        let allowed = model::allowed_sampling(0.02);
        let many = 1 << 20;
        let rays = |sampling: f64| with_rays_for(&gather, sampling, 0.02, many).rays;
        assert_eq!(rays(allowed), gather.rays.next_power_of_two());
        for sampling in [1.2, 2.0, 4.0, 9.0].map(|times| times * allowed) {
            // The power of two nearest to what it takes.
            let needed =
                f64::from(gather.rays) * (sampling / allowed).powf(1.0 / model::RQMC_EXPONENT);
            let excess = f64::from(rays(sampling)) / needed;
            assert!((0.7..1.5).contains(&excess), "{sampling}: {excess}");
            assert!(rays(sampling).is_power_of_two());
        }
        assert_eq!((rays(0.0), rays(1e9)), (64, 65536));
        // Of few vertices each has more than noise asks for.
        let rays = [1 << 14, 1 << 13, 1].map(|few| with_rays_for(&gather, 0.0, 0.02, few).rays);
        assert_eq!(rays, [128, 256, 512]);
    }
}
