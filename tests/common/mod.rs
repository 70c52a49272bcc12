//! What the integration tests share: scenes with known answers, and the device.
#![allow(dead_code)]

pub mod closed_forms;
pub mod files;
pub mod framed;
pub mod surface;
pub mod truth;
pub mod walls;

use glam::DVec3;
use radiosity::{Gpu, Material, Mesh, Scene, Triangle};

/// The graphics device. Without one the test fails, unless RADIOSITY_NO_GPU is set: then it is
/// skipped, and says so.
pub fn gpu() -> Option<Gpu> {
    if std::env::var_os("RADIOSITY_NO_GPU").is_some() {
        eprintln!("skipped: RADIOSITY_NO_GPU is set");
        return None;
    }
    Some(Gpu::new(None).expect("a graphics adapter; set RADIOSITY_NO_GPU to do without"))
}

/// A scene of quadrilaterals, each a group of its own: corners counter-clockwise from the front.
pub fn quads(quads: &[([[f64; 3]; 4], Material)]) -> Scene {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (k, (corners, _)) in (0u32..).zip(quads) {
        positions.extend(corners.map(DVec3::from_array));
        for corners in [[4 * k, 4 * k + 1, 4 * k + 2], [4 * k, 4 * k + 2, 4 * k + 3]] {
            triangles.push(Triangle { corners, group: k, material: k, smoothing: None });
        }
    }
    let names = (0..quads.len()).map(|k| format!("q{k}")).collect();
    let materials = quads.iter().map(|q| q.1.clone()).collect();
    Scene::new(positions, triangles, names, materials).expect("a good scene")
}

/// Unit cube seen from inside, walls x0, x1, y0, y1, z0, z1.
pub fn cube(material: &Material) -> Scene {
    let walls = walls::walls([0.0; 3], [1.0; 3]);
    quads(&walls.map(|w| (w, material.clone())))
}

/// The Cornell box that ships with the crate, in elements of at most `size` millimetres.
pub fn cornell_box(size: f64) -> Mesh {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    Mesh::new(radiosity::load_obj(path).expect("the scene loads"), size).expect("a good size")
}
