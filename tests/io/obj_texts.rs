//! OBJ files written for a test, and what their errors and warnings must say.

use std::fs;
use std::path::Path;

use radiosity::scene::WarningKind;
use radiosity::{Error, ErrorKind, Scene, SceneSettings, load_scene};
use tempfile::TempDir;

pub const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

pub const CHALK: &str = "newmtl chalk\nKd 0.8 0.7 0.6\n";

/// Writes the files into a fresh folder and loads the first of them.
pub fn load(files: &[(&str, &[u8])]) -> Result<Scene, Error> {
    let folder = TempDir::new().unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    load_scene(folder.path().join(files[0].0))
}

/// The same, refusing what would be repaired.
pub fn load_strictly(files: &[(&str, &[u8])]) -> Result<Scene, Error> {
    let mut settings = SceneSettings::default();
    settings.strict = true;
    settings.read(files[0].0, files[0].1, &files[1..])
}

pub fn obj(text: &str) -> Result<Scene, Error> {
    load(&[("room.obj", text.as_bytes())])
}

/// A square of material `chalk`, with this library.
pub fn with_library(mtl: &str) -> Result<Scene, Error> {
    let text = format!("mtllib room.mtl\n{SQUARE}usemtl chalk\nf 1 2 3 4\n");
    load(&[("room.obj", text.as_bytes()), ("room.mtl", mtl.as_bytes())])
}

/// The error is of `kind` and at `place`, a file's name with its line, and names all of `parts`.
#[track_caller]
pub fn refused(result: Result<Scene, Error>, kind: ErrorKind, place: &str, parts: &[&str]) {
    let error = result.expect_err("must be refused");
    let message = error.to_string();
    assert_eq!(error.kind(), kind, "{message}");
    assert!(is_at(error.place(), place), "not at {place}: {message}");
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
    assert!(message.lines().count() == 1 && message.len() < 600, "{message}");
}

/// Whether `found` is `place` in some folder, with or without more detail.
fn is_at(found: &str, place: &str) -> bool {
    found.match_indices(place).any(|(start, _)| {
        let (folder, detail) = (&found[..start], &found[start + place.len()..]);
        (folder.is_empty() || folder.ends_with(std::path::MAIN_SEPARATOR))
            && (detail.is_empty() || detail.starts_with(": "))
    })
}

/// The last part of a path.
pub fn name_of(path: &Path) -> String {
    path.file_name().unwrap().to_string_lossy().into_owned()
}

#[track_caller]
pub fn warned(scene: &Scene, part: &str) {
    let warnings: Vec<String> = scene.warnings().iter().map(ToString::to_string).collect();
    assert!(warnings.iter().any(|w| w.contains(part)), "'{part}' is not in {warnings:?}");
    for warning in &warnings {
        assert!(warning.lines().count() == 1 && warning.len() < 900, "{warning}");
    }
}

/// What the warnings are about, but for light, which few of these scenes have.
pub fn oddities(scene: &Scene) -> Vec<WarningKind> {
    let kinds = scene.warnings().iter().map(|w| w.kind);
    kinds.filter(|&kind| kind != WarningKind::NoLight).collect()
}

/// What is repaired with a warning that contains `part`, and refused at `place` by a strict reader,
/// with a message that contains `part` of strict too.
#[track_caller]
pub fn repaired(files: &[(&str, &[u8])], part: &str, place: &str, strict_part: &str) -> Scene {
    let scene = load(files).unwrap_or_else(|e| panic!("not repaired: {e}"));
    warned(&scene, part);
    refused(load_strictly(files), ErrorKind::Scene, place, &[strict_part]);
    scene
}

pub fn area(scene: &Scene) -> f64 {
    (0..scene.triangles().len()).map(|t| scene.area(t)).sum()
}
