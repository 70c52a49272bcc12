//! What is refined after an estimate, by the [model](crate::bake::model) of error and cost.

use crate::bake::error_estimate::ErrorEstimate;
use crate::bake::model;
use crate::bake::settings::{BakeSettings, GatherSettings, SolveSettings};

/// An error to be reached.
#[derive(Clone, Copy)]
pub(super) struct ErrorTarget<'a> {
    /// Root mean square error, relative, in (0, 1).
    pub error: f64,
    /// Sets by hand what was chosen, after every choice.
    pub overrides: &'a dyn Fn(&mut BakeSettings),
}

impl ErrorTarget<'_> {
    /// Whether `estimate` is below the target, safely.
    pub fn is_met(&self, estimate: &ErrorEstimate) -> bool {
        estimate.total <= model::SAFETY * self.error
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

/// What has to be done for vertices to be as the settings say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// All gather passes, from the light that was shot.
    AllPasses,
    /// All vertices gather once more, after a `bounce` what they gathered themselves; then elements
    /// are split.
    AllVertices { bounce: bool },
    /// What was reached lights the vertices, all of which gather the difference to what did before;
    /// then elements are split.
    Bounce,
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
            Step::Bounce
        } else {
            Step::Split
        }
    }
}

/// `gather` with as many rays as bring `sampling`, the error of those it has, down to its share of
/// the `target`.
pub(super) fn with_rays_for(gather: &GatherSettings, sampling: f64, target: f64) -> GatherSettings {
    let allowed = model::SAMPLING_SHARE * model::allowed_error(target);
    let rays = f64::from(gather.rays) * model::ray_factor(sampling, allowed);
    let mut chosen = gather.clone();
    chosen.rays = model::clamped(rays, model::RAYS).ceil() as u32;
    chosen.noise_tolerance = model::OUTLIER_FACTOR * allowed;
    chosen
}

/// `gather` refined where parts of `estimate` are above the cap that meets the `target`.
pub(super) fn refined(
    gather: &GatherSettings,
    estimate: &ErrorEstimate,
    target: f64,
) -> GatherSettings {
    let ErrorEstimate { sampling, mesh, truncation, unshot, .. } = *estimate;
    let cap = model::water_filling_cap(
        [sampling, mesh, truncation],
        unshot,
        model::allowed_error(target),
    );
    let mut refined = gather.clone();
    if truncation > cap {
        refined.refinement.gather_passes += 1;
    }
    if sampling > cap {
        refined.rays = (f64::from(gather.rays) * model::ray_step(sampling, cap)) as u32;
        refined.noise_tolerance *= model::noise_step(sampling, cap);
    }
    if mesh > cap {
        let step = model::mesh_step(mesh, cap);
        refined.refinement.surplus_tolerance *= step;
        refined.refinement.min_edge *= step;
        refined.refinement.interpolation_tolerance *= step;
    }
    refined
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

    #[test]
    fn only_parts_above_cap_are_refined() {
        let gather = settings();
        let small = ErrorEstimate { total: 0.5, ..ErrorEstimate::default() };
        let cases = [
            (ErrorEstimate { mesh: 0.05, ..small }, Step::Split),
            (ErrorEstimate { truncation: 0.05, ..small }, Step::Bounce),
            (ErrorEstimate { sampling: 0.05, ..small }, Step::AllVertices { bounce: false }),
            (
                ErrorEstimate { sampling: 0.05, truncation: 0.05, ..small },
                Step::AllVertices { bounce: true },
            ),
        ];
        for (estimate, step) in cases {
            let new = refined(&gather, &estimate, 0.02);
            assert_eq!(Step::between(&gather, &new), step, "{estimate:?}");
            let finer = new.refinement.surplus_tolerance < gather.refinement.surplus_tolerance;
            assert_eq!(finer, estimate.mesh > 0.0);
            assert_eq!(new.rays > gather.rays, estimate.sampling > 0.0);
            assert_eq!(
                new.refinement.gather_passes > gather.refinement.gather_passes,
                estimate.truncation > 0.0
            );
        }
        let met = ErrorEstimate { mesh: 0.01, sampling: 0.005, ..small };
        assert_eq!(refined(&gather, &met, 0.02), gather, "0.0112 is below 0.9 · 0.75 · 0.02");
    }

    #[test]
    fn pilot_chooses_rays_by_sampling_law() {
        let gather = settings();
        let allowed = model::SAMPLING_SHARE * model::allowed_error(0.02);
        assert_eq!(with_rays_for(&gather, allowed, 0.02).rays, gather.rays);
        let more = f64::from(with_rays_for(&gather, 4.0 * allowed, 0.02).rays);
        let factor = more / f64::from(gather.rays);
        // Rounded up to whole rays.
        assert!((factor - 4f64.powf(1.0 / model::RQMC_EXPONENT)).abs() < 2e-3, "{factor}");
        assert_eq!(with_rays_for(&gather, 0.0, 0.02).rays, 128);
        assert_eq!(with_rays_for(&gather, 1e9, 0.02).rays, 65536);
    }
}
