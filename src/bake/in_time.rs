//! Bakes within a time: something at once, and then to one error after the other.
//!
//! ```text
//! first light ──────────► gather to 0.2 ─► 0.15 ─► 0.11 ─► stopped │ time
//! all vertices gather     as any bake, each from where the one
//! and exchange light      before it ended
//! ```
//!
//! Nothing is shot, and what vertices have is kept whenever the time is over.

use std::cell::Cell;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

use crate::backend::Backend;
use crate::bake::controller::{ErrorTarget, TargetErrors, Within};
use crate::bake::outcome::{Obstacle, Outcome};
use crate::bake::pipeline;
use crate::bake::progress::ProgressCallback;
use crate::bake::result::BakeResult;
use crate::bake::settings::BakeSettings;
use crate::bake::to_error::{check_error, settings_for};
use crate::error::Error;
use crate::scene::Scene;
use crate::work::now;

/// The error that a bake within a time goes to first.
const FIRST_ERROR: f64 = 0.2;

/// Share of the time that is left to the estimate of the error and to writing what was reached.
const SHARE_OF_ESTIMATE: f64 = 0.1;

/// Share of the time that cuts along walls and splits beside them may take; without them the error
/// is larger there.
const SHARE_OF_CONTACTS: f64 = 0.2;

/// Seconds that these take for each triangle of a scene: in a hall of 128 000 triangles and in a
/// city of 197 000, on two cores.
const SECONDS_PER_CONTACTS: f64 = 1e-5;

/// Bakes to one error after the other until `limit` or, if there is one, until `goal` is reached.
pub(super) fn bake_in_time(
    limit: Duration,
    goal: Option<ErrorTarget>,
    scene: Arc<Scene>,
    backend: &Backend,
    overrides: &dyn Fn(&mut BakeSettings),
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    let start = now();
    let (least_error, each_group) = goal.map_or((0.0, false), |goal| (goal.error, goal.each_group));
    if goal.is_some() {
        check_error(least_error)?;
    }
    let cutting = SECONDS_PER_CONTACTS * scene.triangles().len() as f64;
    let overrides = &|settings: &mut BakeSettings| {
        if let Some(gather) = &mut settings.gather
            && cutting > SHARE_OF_CONTACTS * limit.as_secs_f64()
        {
            gather.contact_levels = 0;
        }
        overrides(settings);
    };
    let gather_until = start + limit.mul_f64(1.0 - SHARE_OF_ESTIMATE);
    let within = Some(Within { gather_until, deadline: start + limit, least_error });
    let target = ErrorTarget { error: least_error.max(FIRST_ERROR), each_group, overrides, within };
    let (is_over, cancelled) = (Cell::new(false), Cell::new(false));
    let until: ProgressCallback = &mut |stage| {
        cancelled.set(cancelled.get() || progress(stage).is_break());
        is_over.set(cancelled.get() || now() >= gather_until);
        if is_over.get() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    let settings = settings_for(&target, &scene);
    let baked = match &settings.gather {
        Some(_) => pipeline::run_without_shooting(&settings, scene, backend, target, until)?,
        None => pipeline::run(&settings, scene, backend, Some(target), until)?,
    };
    let interruption = match (cancelled.get(), is_over.get()) {
        (true, _) => Some(Obstacle::Cancelled),
        (false, true) => Some(Obstacle::Time),
        (false, false) => None,
    };
    let outcome = outcome_of(&baked, goal, interruption);
    Ok(BakeResult { outcome, ..baked })
}

/// The outcome of `baked`, which `interruption` ended.
fn outcome_of(
    baked: &BakeResult,
    goal: Option<ErrorTarget>,
    interruption: Option<Obstacle>,
) -> Outcome {
    // Only a time was asked for.
    let Some(goal) = goal else { return Outcome::Unasked };
    let BakeResult { estimate, groups, .. } = baked;
    let errors = TargetErrors { whole: estimate, by_light: estimate, groups };
    match interruption {
        _ if goal.is_reached(errors, interruption.is_some()) => Outcome::Reached,
        Some(obstacle) => Outcome::Missed(obstacle),
        None => baked.outcome,
    }
}
