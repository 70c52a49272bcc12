use std::fmt::Write as _;
use std::ops::ControlFlow;

use radiosity::glam::DVec3;
use radiosity::io::read_scene;
use radiosity::{Backend, BakeTarget, Scene, load_scene};
use serde_json::{Value, json};

use super::read;
use crate::common::gltf::{Gltf, merged};

/// Positions in 32 bits, as glTF has them.
fn positions(scene: &Scene) -> Vec<DVec3> {
    scene.positions().iter().map(|p| p.as_vec3().as_dvec3()).collect()
}

/// The same scene as OBJ and MTL files.
fn as_obj(scene: &Scene) -> (String, String) {
    let (mut obj, mut mtl) = (String::from("mtllib m.mtl\n"), String::new());
    for material in scene.materials() {
        let [r, g, b] = material.reflectance.to_array();
        let [er, eg, eb] = (material.exitance / std::f64::consts::PI).to_array();
        let name = &material.name;
        writeln!(mtl, "newmtl {name}\nKd {r} {g} {b}\nKe {er} {eg} {eb}").unwrap();
    }
    for p in positions(scene) {
        writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
    }
    for t in scene.triangles() {
        let [a, b, c] = t.corners.map(|k| k + 1);
        let (group, material) =
            (&scene.groups()[t.group as usize], &scene.materials()[t.material as usize].name);
        writeln!(obj, "g {group}\nusemtl {material}\nf {a} {b} {c}").unwrap();
    }
    (obj, mtl)
}

/// The same scene as glTF: a node and a mesh for each group, a primitive for each of its runs of
/// one material.
fn as_gltf(scene: &Scene) -> Gltf {
    let material = |material: &radiosity::Material| {
        let [r, g, b] = material.reflectance.to_array();
        let radiance = material.exitance / std::f64::consts::PI;
        let strength = radiance.max_element();
        let mut json = json!({
            "name": material.name, "doubleSided": true,
            "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0 },
        });
        if strength > 0.0 {
            let extensions =
                json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strength } });
            let factor = (radiance / strength).to_array();
            json = merged(json, json!({ "emissiveFactor": factor, "extensions": extensions }));
        }
        json
    };
    let named = |(k, name): (usize, &String)| json!({ "mesh": k, "name": name });
    let nodes: Vec<Value> = scene.groups().iter().enumerate().map(named).collect();
    let mut gltf = Gltf::new(Value::Array(nodes));
    gltf.json["materials"] = scene.materials().iter().map(material).collect();
    let all: Vec<[f32; 3]> = scene.positions().iter().map(|p| p.as_vec3().to_array()).collect();
    let position = gltf.add_floats(&all);
    for group in 0..scene.groups().len() as u32 {
        let of_group: Vec<_> = scene.triangles().iter().filter(|t| t.group == group).collect();
        let mut primitives = vec![];
        for run in of_group.chunk_by(|a, b| a.material == b.material) {
            let corners: Vec<u16> = run.iter().flat_map(|t| t.corners).map(|k| k as u16).collect();
            let (attributes, indices) =
                (json!({ "POSITION": position }), gltf.add_indices(&corners));
            let material = run[0].material;
            primitives.push(
                json!({ "attributes": attributes, "indices": indices, "material": material }),
            );
        }
        gltf.json["meshes"].as_array_mut().unwrap().push(json!({ "primitives": primitives }));
    }
    gltf
}

/// Both files have the same 64-bit reflectances and 32-bit positions, and light is computed from
/// them in the same order; exitances differ by the rounding of factor times strength.
#[test]
fn light_in_the_cornell_box_is_that_of_the_obj_file() {
    let scene = load_scene("scenes/cornell_box.obj").unwrap();
    let (obj, mtl) = as_obj(&scene);
    let files: [(&str, &[u8]); 1] = [("m.mtl", mtl.as_bytes())];
    let from_obj = read_scene("it.obj", obj.as_bytes(), &files).unwrap();
    let from_gltf = read(&as_gltf(&scene)).unwrap();
    assert_eq!(from_gltf.groups(), from_obj.groups());
    let bake = |scene: Scene| {
        let go = |_: &_| ControlFlow::Continue(());
        BakeTarget::Error(0.1).bake(scene, &Backend::Cpu, go).unwrap().light.surface
    };
    let [obj, gltf] = [from_obj, from_gltf].map(bake);
    assert_eq!(obj.positions, gltf.positions);
    for (a, b) in obj.radiosity.iter().zip(&gltf.radiosity) {
        assert!(a.abs_diff_eq(*b, 1e-12 * a.max_element()), "{a} {b}");
    }
}
