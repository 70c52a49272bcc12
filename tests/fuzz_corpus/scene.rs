//! What the fuzz target does with an input, and the replay of its corpus in `tests/fuzz_corpus.rs`.

use radiosity::io::read_obj;
use radiosity::{Error, Mesh, RayRows, Scene, Solver, VertexMesh};
use std::ops::ControlFlow;

/// Parts the OBJ file from the MTL file in an input. In UTF-8 there is no such byte.
const SEPARATOR: u8 = 0xff;

/// Scenes of more triangles are only loaded, so that an input takes milliseconds.
const MOST_TRIANGLES: usize = 64;

/// Loads an OBJ file that may name one library, `m.mtl`, and lets light settle in the scene if
/// there is one. Panics where a scene or an error breaks its promises.
pub fn try_scene(input: &[u8]) -> Option<Scene> {
    let mut files = input.splitn(2, |&byte| byte == SEPARATOR);
    let obj = files.next().unwrap_or_default();
    let libraries: Vec<_> = files.map(|mtl| ("m.mtl", mtl)).collect();
    let scene = match read_obj("it.obj", obj, &libraries) {
        Ok(scene) => scene,
        Err(e) => {
            check_error(&e);
            return None;
        }
    };
    check_scene(&scene, input.len());
    if scene.triangles().len() <= MOST_TRIANGLES {
        settle(&scene);
    }
    Some(scene)
}

/// One short line that begins with the file, and has the three parts `place: found; remedy`.
fn check_error(e: &Error) {
    let message = e.to_string();
    assert!(e.place().starts_with("it.obj") || e.place().starts_with("m.mtl"), "{message}");
    let parts = message.strip_prefix(e.place()).and_then(|m| m.strip_prefix(": "));
    let (found, remedy) = parts.and_then(|m| m.split_once("; ")).expect("three parts");
    assert!(!found.trim().is_empty() && !remedy.trim().is_empty(), "{message}");
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.len() < 4000, "{message}");
}

/// Every number is finite, and there is no more of anything than the input has bytes.
fn check_scene(scene: &Scene, bytes: usize) {
    assert!(!scene.triangles().is_empty());
    for t in 0..scene.triangles().len() {
        assert!((scene.normal(t).length() - 1.0).abs() < 1e-9, "normal {}", scene.normal(t));
        assert!(scene.area(t).is_finite(), "area {}", scene.area(t));
        assert!(scene.material(t).exitance.is_finite());
    }
    for count in [scene.positions().len(), scene.triangles().len(), scene.groups().len()] {
        assert!(count <= bytes, "{count} of {bytes} bytes");
    }
    for warning in scene.warnings().iter().map(ToString::to_string) {
        assert!(!warning.contains(char::is_control), "{warning:?}");
        assert!(warning.len() < 4000, "{warning}");
    }
}

/// A few shots of rays from elements of some size, and their light at the vertices.
fn settle(scene: &Scene) {
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
