//! OBJ files written for a test, and what their errors and warnings must say.

use std::fs;

use radiosity::{Error, ErrorKind, Scene, load_obj};
use tempfile::TempDir;

pub const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

pub const CHALK: &str = "newmtl chalk\nKd 0.8 0.7 0.6\n";

/// Writes the files into a fresh folder and loads the first of them.
pub fn load(files: &[(&str, &[u8])]) -> Result<Scene, Error> {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    load_obj(folder.path().join(files[0].0))
}

pub fn obj(text: &str) -> Result<Scene, Error> {
    load(&[("room.obj", text.as_bytes())])
}

/// A square of material `chalk`, with this library.
pub fn with_library(mtl: &str) -> Result<Scene, Error> {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n");
    load(&[("room.obj", text.as_bytes()), ("room.mtl", mtl.as_bytes())])
}

/// The error is of `kind` and its message has all of `parts`.
#[track_caller]
pub fn refused(result: Result<Scene, Error>, kind: ErrorKind, parts: &[&str]) {
    let error = result.expect_err("must be refused");
    let message = error.to_string();
    assert_eq!(error.kind(), kind, "{message}");
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
    assert!(message.lines().count() == 1 && message.len() < 600, "{message}");
}

#[track_caller]
pub fn warned(scene: &Scene, part: &str) {
    let warnings = scene.warnings();
    assert!(warnings.iter().any(|w| w.contains(part)), "'{part}' is not in {warnings:?}");
}

pub fn area(scene: &Scene) -> f64 {
    (0..scene.triangles().len()).map(|t| scene.area(t)).sum()
}
