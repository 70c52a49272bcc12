//! Bakes within a time: to one error after the other, as long as another fits in.
//!
//! ```text
//! error 0.2 ─► 0.06 ─► 0.025 ─► stopped │ time
//!              └──────────┴── the time that these took tells what the next may be
//! ```
//!
//! Each starts from nothing. The one of least estimated error is kept: what was stopped may be
//! better than what was done before it, or worse.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::backend::Backend;
use crate::bake::controller::{ErrorTarget, Judged, cautious};
use crate::bake::model;
use crate::bake::outcome::{Obstacle, Outcome};
use crate::bake::progress::ProgressCallback;
use crate::bake::result::BakeResult;
use crate::bake::settings::BakeSettings;
use crate::bake::to_error::{bake_to_error, check_error};
use crate::error::Error;
use crate::scene::Scene;

/// A bake that was done.
#[derive(Clone, Copy)]
struct Attempt {
    /// The error that was asked for.
    error: f64,
    /// Seconds that it took.
    taken: f64,
}

/// Bakes to one error after the other until `limit` or, if there is one, until `goal` is reached.
pub(super) fn bake_in_time(
    limit: Duration,
    goal: Option<ErrorTarget>,
    scene: &Arc<Scene>,
    backend: &Backend,
    overrides: &dyn Fn(&mut BakeSettings),
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    let start = Instant::now();
    let end = limit.mul_f64(1.0 - model::TIME_FOR_ESTIMATE);
    let without_checkpoint = |settings: &mut BakeSettings| {
        overrides(settings);
        settings.solve.checkpoint = None;
    };
    let (least, each_group) = goal.map_or((0.0, false), |goal| (goal.error, goal.each_group));
    if goal.is_some() {
        check_error(least)?;
    }
    let mut best: Option<BakeResult> = None;
    let mut previous: Option<Attempt> = None;
    let mut error = model::INITIAL_ERROR.max(least);
    loop {
        let attempt_start = Instant::now();
        let (mut stopped, mut cancelled) = (false, false);
        let target = ErrorTarget { error, each_group, overrides: &without_checkpoint };
        let attempt = bake_to_error(target, scene, backend, &mut |stage| {
            cancelled |= progress(stage).is_break();
            stopped |= cancelled || start.elapsed() >= end;
            if stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let (baked, before) = match (attempt, best.take()) {
            (Err(error), Some(best)) if error.is_device_error() => {
                return Ok(BakeResult { device_failure: Some(error), ..best });
            }
            (attempt, before) => (attempt?, before),
        };
        let is_reached = goal.is_some_and(|goal| {
            let BakeResult { estimate, groups, .. } = &baked;
            goal.is_reached(Judged { whole: estimate, by_light: estimate, groups }, stopped)
        });
        let short = if cancelled { Obstacle::Cancelled } else { Obstacle::Time };
        let outcome = match goal {
            // A time was asked for, and the errors that were tried are nobody's.
            None => Outcome::Unasked,
            Some(_) if is_reached => Outcome::Reached,
            Some(_) if !stopped && error <= least => baked.outcome,
            Some(_) => Outcome::Missed(short),
        };
        let is_better =
            |before: &BakeResult| error_of(before, each_group) <= error_of(&baked, each_group);
        let baked = match before {
            Some(before) if !is_reached && is_better(&before) => before,
            _ => baked,
        };
        let baked = BakeResult { outcome, ..baked };
        let is_last = is_reached || stopped || error <= least || baked.estimate.total == 0.0;
        let attempt = Attempt { error, taken: attempt_start.elapsed().as_secs_f64() };
        let remaining = limit.saturating_sub(start.elapsed()).as_secs_f64();
        let improvement = affordable_improvement(previous, attempt, remaining);
        if is_last || improvement < model::MIN_IMPROVEMENT.min(error / least) {
            return Ok(baked);
        }
        best = Some(baked);
        previous = Some(attempt);
        error = (error / improvement).max(least);
    }
}

/// How many times smaller the error may be of a bake that takes most of `remaining` seconds, by
/// what the `last` one took and, if there is one, that before it.
fn affordable_improvement(previous: Option<Attempt>, last: Attempt, remaining: f64) -> f64 {
    let exponent = previous.map_or(model::COST_EXPONENT, |previous| {
        model::cost_exponent(previous.error / last.error, last.taken / previous.taken)
    });
    model::affordable_improvement(remaining, last.taken, exponent)
}

/// The largest error that is told of `baked`, each with one standard error: of the whole and, where
/// each group counts, of these.
fn error_of(baked: &BakeResult, each_group: bool) -> f64 {
    let groups = baked.groups.iter().filter(|_| each_group).map(|group| &group.estimate);
    [&baked.estimate].into_iter().chain(groups).map(cautious).fold(0.0, f64::max)
}
