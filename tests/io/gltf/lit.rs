//! The same file with light.

use std::fs;
use std::ops::ControlFlow;
use std::path::Path;

use radiosity::io::{LitVertices, ToneCurve, read_scene, write_lit_gltf};
use radiosity::{Backend, BakeTarget, GatheredMesh, load_scene};
use serde_json::{Value, json};

use crate::common::gltf::{Gltf, HALVES, SQUARE};

fn baked(path: &Path) -> GatheredMesh {
    let go = |_: &_| ControlFlow::Continue(());
    BakeTarget::Error(0.1).bake(load_scene(path).unwrap(), &Backend::Cpu, go).unwrap().light
}

/// The document of a file, and its binary chunk.
pub fn parts(bytes: &[u8]) -> (Value, Vec<u8>) {
    if !bytes.starts_with(b"glTF") {
        return (serde_json::from_slice(bytes).unwrap(), vec![]);
    }
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!(word(8), bytes.len());
    let json = &bytes[20..20 + word(12)];
    let binary = 20 + word(12);
    (serde_json::from_slice(json).unwrap(), bytes[binary + 8..binary + 8 + word(binary)].to_vec())
}

/// Floats of an accessor.
fn floats(json: &Value, binary: &[u8], accessor: &Value) -> Vec<[f32; 3]> {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let offset = view["byteOffset"].as_u64().unwrap() as usize;
    let numbers =
        binary[offset..].chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap()));
    let numbers: Vec<f32> =
        numbers.take(3 * accessor["count"].as_u64().unwrap() as usize).collect();
    numbers.as_chunks().0.to_vec()
}

/// A floor in the sky with a wall of the same mesh on it, and what light does not know.
fn floor_and_wall() -> Gltf {
    let turn = [0.5f64.sqrt(), 0.0, 0.0, 0.5f64.sqrt()];
    let mut gltf = Gltf::new(json!([
        { "mesh": 0, "name": "floor", "rotation": [-turn[0], 0, 0, turn[3]],
          "extras": { "a": 0.1 } },
        { "mesh": 0, "name": "wall", "scale": [1, 0.7, 1], "translation": [0, 0, -0.5] },
        { "name": "empty", "extensions": { "ACME_thing": [1, 2.50] } },
    ]));
    gltf.add_square(0);
    let normals = gltf.add_floats(&[[0.0, 0.0, 1.0]; 4]);
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normals);
    gltf.json["materials"] = json!([{ "pbrMetallicRoughness":
        { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } }]);
    gltf.json["animations"] = json!([{ "channels": [], "samplers": [], "name": "still" }]);
    gltf
}

fn written(gltf: &[u8], name: &str) -> (Vec<u8>, LitVertices, GatheredMesh) {
    let folder = tempfile::tempdir().unwrap();
    let (source, path) = (folder.path().join(name), folder.path().join(format!("lit.{name}")));
    fs::write(&source, gltf).unwrap();
    let light = baked(&source);
    let tone = ToneCurve::with_exposure(1.0);
    let counts = write_lit_gltf(&path, &source, &light, None, &tone).unwrap();
    // What was written can be read and lit again.
    assert_eq!(load_scene(&path).unwrap().triangles(), load_scene(&source).unwrap().triangles());
    (fs::read(&path).unwrap(), counts, light)
}

/// Without what was added, the document is that of the source, and so are the first bytes of its
/// buffer.
fn check_rest(source: &Gltf, json: &Value, binary: &[u8]) {
    let mut rest = json.clone();
    for list in ["accessors", "bufferViews", "meshes"] {
        let count = source.json[list].as_array().unwrap().len();
        rest[list].as_array_mut().unwrap().truncate(count);
    }
    for primitive in rest["meshes"].as_array_mut().unwrap().iter_mut() {
        let primitive = primitive["primitives"][0].as_object_mut().unwrap();
        let extras = primitive.remove("extras");
        let attributes = primitive["attributes"].as_object_mut().unwrap();
        attributes.remove("_IRRADIANCE");
        let has_colours =
            source.json["meshes"][0]["primitives"][0]["attributes"].get("COLOR_0").is_some();
        if !has_colours {
            attributes.remove("COLOR_0");
        }
        let of_light = json!({ "radiosity": { "COLOR_0": "light" } });
        assert_eq!(extras, (!has_colours).then_some(of_light));
    }
    rest["buffers"] = json!([{ "byteLength": source.binary.len() }]);
    for node in 0..3 {
        rest["nodes"][node]["mesh"] = source.json["nodes"][node]["mesh"].clone();
    }
    rest["nodes"][2].as_object_mut().unwrap().remove("mesh");
    let mut wanted = source.json.clone();
    wanted["buffers"] = json!([{ "byteLength": source.binary.len() }]);
    assert_eq!(rest, wanted);
    assert_eq!(&binary[..source.binary.len()], source.binary);
}

#[test]
fn each_use_of_a_mesh_has_its_light() {
    let source = floor_and_wall();
    let (bytes, counts, light) = written(&source.glb(), "it.glb");
    let scene = read_scene("it.glb", &source.glb(), &[]).unwrap();
    assert_eq!(counts, LitVertices { lit: 8, without: 0, instances: 0 });
    let (json, binary) = parts(&bytes);
    check_rest(&source, &json, &binary);
    let mesh = |node: usize| json["nodes"][node]["mesh"].as_u64().unwrap() as usize;
    assert_eq!((mesh(0), mesh(1)), (0, 1));
    for (node, group) in [(0, 0), (1, 1)] {
        let attributes = &json["meshes"][mesh(node)]["primitives"][0]["attributes"];
        let irradiance = floats(&json, &binary, &attributes["_IRRADIANCE"]);
        let colours = floats(&json, &binary, &attributes["COLOR_0"]);
        // The mean of what the bake has at the corners: on both sides of the wall.
        for (v, corner) in SQUARE.iter().enumerate() {
            let mut all = (0..2).flat_map(|k| {
                let corners = scene.corners(2 * group + k);
                HALVES[3 * k..].iter().copied().zip(corners)
            });
            let position = all.find(|(k, _)| usize::from(*k) == v).unwrap().1;
            let surface = &light.surface;
            let here = (0..surface.positions.len()).filter(|&k| surface.positions[k] == position);
            let baked: Vec<f64> = here.map(|k| surface.irradiance[k].x).collect();
            let mean = baked.iter().sum::<f64>() / baked.len() as f64;
            let found = f64::from(irradiance[v][0]);
            assert!((found - mean).abs() < 1e-6 * mean, "{corner:?}: {baked:?} {irradiance:?}");
            assert!((0.0..=1.0).contains(&colours[v][0]) && colours[v][0] > 0.0);
        }
    }
}

#[test]
fn colours_of_the_file_stay() {
    let mut source = floor_and_wall();
    let colours = source.add_floats(&[[0.5f32, 0.5, 0.5]; 4]);
    source.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colours);
    let (json, binary) = parts(&written(&source.glb(), "it.glb").0);
    check_rest(&source, &json, &binary);
    for mesh in 0..2 {
        let attributes = &json["meshes"][mesh]["primitives"][0]["attributes"];
        assert_eq!(attributes["COLOR_0"], json!(colours));
        assert!(floats(&json, &binary, &attributes["_IRRADIANCE"]).iter().all(|e| e[0] > 0.0));
    }
}

/// A JSON file keeps its buffer, and has new numbers in one of its own.
#[test]
fn json_files_stay_json() {
    let mut source = floor_and_wall();
    let data = "AAAA".repeat(source.binary.len().div_ceil(3));
    source.json["buffers"] = json!([{ "byteLength": source.binary.len(),
        "uri": format!("data:application/octet-stream;base64,{data}") }]);
    // All is 0 there: squares without area.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("it.gltf");
    fs::write(&path, source.json.to_string()).unwrap();
    assert!(load_scene(&path).is_err());
    fs::write(folder.path().join("all.bin"), &source.binary).unwrap();
    source.json["buffers"] = json!([{ "byteLength": source.binary.len(), "uri": "all.bin" }]);
    fs::write(&path, source.json.to_string()).unwrap();
    let lit = folder.path().join("lit.gltf");
    let tone = ToneCurve::with_exposure(1.0);
    write_lit_gltf(&lit, &path, &baked(&path), None, &tone).unwrap();
    let (json, _) = parts(&fs::read(&lit).unwrap());
    assert_eq!(json["buffers"][0], source.json["buffers"][0]);
    let uri = json["buffers"][1]["uri"].as_str().unwrap();
    assert!(uri.starts_with("data:application/octet-stream;base64,"), "{uri}");
    assert_eq!(load_scene(&lit).unwrap().triangles().len(), 4);
}
