//! glTF files in, and out again with light.

use std::fs;

use serde_json::json;

use crate::gltf_files::Gltf;
use crate::{refused, run, texts};

/// A lit square and two cameras.
fn lamp() -> Gltf {
    let lamp = json!({ "name": "lamp", "emissiveFactor": [1, 1, 1],
        "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } });
    let mut gltf = Gltf::of_material(lamp);
    gltf.json["nodes"] = json!([
        { "mesh": 0 },
        { "name": "front", "camera": 0, "translation": [0.5, 0.5, 3] },
        { "name": "side", "camera": 0, "translation": [0.5, 0.25, 4] },
    ]);
    gltf.json["scenes"] = json!([{ "nodes": [0, 1, 2], "name": "hall" }]);
    gltf.json["cameras"] =
        json!([{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }]);
    gltf
}

#[test]
fn the_scene_is_written_beside_itself_with_light() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    fs::write(&path, lamp().glb()).unwrap();
    let scene = path.to_str().unwrap();
    let out = run("bake", &[scene, "--cpu", "--error", "0.5", "--camera", "side"]);
    assert!(out.status.success(), "{}", texts(&out)[1]);
    assert_eq!(fs::read(&path).unwrap(), lamp().glb(), "the scene stays");
    let lit = fs::read(folder.path().join("a.baked.glb")).unwrap();
    assert!(String::from_utf8_lossy(&lit).contains("_IRRADIANCE"));
    let report = fs::read(folder.path().join("a.baked.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(report["camera"]["eye"], json!([0.5, 0.25, 4.0]));
    // The first camera by default, and the refined mesh where it is asked for.
    let stem = folder.path().join("b");
    let more = ["--cpu", "--error", "0.5", "--refine", "--scene", "hall", "--out"];
    let out = run("bake", &[&[scene][..], &more, &[stem.to_str().unwrap()]].concat());
    assert!(out.status.success(), "{}", texts(&out)[1]);
    let report = fs::read(folder.path().join("b.json")).unwrap();
    let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
    assert_eq!(report["camera"]["eye"], json!([0.5, 0.5, 3.0]));
    let refined = fs::read(folder.path().join("b.glb")).unwrap();
    assert!(String::from_utf8_lossy(&refined).contains("KHR_materials_unlit"));
    // Not over the scene, nor with a camera or scene that is not there.
    let over = folder.path().join("a");
    refused(&[scene, "--out", over.to_str().unwrap()], &["a.glb", "would replace it", "--out"]);
    refused(&[scene, "--camera", "top"], &["--camera top", "one of the file's: front, side"]);
    refused(&[scene, "--scene", "room"], &["no scene 'room'", "'hall'"]);
    assert_eq!(fs::read(&path).unwrap(), lamp().glb(), "the scene stays");
}

#[test]
fn other_commands_read_it_too() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    fs::write(&path, lamp().glb()).unwrap();
    let scene = path.to_str().unwrap();
    for command in ["view-factors", "light-map", "verify"] {
        let ply = folder.path().join("a.baked.ply");
        let mut args = vec![scene];
        if command == "verify" {
            let out = run("bake", &[scene, "--cpu", "--error", "0.5", "--write", "ply"]);
            assert!(out.status.success(), "{}", texts(&out)[1]);
            args.push(ply.to_str().unwrap());
        }
        let out = run(command, &args);
        assert!(out.status.success(), "{command}: {}", texts(&out)[1]);
    }
}
