//! Scenes and their parts.

use glam::DVec3;
use radiosity::{Material, Mesh, Rgb, Scene, Triangle};

/// Corners of a quadrilateral, counter-clockwise seen from its front.
pub type Quad = [[f64; 3]; 4];

/// A scene of quadrilaterals, each a group of its own: q0, q1 and so on.
pub fn quads(quads: &[(Quad, Material)]) -> Scene {
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

/// The two triangles that [`quads`] makes of a quadrilateral.
pub fn halves([a, b, c, d]: Quad) -> [[[f64; 3]; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// A horizontal rectangle at height `z` that faces up.
pub fn facing_up([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z: f64) -> Quad {
    [[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]]
}

/// The same rectangle facing down.
pub fn facing_down(x: [f64; 2], y: [f64; 2], z: f64) -> Quad {
    let [a, b, c, d] = facing_up(x, y, z);
    [a, d, c, b]
}

/// Walls of a box from `low` to `high`, seen from inside: x low and high, y, z.
pub fn walls(low: [f64; 3], high: [f64; 3]) -> [Quad; 6] {
    let ([a, b, c], [x, y, z]) = (low, high);
    [
        [[a, b, c], [a, y, c], [a, y, z], [a, b, z]],
        [[x, b, c], [x, b, z], [x, y, z], [x, y, c]],
        [[a, b, c], [a, b, z], [x, b, z], [x, b, c]],
        [[a, y, c], [x, y, c], [x, y, z], [a, y, z]],
        [[a, b, c], [x, b, c], [x, y, c], [a, y, c]],
        [[a, b, z], [a, y, z], [x, y, z], [x, b, z]],
    ]
}

/// The same walls seen from outside.
pub fn block(low: [f64; 3], high: [f64; 3]) -> [Quad; 6] {
    walls(low, high).map(|[a, b, c, d]| [a, d, c, b])
}

/// Sides and top of a block: it stands on something, and has no bottom.
pub fn standing_block([x0, x1]: [f64; 2], [y0, y1]: [f64; 2], z0: f64, z1: f64) -> [Quad; 5] {
    let (low, high) = (facing_up([x0, x1], [y0, y1], z0), facing_up([x0, x1], [y0, y1], z1));
    let side = |k: usize| [low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]];
    [side(0), side(1), side(2), side(3), high]
}

/// Unit cube seen from inside, walls x0, x1, y0, y1, z0, z1.
pub fn cube(material: &Material) -> Scene {
    quads(&walls([0.0; 3], [1.0; 3]).map(|w| (w, material.clone())))
}

/// The Cornell box that ships with the crate, in elements of at most `size` millimetres.
pub fn cornell_box(size: f64) -> Mesh {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj");
    Mesh::new(radiosity::load_scene(path).expect("the scene loads"), size).expect("a good size")
}

/// The scene with all triangles cut at the middles of their sides.
pub fn cut_into_four(scene: &Scene) -> Scene {
    let (mut positions, mut triangles) = (vec![], vec![]);
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let [a, b, c] = scene.corners(t);
        let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
        for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            let first = positions.len() as u32;
            positions.extend(corners);
            triangles.push(Triangle { corners: [first, first + 1, first + 2], ..*triangle });
        }
    }
    let (groups, materials) = (scene.groups().to_vec(), scene.materials().to_vec());
    Scene::new(positions, triangles, groups, materials).expect("a good scene")
}

/// A material that reflects half of the light.
pub fn grey() -> Material {
    Material::grey("grey", 0.5)
}

/// A material that reflects all channels alike and emits `exitance` W/m² in each.
pub fn paint(reflectance: f64, exitance: f64) -> Material {
    Material { exitance: Rgb::splat(exitance), ..Material::grey("paint", reflectance) }
}

/// A material that reflects nothing and emits `exitance`, W/m².
pub fn lamp(exitance: [f64; 3]) -> Material {
    Material { exitance: exitance.into(), ..Material::grey("lamp", 0.0) }
}
