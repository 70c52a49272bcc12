//! Errors of a graphics device as errors of the crate: where, what is wrong, and the remedy.

use crate::error::{Error, ErrorKind};
use crate::scene::Scene;

/// An error of the adapter of this name.
pub fn device_error(adapter: &str, kind: ErrorKind, found: String) -> Error {
    let remedy = match kind {
        ErrorKind::Memory => "use a smaller hemicube, fewer elements, or the CPU",
        _ => "open it again, choose another adapter, or use the CPU",
    };
    Error::new(kind, place(adapter), found, remedy)
}

/// An error for results that no working device returns.
pub fn invalid_result(adapter: &str, found: String) -> Error {
    let remedy = "update its driver, choose another adapter, or use the CPU";
    Error::new(ErrorKind::Device, place(adapter), format!("it answered {found}"), remedy)
}

/// The part of an error that names the adapter.
pub fn place(adapter: &str) -> String {
    format!("graphics adapter '{adapter}'")
}

/// An error of wgpu with its causes, in one line.
pub fn message(error: &wgpu::Error) -> String {
    let mut text = String::new();
    let mut next: Option<&dyn std::error::Error> = Some(error);
    while let Some(e) = next {
        let line = e.to_string();
        let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
        if !text.contains(&line) {
            text += &if text.is_empty() { line } else { format!(": {line}") };
        }
        next = e.source();
    }
    text
}

/// Checks that `scene` has nothing that hemicubes do not support: they would ignore clear panes,
/// and treat holes as solid.
///
/// # Errors
/// [`ErrorKind::Device`] if it has.
pub(crate) fn check_hemicubes_see(scene: &Scene) -> Result<(), Error> {
    let Some(hidden) = scene.hidden_from_hemicubes() else { return Ok(()) };
    let found = format!("{hidden}, which hemicubes do not see");
    Err(Error::new(ErrorKind::Device, "scene", found, "use rays on the CPU, which do"))
}
