//! Where glTF files put a scene: +Y up, in metres.

use std::path::Path;

use radiosity::glam::{DQuat, DVec3, Mat4, Vec3};
use radiosity::io::{GlbSettings, ToneCurve};
use radiosity::scene::Aabb;
use radiosity::{GatheredMesh, Mesh, Rgb, Scene, write_glb};

use crate::common::scenes::{Quad, block, facing_up, grey, quads};

/// A tower on a ground, with its height along +z, so far from the origin.
fn tower(at: f64) -> Vec<Quad> {
    let [x, y] = [[at, at + 4.0], [at, at + 5.0]];
    let mut all = block([at + 1.0, at + 1.0, 0.0], [at + 2.0, at + 2.0, 7.0]).to_vec();
    all.push(facing_up(x, y, 0.0));
    all
}

fn of(parts: &[Quad]) -> Scene {
    quads(&parts.iter().map(|&quad| (quad, grey())).collect::<Vec<_>>())
}

fn lit(parts: &[Quad]) -> GatheredMesh {
    lit_scene(of(parts))
}

fn lit_scene(scene: Scene) -> GatheredMesh {
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let light = vec![Rgb::ONE; mesh.element_count()];
    GatheredMesh::from_elements(&mesh, &light).unwrap()
}

/// Positions and normals of all vertices, as viewers have them.
fn shown(path: &Path) -> Vec<[Vec3; 2]> {
    let bytes = std::fs::read(path).unwrap();
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let binary = blob.unwrap();
    let scene = document.default_scene().unwrap();
    assert_eq!(scene.nodes().count(), 1);
    let top = scene.nodes().next().unwrap();
    let placed = Mat4::from_cols_array_2d(&top.transform().matrix());
    let mut all = vec![];
    for primitive in top.children().flat_map(|node| node.mesh().unwrap().primitives()) {
        let reader = primitive.reader(|_| Some(&binary));
        let positions = reader.read_positions().unwrap().map(Vec3::from);
        let normals = reader.read_normals().unwrap().map(Vec3::from);
        all.extend(
            positions.zip(normals).map(|(p, n)| {
                [placed.transform_point3(p), placed.transform_vector3(n).normalize()]
            }),
        );
    }
    all
}

/// Whether vertices are those of `light` where `turn` and `metres` put them.
fn is_placed(light: &GatheredMesh, found: &[[Vec3; 2]], turn: DQuat, metres: f64) -> bool {
    let surface = &light.surface;
    let wanted = surface.positions.iter().zip(&surface.normals);
    let wanted = wanted.map(|(&p, &n)| [turn * p * metres, turn * n].map(DVec3::as_vec3));
    let wanted: Vec<[Vec3; 2]> = wanted.collect();
    let size = metres * light.mesh.scene().bounds().diagonal();
    // Coordinates up to 16 sizes from the origin, and rotations and scales of 24 bits: each is off
    // by 6e-8 of 16 sizes or less, and three of them add up.
    let near = |[p, n]: &[Vec3; 2], [q, m]: &[Vec3; 2]| {
        p.distance(*q) < (16.0 * 3.0 * 6e-8 * size) as f32 && n.distance(*m) < 1e-6
    };
    found.len() == wanted.len() && found.iter().all(|a| wanted.iter().any(|b| near(a, b)))
}

fn write(light: &GatheredMesh, change: impl Fn(&mut GlbSettings)) -> Vec<[Vec3; 2]> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let mut settings = GlbSettings::from(&ToneCurve::fit(&light.surface.radiosity));
    change(&mut settings);
    write_glb(&path, light, settings).unwrap();
    shown(&path)
}

#[test]
fn z_up_is_found_and_turned() {
    let z_up = lit(&tower(0.0));
    // (x, y, z) becomes (x, z, -y).
    let turn = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let found = write(&z_up, |_| ());
    assert!(is_placed(&z_up, &found, turn, 1.0));
    let highest = found.iter().map(|[p, _]| p.y).fold(0.0, f32::max);
    // A rotation of 24 bits: four products.
    assert!((highest - 7.0).abs() < 7.0 * 4.0 * 6e-8, "{highest}");
}

#[test]
fn y_up_stays_and_units_are_scaled() {
    // The tower with its height along +y.
    let turned = tower(0.0).into_iter().map(|quad| quad.map(|[x, y, z]| [x, z, -y]));
    let y_up = lit(&turned.collect::<Vec<_>>());
    assert!(is_placed(&y_up, &write(&y_up, |_| ()), DQuat::IDENTITY, 1.0));
    for metres in [1e-3, 0.0254, 0.3048] {
        let found = write(&y_up, |settings| settings.metres = metres);
        assert!(is_placed(&y_up, &found, DQuat::IDENTITY, metres), "{metres}");
    }
}

#[test]
fn up_that_is_given_counts() {
    for up in [DVec3::X, DVec3::Y, DVec3::NEG_Z, DVec3::new(0.0, 0.6, 0.8)] {
        let light = lit_scene(of(&tower(0.0)).with_up(2.0 * up));
        let found = write(&light, |settings| settings.metres = 0.01);
        let turn = DQuat::from_rotation_arc(up, DVec3::Y);
        assert!((turn * up).distance(DVec3::Y) < 1e-12);
        assert!(is_placed(&light, &found, turn, 0.01), "{up}");
    }
}

/// Numbers of 24 bits have steps of a millimetre at 10 km: positions are relative to a nearer
/// point, and the top node turns and scales that too.
#[test]
fn far_from_the_origin_is_turned_and_scaled() {
    let (near, far) = (lit(&tower(0.0)), lit(&tower(1e4)));
    let settings = |settings: &mut GlbSettings| settings.metres = 0.01;
    let (of_near, of_far) = (write(&near, settings), write(&far, settings));
    let middle = |all: &[[Vec3; 2]]| {
        let bounds = Aabb::from_points(all.iter().map(|[p, _]| p.as_dvec3()));
        bounds.centre()
    };
    let moved = middle(&of_far) - middle(&of_near);
    // 10 000 units of a centimetre along x and along y, which is -z of the file; in 24 bits.
    assert!(moved.distance(DVec3::new(100.0, 0.0, -100.0)) < 2e-5, "{moved}");
}

#[test]
fn a_scene_without_an_axis_of_its_own_is_y_up() {
    // A cube looks the same from all sides.
    let light = lit(&block([0.0; 3], [1.0; 3]));
    assert!(is_placed(&light, &write(&light, |_| ()), DQuat::IDENTITY, 1.0));
}
