//! Surfaces with two sides in glTF files: apart, or one face for both.

use std::path::Path;

use radiosity::glam::{DVec3, Vec3};
use radiosity::io::{GlbSettings, ToneCurve};
use radiosity::{GatheredMesh, Material, Mesh, Rgb, Scene, Triangle, write_glb};

/// A triangle of a file: group, corners and whether both sides are seen.
#[derive(Debug)]
struct Face {
    group: String,
    corners: [Vec3; 3],
    is_double_sided: bool,
}

impl Face {
    fn normal(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a).normalize()
    }
}

fn read(path: &Path) -> Vec<Face> {
    let bytes = std::fs::read(path).unwrap();
    let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
    let binary = blob.unwrap();
    let mut faces = vec![];
    for node in document.nodes().filter(|node| node.mesh().is_some()) {
        for primitive in node.mesh().unwrap().primitives() {
            let reader = primitive.reader(|_| Some(&binary));
            let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            faces.extend(indices.as_chunks::<3>().0.iter().map(|face| Face {
                group: node.name().unwrap().into(),
                corners: face.map(|v| positions[v as usize]),
                is_double_sided: primitive.material().double_sided(),
            }));
        }
    }
    faces
}

/// Triangles of these corners, in groups, with the light that each has.
type Part<'a> = (&'a str, [[f64; 3]; 3], f64);

/// The file of a scene of `parts` beside a ground of 100 × 100, in elements of this size, whose
/// light has an error of 1 %.
fn written(parts: &[Part<'_>], size: f64) -> Vec<Face> {
    let ground = [[-50.0, -50.0, -9.0], [50.0, -50.0, -9.0], [-50.0, 50.0, -9.0]];
    let parts: Vec<Part<'_>> = parts.iter().copied().chain([("ground", ground, 1.0)]).collect();
    let mut groups: Vec<String> = parts.iter().map(|part| part.0.to_string()).collect();
    groups.dedup();
    let triangle = |(k, part): (u32, &Part<'_>)| Triangle {
        corners: [3 * k, 3 * k + 1, 3 * k + 2],
        group: groups.iter().position(|group| group == part.0).unwrap() as u32,
        ..Triangle::default()
    };
    let triangles: Vec<Triangle> = (0..).zip(&parts).map(triangle).collect();
    let positions = parts.iter().flat_map(|part| part.1).map(DVec3::from).collect();
    let materials = vec![Material::grey("grey", 0.5)];
    let scene = Scene::new(positions, triangles, groups, materials).unwrap();
    let mesh = Mesh::new(scene, size).unwrap();
    let of = |e: usize| Rgb::splat(parts[mesh.triangle(mesh.element(e))].2);
    let light: Vec<Rgb> = (0..mesh.element_count()).map(of).collect();
    let light = GatheredMesh::from_elements(&mesh, &light).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    let mut settings = GlbSettings::from(&ToneCurve::fit(&light.surface.radiosity));
    settings.error = 0.01;
    write_glb(&path, &light, settings).unwrap();
    let mut faces = read(&path);
    faces.retain(|face| face.group != "ground");
    faces
}

/// The scene's diagonal, √(100² + 100² + 10²) with parts up to z = 1, of which the gap is 1e-4.
const GAP: f64 = 1e-4 * 141.774_5;

const A: [f64; 3] = [0.0, 0.0, 0.0];
const B: [f64; 3] = [4.0, 0.0, 0.0];
const C: [f64; 3] = [0.0, 3.0, 0.0];
const D: [f64; 3] = [0.0, 3.0, 1.0];

#[test]
fn two_lights_are_two_faces_apart() {
    // Up with 1, down with 2, with corners in another order; so that the box ends at z = 1 a third.
    let mast = [[9.0, 9.0, 0.0], [9.5, 9.0, 0.0], [9.0, 9.0, 1.0]];
    for back in [[A, C, B], [C, B, A], [B, A, C]] {
        let faces =
            written(&[("sheet", [A, B, C], 1.0), ("sheet", back, 2.0), ("mast", mast, 1.0)], 1.0);
        let sheet = || faces.iter().filter(|face| face.group == "sheet");
        assert!(sheet().all(|face| !face.is_double_sided));
        let height = |face: &Face| face.corners.map(|p| f64::from(p.z));
        let (up, down): (Vec<&Face>, Vec<&Face>) = sheet().partition(|face| face.normal().z > 0.0);
        assert!(up.len() == down.len() && up.len() > 30);
        // The first stays, the second is where it looks, by the gap; in 24 bits.
        assert!(up.iter().all(|face| height(face) == [0.0; 3]));
        for z in down.iter().flat_map(|face| height(face)) {
            assert!((z + GAP).abs() < 1e-6 * GAP, "{z}");
        }
    }
}

#[test]
fn one_light_is_one_face() {
    // 1.005 and 0.995 differ by 1 %, of which three times the error are 3 %; 1.02 and 0.98 by 4 %.
    for (lights, count) in [([1.005, 0.995], 1), ([1.0, 1.0], 1), ([1.02, 0.98], 2)] {
        let [front, back] = lights;
        let faces = written(&[("sheet", [A, B, C], front), ("sheet", [A, C, B], back)], 9.0);
        assert_eq!(faces.len(), count, "{lights:?}");
        assert!(faces.iter().all(|face| face.is_double_sided == (count == 1)), "{lights:?}");
        assert!(faces[0].normal().z > 0.0);
    }
}

/// Two sheets in one group, of which one has the same light on both sides.
#[test]
fn each_connected_surface_decides_for_itself() {
    let other = |p: [f64; 3]| [p[0] + 10.0, p[1], p[2]];
    let [a, b, c] = [A, B, C].map(other);
    let parts = [
        ("sheet", [A, B, C], 1.0),
        ("sheet", [a, b, c], 1.0),
        ("sheet", [A, C, B], 1.0),
        ("sheet", [a, c, b], 3.0),
    ];
    let faces = written(&parts, 9.0);
    let seen = |far: bool| {
        let of = faces.iter().filter(|face| (face.corners[0].x > 5.0) == far);
        of.map(|face| face.is_double_sided).collect::<Vec<_>>()
    };
    assert_eq!((seen(false), seen(true)), (vec![true], vec![false, false]));
}

/// A sheet that is folded by a right angle stays closed along the fold, on both of its sides.
#[test]
fn folds_stay_closed() {
    let floor = [0.0, 3.0, 0.0];
    let parts = [
        ("sheet", [A, B, floor], 1.0),
        ("sheet", [A, floor, D], 1.0),
        ("sheet", [A, floor, B], 2.0),
        ("sheet", [A, D, floor], 2.0),
    ];
    let faces = written(&parts, 0.5);
    let on_fold = |p: &Vec3| p.x.abs() < 0.5 * GAP as f32 + 1e-4 && p.z.abs() < 0.02;
    let of_side = |k: usize| {
        let of = faces.iter().filter(|face| {
            let n = face.normal();
            [n.z > 0.5, n.x > 0.5, n.z < -0.5, n.x < -0.5][k]
        });
        let mut fold: Vec<[u32; 3]> = of
            .flat_map(|face| face.corners)
            .filter(on_fold)
            .map(|p| p.to_array().map(f32::to_bits))
            .collect();
        fold.sort_unstable();
        fold.dedup();
        fold
    };
    for (level, upright) in [(0, 1), (2, 3)] {
        assert!(of_side(level).len() > 5);
        assert_eq!(of_side(level), of_side(upright));
    }
}

/// A leaf of 5 mm on this ground is moved by a hundredth of its size, not by three times that.
#[test]
fn small_leaves_keep_their_shape() {
    let [a, b, c] = [A, B, C].map(|p| p.map(|x| 1e-3 * x));
    let faces = written(&[("leaf", [a, b, c], 1.0), ("leaf", [a, c, b], 2.0)], 9.0);
    let moved = faces.iter().find(|face| face.normal().z < 0.0).unwrap();
    for p in moved.corners {
        assert!((p.z + 5e-5).abs() < 1e-9, "{p}");
    }
}

/// Both sides in a file may be cut along other diagonals: they have no common triangle, and stay
/// apart.
#[test]
fn other_diagonals_are_apart() {
    let e = [4.0, 3.0, 0.0];
    let parts = [
        ("sheet", [A, B, e], 1.0),
        ("sheet", [A, e, C], 1.0),
        ("sheet", [A, C, B], 1.0),
        ("sheet", [B, C, e], 1.0),
    ];
    let faces = written(&parts, 9.0);
    assert_eq!(faces.len(), 4);
    for face in faces {
        let is_moved = face.corners.iter().all(|p| p.z < 0.0);
        assert_eq!(is_moved, face.normal().z < 0.0, "{face:?}");
        assert!(!face.is_double_sided);
    }
}
