//! Exact view factors of scenes and files.

use std::path::{Path, PathBuf};

use radiosity::{Scene, ViewFactors};

use super::keep_counting;

/// A file of `tests/data`.
pub fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Exact view factors of `scene`, to `error`.
pub fn exact_view_factors(scene: &Scene, error: f64) -> ViewFactors {
    ViewFactors::exact(scene, error, &[], keep_counting).unwrap().unwrap()
}

/// Which group has this name.
pub fn group_index(m: &ViewFactors, name: &str) -> usize {
    m.names.iter().position(|n| n == name).unwrap()
}

/// A square of side `2 r` at height `z` around the axis, its front up or down.
pub fn square(r: f64, z: f64, up: bool) -> [[f64; 3]; 4] {
    let corners = [[-r, -r, z], [r, -r, z], [r, r, z], [-r, r, z]];
    if up { corners } else { [corners[0], corners[3], corners[2], corners[1]] }
}
