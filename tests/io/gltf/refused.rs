use radiosity::ErrorKind;
use radiosity::io::read_scene;
use serde_json::json;

use super::read;
use crate::common::gltf::Gltf;

fn square() -> Gltf {
    Gltf::of_material(json!({ "pbrMetallicRoughness": {} }))
}

/// The message for a changed file.
fn refusal(change: impl FnOnce(&mut Gltf)) -> String {
    let mut gltf = square();
    change(&mut gltf);
    let e = read(&gltf).unwrap_err();
    assert_eq!(e.kind(), ErrorKind::Scene);
    assert!(e.place().starts_with("it.glb"), "{e}");
    e.to_string()
}

#[test]
fn versions_and_files_that_break_off() {
    assert!(refusal(|g| g.json["asset"]["version"] = json!("1.0")).contains("glTF of version 1.0"));
    assert!(refusal(|g| g.json["asset"] = json!({})).contains("no version of glTF"));
    let whole = square().glb();
    for end in [5, 11, 12, 19, 60, whole.len() - 40, whole.len() - 1] {
        let e = read_scene("it.glb", &whole[..end], &[]).unwrap_err().to_string();
        assert!(e.contains("give the whole file") || e.contains("no JSON chunk"), "{end}: {e}");
    }
    let mut first = whole.clone();
    first[4] = 1;
    assert!(read_scene("it.glb", &first, &[]).unwrap_err().to_string().contains("version 1"));
    let e = read_scene("it.gltf", b"  { \"asset\": ", &[]).unwrap_err().to_string();
    assert!(e.contains("its JSON is not that of a scene: EOF"), "{e}");
}

#[test]
fn indices_beyond_the_end() {
    let primitive = |g: &mut Gltf, key: &str, index: u32| {
        g.json["meshes"][0]["primitives"][0][key] = json!(index);
    };
    assert!(refusal(|g| primitive(g, "indices", 7)).contains("accessor 7, of 3; must be below 3"));
    assert!(refusal(|g| primitive(g, "material", 7)).contains("material 7, of 1"));
    assert!(refusal(|g| primitive(g, "mode", 9)).contains("mode 9"));
    assert!(refusal(|g| g.json["nodes"][0]["mesh"] = json!(4)).contains("mesh 4, of 1"));
    assert!(refusal(|g| g.json["scenes"][0]["nodes"] = json!([3])).contains("node 3, of 1"));
    assert!(refusal(|g| g.json["nodes"][0]["children"] = json!([3])).contains("node 3, of 1"));
    assert!(refusal(|g| g.json["bufferViews"][0]["buffer"] = json!(3)).contains("buffer 3, of 1"));
    let vertex = refusal(|g| {
        let indices = g.add_indices(&[0, 1, 4]);
        g.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    });
    let wanted = "it.glb: node 'node 0': primitive 0 of mesh 0: vertex 4, of 4; must be below 4";
    assert_eq!(vertex, wanted);
}

#[test]
fn more_than_there_is() {
    let count = |g: &mut Gltf, n: u64| g.json["accessors"][0]["count"] = json!(n);
    let wanted = "accessor 0 announces 1000000000 items of 12 bytes";
    assert!(refusal(|g| count(g, 1_000_000_000)).contains(wanted));
    assert!(refusal(|g| count(g, u64::MAX)).contains("accessor 0 announces"));
    let without = refusal(|g| {
        count(g, 1_000_000_000);
        g.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    assert!(without.contains("1000000000 items without data"), "{without}");
    let view = |g: &mut Gltf, key: &str, n: u64| g.json["bufferViews"][0][key] = json!(n);
    assert!(refusal(|g| view(g, "byteLength", 1 << 40)).contains("buffer view 0 has"));
    assert!(refusal(|g| view(g, "byteOffset", u64::MAX)).contains("buffer view 0 has"));
    assert!(refusal(|g| view(g, "byteStride", u64::MAX)).contains("accessor 0 announces"));
    // A thousand nodes below each of a thousand: each is placed once.
    let mut gltf = square();
    let all: Vec<u32> = (1..=1000).collect();
    gltf.json["nodes"] = (0..=1000).map(|_| json!({ "children": all, "mesh": 0 })).collect();
    assert_eq!(read(&gltf).unwrap().groups().len(), 1001);
}

#[test]
fn nodes_below_themselves_and_numbers_that_are_none() {
    let cycle = refusal(|g| {
        g.json["nodes"] = json!([{ "children": [1], "name": "a" }, { "children": [0], "mesh": 0 }]);
    });
    assert!(cycle.contains("node 'a' is below itself; nodes must form trees"), "{cycle}");
    let own = refusal(|g| g.json["nodes"] = json!([{ "children": [0], "mesh": 0 }]));
    assert!(own.contains("below itself"), "{own}");
    let not_finite = refusal(|g| {
        let positions = g.add_floats(&[[0.0, 0.0, f32::NAN]; 4]);
        g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(positions);
    });
    assert!(not_finite.contains("vertex 0 at [0, 0, NaN]"), "{not_finite}");
    let far = refusal(|g| g.json["nodes"][0]["scale"] = json!([1e308, 1e308, 1e308]));
    assert!(far.contains("scale the scene down"), "{far}");
}

#[test]
fn compressed_meshes_name_their_extension() {
    let draco = refusal(|g| {
        let extensions =
            json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
        g.json["meshes"][0]["primitives"][0]["extensions"] = extensions;
        g.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    assert!(
        draco.contains("node 'node 0'") && draco.contains("KHR_draco_mesh_compression"),
        "{draco}"
    );
    let meshopt = refusal(|g| {
        g.json["bufferViews"][0]["extensions"] =
            json!({ "EXT_meshopt_compression": { "buffer": 0, "count": 4, "mode": "ATTRIBUTES" } });
        g.json["bufferViews"][0]["buffer"] = json!(1);
        g.json["buffers"] = json!([{ "byteLength": g.binary.len() }, { "byteLength": 48 }]);
    });
    assert!(meshopt.contains("EXT_meshopt_compression, which is not read"), "{meshopt}");
}

/// What light does not need may be wrong.
#[test]
fn mistakes_elsewhere_do_no_harm() {
    let mut gltf = square();
    gltf.json["animations"] = json!([{ "channels": [{ "sampler": 0, "target": {} }] }]);
    gltf.json["textures"] = json!([{ "sampler": "none" }, {}]);
    gltf.json["cameras"] = json!([3]);
    gltf.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorFactor": "red" } }]);
    gltf.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "colour": 1 }] } });
    assert_eq!(read(&gltf).unwrap().triangles().len(), 2);
}
