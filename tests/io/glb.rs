//! glTF binary files, read by another crate.

use std::path::Path;

use gltf::Glb;
use gltf::mesh::Semantic;
use radiosity::glam::{DVec3, Quat, Vec3};
use radiosity::io::ToneCurve;
use radiosity::{
    ErrorKind, GatheredMesh, Material, Mesh, Rgb, Scene, Triangle, load_scene, write_glb,
};

/// Two groups, the first of two materials, from `at` on; the light grows along x.
fn light(at: DVec3) -> GatheredMesh {
    let plate = |z: f64| [[0., 0., z], [2., 0., z], [2., 1., z], [0., 1., z]].map(DVec3::from);
    let positions = [0.0, 1.0, 2.0].into_iter().flat_map(plate).map(|p| p + at).collect();
    let triangle = |first: u32, corners: [u32; 3], group, material| Triangle {
        corners: corners.map(|k| first + k),
        group,
        material,
        smoothing: None,
    };
    let plates = [(0, 0, 1), (4, 0, 0), (8, 1, 1)];
    let triangles = plates.into_iter().flat_map(|(first, group, material)| {
        [[0, 1, 2], [0, 2, 3]].map(|corners| triangle(first, corners, group, material))
    });
    let materials = vec![Material::grey("dark \"1\"", 0.25), Material::grey("µ", 0.5)];
    let groups = vec!["lower".into(), "upper".into()];
    let scene = Scene::new(positions, triangles.collect(), groups, materials).unwrap();
    let mesh = Mesh::new(scene, 0.4).unwrap();
    let radiosity: Vec<Rgb> = (0..mesh.element_count())
        .map(|e| Rgb::new(1.0, 2.0, 3.0) * (mesh.centroid(mesh.element(e)).x - at.x) + 0.5)
        .collect();
    GatheredMesh::from_elements(&mesh, &radiosity).unwrap()
}

/// What a file has of a primitive: names of its node and its material, and its vertices.
#[derive(Debug)]
struct Read {
    names: [String; 2],
    /// Where its positions are relative to, in the axes of the scene.
    origin: Vec3,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colours: Vec<Vec3>,
    radiosity: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    unlit: bool,
}

fn read(path: &Path) -> Vec<Read> {
    let bytes = std::fs::read(path).unwrap();
    let glb = Glb::from_slice(&bytes).unwrap();
    assert_eq!(glb.header.length as usize, bytes.len());
    // Validates all that the specification says of the JSON.
    let document = gltf::Gltf::from_slice(&bytes).unwrap().document;
    let binary = glb.bin.as_deref().unwrap();
    assert_eq!(document.buffers().next().unwrap().length(), binary.len());
    let top = document.default_scene().unwrap().nodes().next().unwrap();
    let (translation, rotation, _) = top.transform().decomposed();
    let origin = Quat::from_array(rotation).inverse() * Vec3::from(translation);
    let mut found = vec![];
    for node in top.children() {
        for primitive in node.mesh().unwrap().primitives() {
            let reader = primitive.reader(|_| Some(binary));
            let colours = reader.read_colors(0).unwrap().into_rgb_f32();
            let positions: Vec<Vec3> = reader.read_positions().unwrap().map(Vec3::from).collect();
            let radiosity = primitive.get(&Semantic::Extras("RADIOSITY".into())).unwrap();
            let radiosity = gltf::accessor::Iter::<[f32; 3]>::new(radiosity, |_| Some(binary));
            let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
            let bounds = primitive.bounding_box();
            let low = positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = positions.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            assert_eq!((Vec3::from(bounds.min), Vec3::from(bounds.max)), (low, high));
            found.push(Read {
                names: [node.name(), primitive.material().name()].map(|n| n.unwrap().to_string()),
                origin,
                positions,
                normals: reader.read_normals().unwrap().map(Vec3::from).collect(),
                colours: colours.map(Vec3::from).collect(),
                radiosity: radiosity.unwrap().map(Vec3::from).collect(),
                faces: indices.chunks_exact(3).map(|f| f.try_into().unwrap()).collect(),
                unlit: primitive.material().unlit(),
            });
        }
    }
    found
}

#[test]
fn glb_has_the_same_triangles_and_colours() {
    let (light, folder) = (light(DVec3::ZERO), tempfile::tempdir().unwrap());
    let path = folder.path().join("a.glb");
    let tone = ToneCurve::fit(&light.surface.radiosity);
    write_glb(&path, &light, &tone).unwrap();
    let found = read(&path);
    let names: Vec<[&str; 2]> = found.iter().map(|p| p.names.each_ref().map(|n| &**n)).collect();
    assert_eq!(names, [["lower", "dark \"1\""], ["lower", "µ"], ["upper", "µ"]]);
    assert!(found.iter().all(|primitive| primitive.unlit));
    // Every face of the surface once, corner by corner, with what its vertices have.
    let surface = &light.surface;
    let corner = |v: usize| {
        let vectors = [surface.positions[v], surface.normals[v], surface.radiosity[v]];
        [vectors[0], vectors[1], tone.linear(surface.radiosity[v]), vectors[2]].map(DVec3::as_vec3)
    };
    let key = |corners: &[[Vec3; 4]; 3]| corners.map(|c| c.map(|v| v.to_array().map(f32::to_bits)));
    let mut wanted: Vec<_> =
        surface.faces.iter().map(|f| key(&f.map(|v| corner(v as usize)))).collect();
    let corners = |p: &Read| {
        let corner = |v: usize| [p.positions[v], p.normals[v], p.colours[v], p.radiosity[v]];
        p.faces.iter().map(|f| key(&f.map(|v| corner(v as usize)))).collect::<Vec<_>>()
    };
    let mut faces: Vec<_> = found.iter().flat_map(corners).collect();
    wanted.sort_unstable();
    faces.sort_unstable();
    assert!(faces == wanted && faces.len() == 3 * found[0].faces.len());
    // The same bytes again, and no vertex that no face has.
    let first = std::fs::read(&path).unwrap();
    write_glb(&path, &light, &tone).unwrap();
    assert!(first == std::fs::read(&path).unwrap());
    assert_eq!(found.iter().map(|p| p.positions.len()).sum::<usize>(), surface.positions.len());
}

#[test]
fn glb_of_a_scene_far_from_the_origin_keeps_its_shape() {
    let (at, folder) = (DVec3::new(4.0e5, -3.0e5, 10.0), tempfile::tempdir().unwrap());
    let path = folder.path().join("a.glb");
    let shown = |at: DVec3| {
        let light = light(at);
        write_glb(&path, &light, &ToneCurve::fit(&light.surface.radiosity)).unwrap();
        read(&path)
    };
    let (near, far) = (shown(DVec3::ZERO), shown(at));
    // Floats of 4e5 are 0.03 apart. Relative to the place that the node moves them to, coordinates
    // of about 1 are off by a rounding of 1e-7 each, and by one of 6e-11 in 64 bits.
    for (a, b) in near.iter().zip(&far) {
        assert_eq!(a.origin, Vec3::ZERO);
        assert!((b.origin - (at + DVec3::new(1.0, 0.5, 1.0)).as_vec3()).length() < 0.1);
        for (p, q) in a.positions.iter().zip(&b.positions) {
            let (p, q) = (*p - a.positions[0], *q - b.positions[0]);
            assert!((p - q).abs().max_element() < 5e-7, "{p} {q}");
        }
    }
}

#[test]
fn glb_that_cannot_be_written_is_an_error() {
    let light = light(DVec3::ZERO);
    let tone = ToneCurve::fit(&light.surface.radiosity);
    let e = write_glb("no/such/folder/a.glb", &light, &tone).unwrap_err();
    assert!(e.kind() == ErrorKind::File && e.to_string().contains("no/such/folder/a.glb"), "{e}");
}

/// A light beyond floats, and none: numbers that glTF allows.
#[test]
fn glb_has_finite_numbers_for_any_light() {
    let scene = load_scene(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell_box.obj")).unwrap();
    let mesh = Mesh::new(scene, 200.0).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    for radiosity in [0.0, 1e-300, 1e300] {
        let radiosity = vec![Rgb::splat(radiosity); mesh.element_count()];
        let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
        write_glb(&path, &light, &ToneCurve::fit(&light.surface.radiosity)).unwrap();
        for primitive in read(&path) {
            let lights = primitive.colours.iter().chain(&primitive.radiosity);
            assert!(lights.into_iter().all(|v| v.is_finite()));
            assert!(primitive.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-6));
        }
    }
}
