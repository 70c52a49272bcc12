//! What the fuzz target `obj` does with an input, and the replay of its corpus.
//!
//! ```text
//!   settings (a byte)   0–1 how the OBJ file is encoded, 2 strict, 3 `a` emits, 4–5 sky, 6 ceiling
//!   OBJ file            from the second byte on
//!   %%                  a line that parts it from the next
//!   m.mtl, %%, i.tga, %%, N/Other.mtl    as many of these as there are
//! ```
//!
//! An image of any kind is told by its content; what has no sign of its own is taken for a TGA.

use radiosity::backend::cpu::RayRows;
use radiosity::io::SceneSettings;
use radiosity::{Error, ErrorKind, Mesh, Rgb, Scene, Sky, Solver, VertexMesh};
use std::ops::ControlFlow;

/// Parts one file from the next.
const SEPARATOR: &[u8] = b"\n%%\n";

/// Names of the files beside the OBJ file.
const NAMES: [&str; 3] = ["m.mtl", "i.tga", "N/Other.mtl"];

/// Scenes of more triangles are only loaded, so that an input takes milliseconds.
const MOST_TRIANGLES: usize = 64;

/// Loads an OBJ file and those beside it, and lets light settle in the scene if there is one.
/// Panics where a scene or an error breaks its promises.
pub fn try_scene(input: &[u8]) -> Option<Scene> {
    let (&choice, files) = input.split_first()?;
    let files = split(files);
    let obj = encoded(files[0], choice);
    let beside: Vec<_> = NAMES.into_iter().zip(files[1..].iter().copied()).collect();
    let settings = settings(choice);
    let scene = match settings.read("it.obj", &obj, &beside) {
        Ok(scene) => scene,
        Err(e) => {
            check_error(&e);
            return None;
        }
    };
    if settings.strict {
        // What a strict reader takes is the same without it.
        let mut settings = settings;
        settings.strict = false;
        let again = settings.read("it.obj", &obj, &beside);
        assert_eq!(again.unwrap().triangles(), scene.triangles());
    }
    check_scene(&scene, obj.len());
    if scene.triangles().len() <= MOST_TRIANGLES {
        settle(&scene);
    }
    Some(scene)
}

/// The files of an input, of which the last may have any bytes.
fn split(input: &[u8]) -> Vec<&[u8]> {
    let (mut files, mut rest) = (vec![], input);
    while files.len() < NAMES.len() {
        let Some(at) = rest.windows(SEPARATOR.len()).position(|w| w == SEPARATOR) else { break };
        files.push(&rest[..at]);
        rest = &rest[at + SEPARATOR.len()..];
    }
    files.push(rest);
    files
}

/// `text` as it is, or, taken for Latin-1, in UTF-16 with and without a mark.
fn encoded(text: &[u8], choice: u8) -> Vec<u8> {
    let units = text.iter().map(|&letter| u16::from(letter));
    match choice & 3 {
        0 | 1 => text.into(),
        2 => [0xff, 0xfe].into_iter().chain(units.flat_map(u16::to_le_bytes)).collect(),
        _ => units.flat_map(u16::to_be_bytes).collect(),
    }
}

fn settings(choice: u8) -> SceneSettings {
    let mut settings = SceneSettings::default();
    settings.strict = choice & 4 != 0;
    if choice & 8 != 0 {
        settings.emit.push(("a".into(), Rgb::new(15.0, 0.0, 1e-300)));
    }
    settings.sky = [None, None, Some(Rgb::ZERO), Some(Rgb::new(0.0, 1.0, 2.0))]
        [usize::from(choice >> 4 & 3)]
    .map(Sky::uniform);
    if choice & 64 != 0 {
        settings.max_reflectance = 0.0;
    }
    settings
}

/// One short line that begins with the file, and has the three parts `place: found; remedy`.
pub fn check_error(e: &Error) {
    let message = e.to_string();
    let files = ["it.obj", "it.stl", "it.glb", NAMES[0], NAMES[2]];
    assert!(files.iter().any(|name| e.place().starts_with(name)), "{message}");
    assert!(matches!(e.kind(), ErrorKind::Scene | ErrorKind::File), "{message}");
    let parts = message.strip_prefix(e.place()).and_then(|m| m.strip_prefix(": "));
    let (found, remedy) = parts.and_then(|m| m.split_once("; ")).expect("three parts");
    assert!(!found.trim().is_empty() && !remedy.trim().is_empty(), "{message}");
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.len() < 4000, "{message}");
}

/// Every number is finite, and there is no more of anything than the file has `bytes`.
pub fn check_scene(scene: &Scene, bytes: usize) {
    assert!(!scene.triangles().is_empty());
    for t in 0..scene.triangles().len() {
        assert!((scene.normal(t).length() - 1.0).abs() < 1e-9, "normal {}", scene.normal(t));
        assert!(scene.area(t).is_finite(), "area {}", scene.area(t));
        let material = scene.material(t);
        assert!(material.exitance.is_finite() && material.exitance.min_element() >= 0.0);
        let reflectance = material.reflectance;
        assert!(reflectance.min_element() >= 0.0 && reflectance.max_element() < 1.0);
        check_textures(scene, t);
    }
    assert!(scene.sky().uniform_radiance().is_some_and(Rgb::is_finite));
    for count in [scene.positions().len(), scene.triangles().len(), scene.groups().len()] {
        assert!(count <= bytes, "{count} of {bytes} bytes");
    }
    for warning in scene.warnings().iter().map(ToString::to_string) {
        assert!(!warning.contains(char::is_control), "{warning:?}");
        assert!(warning.len() < 4000, "{warning}");
    }
}

/// Textures have a colour that a material may have, at any corner and over the triangle.
fn check_textures(scene: &Scene, t: usize) {
    let (Some(textures), Some(corners)) = (scene.textures(t), scene.texture_coordinates(t)) else {
        return;
    };
    let maps = [(&textures.reflectance, 1.0), (&textures.exitance, f64::INFINITY)];
    for (map, below) in maps.into_iter().filter_map(|(map, below)| Some((map.as_ref()?, below))) {
        let at_corners = corners.map(|uv| map.at(uv));
        for colour in at_corners.into_iter().chain([map.mean(corners), map.whole_mean()]) {
            assert!(colour.min_element() >= 0.0 && colour.max_element() < below, "{colour}");
        }
    }
}

/// A few shots of rays from elements of some size, and their light at the vertices.
pub fn settle(scene: &Scene) {
    let mesh = match Mesh::new(scene.clone(), scene.bounds().diagonal() / 4.0) {
        Ok(mesh) => mesh,
        Err(_) => return,
    };
    let mut rays = RayRows::new(&mesh, 16).expect("16 rays");
    let solver = Solver { max_steps: Some(16), ..Default::default() };
    let solution =
        solver.solve(&mesh, &mut rays, |_| ControlFlow::Continue(())).expect("good rows");
    assert!(solution.radiosity.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
    assert!(solution.ledger.imbalance() <= 1e-9, "{:?}", solution.ledger);
    let surface = VertexMesh::new(&mesh, &solution.radiosity);
    assert!(surface.radiosity.iter().all(|b| b.is_finite() && b.min_element() >= 0.0));
}
