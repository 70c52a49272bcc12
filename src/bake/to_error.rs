//! A bake to one error: settings chosen for it, then the phases.

use std::sync::Arc;

use crate::backend::Backend;
use crate::bake::controller::ErrorTarget;
use crate::bake::pipeline;
use crate::bake::progress::ProgressCallback;
use crate::bake::result::BakeResult;
use crate::bake::settings::BakeSettings;
use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

/// # Errors
/// [`ErrorKind::Setting`] for an error outside (0, 1).
pub(crate) fn check_error(error: f64) -> Result<(), Error> {
    if error > 0.0 && error < 1.0 {
        return Ok(());
    }
    let remedy = "ask for a share above 0 and below 1, such as 0.02";
    Err(Error::new(ErrorKind::Setting, format!("error {error}"), "out of range", remedy))
}

/// Bakes `scene` to the error of `target`, with its overrides.
///
/// # Errors
/// Those of [`check_error`] and of the phases.
pub(super) fn bake_to_error(
    target: ErrorTarget,
    scene: Arc<Scene>,
    backend: &Backend,
    progress: ProgressCallback,
) -> Result<BakeResult, Error> {
    check_error(target.error)?;
    pipeline::run(&settings_for(&target, &scene), scene, backend, Some(target), progress)
}

/// The settings that `target` begins with.
pub(super) fn settings_for(target: &ErrorTarget, scene: &Scene) -> BakeSettings {
    let mut settings = BakeSettings::for_error(target.error, scene);
    if target.each_group {
        settings.scale_groups(target.error, scene);
    }
    (target.overrides)(&mut settings);
    settings
}
