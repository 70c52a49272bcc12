use radiosity::glam::{DQuat, DVec3};
use radiosity::scene::WarningKind;
use serde_json::json;

use super::{has_warning, read, read_with};
use crate::common::gltf::{Gltf, HALVES, SQUARE};

/// Squares of one material, one mesh, at these nodes.
fn squares(nodes: serde_json::Value) -> Gltf {
    let mut gltf = Gltf::new(nodes);
    gltf.add_square(0);
    let pbr = json!({ "baseColorFactor": [0.5, 0.5, 0.5, 1] });
    gltf.json["materials"] = json!([{ "name": "grey", "pbrMetallicRoughness": pbr }]);
    gltf
}

#[test]
fn mirrored_and_sheared_nodes_keep_fronts() {
    let turn = DQuat::from_rotation_z(0.7).to_array();
    let scene = read(&squares(json!([
        { "mesh": 0 },
        { "mesh": 0, "scale": [-2, 1, 1] },
        { "mesh": 0, "scale": [1, 1, -1] },
        // A turn below an uneven scale is a shear.
        { "scale": [1, 3, 1], "children": [4] },
        { "mesh": 0, "rotation": turn },
        { "mesh": 0, "matrix": [0, 0, 5, 0, 0, 1, 0, 0, -1, 0, 0, 0, 7, 8, 9, 1] },
    ])));
    let scene = scene.unwrap();
    let normals = [0, 2, 4, 6, 8].map(|t| scene.normal(t));
    // Where z is turned over, what faced +z faces -z, though all corners stay where they are.
    let wanted = [DVec3::Z, DVec3::Z, DVec3::NEG_Z, DVec3::Z, DVec3::NEG_X];
    for (found, wanted) in normals.into_iter().zip(wanted) {
        assert!(found.abs_diff_eq(wanted, 1e-12), "{found} {wanted}");
    }
    let areas = [0, 2, 4, 6, 8].map(|t| scene.area(t));
    for (area, wanted) in areas.into_iter().zip([0.5, 1.0, 0.5, 1.5, 2.5]) {
        assert!((area - wanted).abs() < 1e-12, "{area} {wanted}");
    }
    assert_eq!(scene.corners(8)[0], DVec3::new(7.0, 8.0, 9.0));
    assert_eq!(scene.groups(), ["node 0", "node 1", "node 2", "node 4", "node 5"]);
    assert_eq!(scene.up(), DVec3::Y);
}

#[test]
fn strips_fans_and_unindexed_triangles() {
    let mut gltf = Gltf::new(json!([{ "mesh": 0 }, { "mesh": 1 }, { "mesh": 2 }, { "mesh": 3 }]));
    let square = gltf.add_floats(&SQUARE);
    let strip = gltf.add_floats(&[SQUARE[0], SQUARE[1], SQUARE[3], SQUARE[2]]);
    let list = gltf.add_floats(&HALVES.map(|k| SQUARE[k as usize]));
    let bytes = gltf.add(&[0, 1, 2, 0, 2, 3], 5121, "SCALAR", 6);
    gltf.add_mesh(json!({ "attributes": { "POSITION": strip }, "mode": 5 }));
    gltf.add_mesh(json!({ "attributes": { "POSITION": square }, "mode": 6 }));
    gltf.add_mesh(json!({ "attributes": { "POSITION": list } }));
    gltf.add_mesh(json!({ "attributes": { "POSITION": square }, "indices": bytes, "mode": 4 }));
    let scene = read(&gltf).unwrap();
    assert_eq!(scene.triangles().len(), 8);
    for t in 0..8 {
        assert_eq!((scene.normal(t), scene.area(t)), (DVec3::Z, 0.5), "{t}");
    }
    assert!(has_warning(&scene, WarningKind::MaterialWithoutColour));
}

#[test]
fn quantised_interleaved_and_sparse_positions() {
    let mut gltf = Gltf::new(json!([
        { "mesh": 0, "scale": [0.001, 0.001, 0.001] }, { "mesh": 1 }, { "mesh": 2 }
    ]));
    let indices = gltf.add_indices(&HALVES);
    let bytes = |scale: f32, stride: usize| -> Vec<u8> {
        let item = |p: [f32; 3]| {
            let mut bytes: Vec<u8> =
                p.iter().flat_map(|x| ((x * scale) as i16).to_le_bytes()).collect();
            bytes.resize(stride, 0xee);
            bytes
        };
        SQUARE.into_iter().flat_map(item).collect()
    };
    // Whole numbers, with a stride; normalised ones; floats of which two of zeros are replaced.
    let whole = gltf.add(&bytes(1000.0, 12), 5122, "VEC3", 4);
    gltf.json["bufferViews"][1]["byteStride"] = json!(12);
    let normalized = gltf.add(&bytes(32767.0, 8), 5122, "VEC3", 4);
    gltf.json["bufferViews"][2]["byteStride"] = json!(8);
    gltf.json["accessors"][normalized]["normalized"] = json!(true);
    let replaced = gltf.add_view(&[3, 1, 2]);
    let values: Vec<u8> = [SQUARE[3], SQUARE[1], SQUARE[2]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let values = gltf.add_view(&values);
    gltf.json["accessors"].as_array_mut().unwrap().push(json!({
        "componentType": 5126, "type": "VEC3", "count": 4, "sparse": {
            "count": 3,
            "indices": { "bufferView": replaced, "componentType": 5121 },
            "values": { "bufferView": values },
        },
    }));
    for accessor in [whole, normalized, normalized + 1] {
        gltf.add_mesh(json!({ "attributes": { "POSITION": accessor }, "indices": indices }));
    }
    let scene = read(&gltf).unwrap();
    assert_eq!(scene.triangles().len(), 6);
    for t in 0..6 {
        let wanted = HALVES.map(|k| DVec3::from_array(SQUARE[k as usize].map(f64::from)));
        for (found, wanted) in scene.corners(t).iter().zip(&wanted[3 * (t % 2)..]) {
            assert!(found.abs_diff_eq(*wanted, 1e-15), "{t}: {found} {wanted}");
        }
    }
}

#[test]
fn instances_are_groups() {
    let mut gltf = squares(json!([{ "mesh": 0, "name": "tile", "scale": [2, 2, 2] }]));
    let places = gltf.add_floats(&[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 1.0]]);
    let attributes = json!({ "TRANSLATION": places });
    gltf.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": attributes } });
    let scene = read(&gltf).unwrap();
    assert_eq!(scene.groups(), ["tile/1", "tile/2", "tile/3"]);
    assert_eq!(scene.corners(4)[0], DVec3::new(0.0, 10.0, 2.0));
    let facets = read_with(&gltf, |settings| settings.facets = true).unwrap();
    assert_eq!(facets.groups()[4..], ["tile/3/1", "tile/3/2"]);
}

#[test]
fn morph_targets_and_joints_pose_meshes() {
    let mut gltf = squares(json!([{ "mesh": 0, "weights": [0.5, 0.0] }]));
    let up = gltf.add_floats(&[[0.0, 0.0, 4.0]; 4]);
    let target = json!({ "POSITION": up });
    gltf.json["meshes"][0]["primitives"][0]["targets"] = json!([target.clone(), target]);
    assert_eq!(read(&gltf).unwrap().corners(0)[0], DVec3::new(0.0, 0.0, 2.0));

    // The mesh's own node does not count; half of the joint at x = 6 and half of that at y = 2.
    let mut gltf = squares(json!([
        { "mesh": 0, "skin": 0, "translation": [100, 0, 0] },
        { "translation": [6, 0, 0] }, { "translation": [0, 2, 0] },
    ]));
    let joints = gltf.add(&[[0u8, 1, 0, 0]; 4].concat(), 5121, "VEC4", 4);
    let weights = gltf.add_floats(&[[0.5f32, 0.5, 0.0, 0.0]; 4]);
    let attributes = &mut gltf.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["JOINTS_0"] = json!(joints);
    attributes["WEIGHTS_0"] = json!(weights);
    gltf.json["skins"] = json!([{ "joints": [1, 2] }]);
    let scene = read(&gltf).unwrap();
    assert_eq!(scene.corners(0)[0], DVec3::new(3.0, 1.0, 0.0));
    assert!(has_warning(&scene, WarningKind::Skin));
}

#[test]
fn one_scene_is_read() {
    let mut gltf = squares(json!([{ "mesh": 0, "name": "a" }, { "mesh": 0, "name": "b" }]));
    gltf.json["scenes"] =
        json!([{ "name": "first", "nodes": [0] }, { "name": "second", "nodes": [1] }]);
    assert_eq!(read(&gltf).unwrap().groups(), ["a"]);
    gltf.json["scene"] = json!(1);
    assert_eq!(read(&gltf).unwrap().groups(), ["b"]);
    for name in ["first", "0"] {
        let scene = read_with(&gltf, |settings| settings.scene = Some(name.into()));
        assert_eq!(scene.unwrap().groups(), ["a"]);
    }
    let e = read_with(&gltf, |settings| settings.scene = Some("third".into())).unwrap_err();
    assert!(e.to_string().contains("no scene 'third'; its scenes are 'first', 'second'"), "{e}");
}

/// Names that come again, and a node that two others have as a child.
#[test]
fn groups_have_names_of_their_own() {
    let mut gltf = squares(json!([
        { "mesh": 0, "name": "leg" },
        { "mesh": 0, "name": "leg", "translation": [3, 0, 0], "children": [2] },
        { "mesh": 0, "name": "foot", "translation": [0, 0, 1] },
        { "children": [2], "translation": [0, 0, 50] },
    ]));
    gltf.json["scenes"] = json!([{ "nodes": [0, 1, 3] }]);
    let scene = read(&gltf).unwrap();
    assert_eq!(scene.groups(), ["leg", "leg (2)", "foot"]);
    assert_eq!(scene.corners(4)[0], DVec3::new(3.0, 0.0, 1.0));
    assert!(has_warning(&scene, WarningKind::SharedNode));
    assert!(read_with(&gltf, |settings| settings.strict = true).is_err());
}
