//! The same file with places in a light map.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use radiosity::backend::cpu::RayGather;
use radiosity::glam::DVec3;
use radiosity::io::{MapBinding, ToneCurve, write_mapped_gltf};
use radiosity::light_map::{Atlas, Coordinates, LayoutSettings, LightMap, Maps, Resolution};
use radiosity::{GatheredMesh, Mesh, Rgb, load_scene};
use serde_json::{Value, json};

use super::lit::parts;
use crate::common::gltf::Gltf;
use crate::common::keep_counting;

/// Two tiles of one mesh, a strip with colours of bytes and a morph target, side by side and below
/// a sky.
fn tiles() -> Gltf {
    let mut gltf = Gltf::new(json!([
        { "mesh": 0, "name": "left", "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()] },
        { "mesh": 0, "name": "right", "translation": [3, 0, 0],
          "rotation": [-0.5f64.sqrt(), 0, 0, 0.5f64.sqrt()] },
    ]));
    let corners: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [1., 1., 0.]];
    let positions = gltf.add_floats(&corners);
    let places = gltf.add_floats(&corners.map(|[x, y, _]| [x, 1.0 - y]));
    let shifts = gltf.add_floats(&[[0.0f32, 0.0, 1.0]; 4]);
    let colours: Vec<u8> = (0..16).map(|k| 17 * k).collect();
    let colours = gltf.add(&colours, 5121, "VEC4", 4);
    gltf.json["accessors"][colours]["normalized"] = json!(true);
    gltf.add_mesh(json!({
        "attributes": { "POSITION": positions, "TEXCOORD_0": places, "COLOR_0": colours },
        "targets": [{ "POSITION": shifts }], "mode": 5, "material": 0, "extras": { "a": 1 },
    }));
    let grey = json!({ "baseColorFactor": [0.5, 0.5, 0.5, 0.75], "metallicFactor": 0 });
    gltf.json["materials"] =
        json!([{ "name": "grey", "doubleSided": true, "pbrMetallicRoughness": grey }]);
    gltf.json["extras"] = json!({ "kept": [1, 2.50] });
    gltf
}

/// The map of a scene that reflects as much everywhere, each tile a page.
fn map_of(path: &Path) -> LightMap {
    let mut settings = LayoutSettings::new(Resolution::Pixels(24));
    (settings.maps, settings.coordinates) = (Maps::EachGroup, Coordinates::Unwrapped);
    let atlas = Atlas::with_settings(load_scene(path).unwrap(), &settings).unwrap();
    let mesh = Mesh::new(atlas.scene().clone(), f64::INFINITY).unwrap();
    let light = GatheredMesh::from_elements(&mesh, &vec![Rgb::ONE; mesh.element_count()]).unwrap();
    let mut rays = RayGather::new(&mesh, 64).unwrap();
    LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap()
}

/// The document, the buffer and the map of a file that names it so.
fn written(source: &Gltf, binding: MapBinding) -> (Value, Vec<u8>, LightMap) {
    let folder = tempfile::tempdir().unwrap();
    let [from, to] = ["it.glb", "mapped.glb"].map(|name| folder.path().join(name));
    fs::write(&from, source.glb()).unwrap();
    let map = map_of(&from);
    let files = ["a.exr", "b.exr"].map(String::from);
    let tone = ToneCurve::with_exposure(1.0);
    write_mapped_gltf(&to, &from, &map, None, (binding, &files), &tone).unwrap();
    // What was written is the same scene.
    let corners = |path: &Path| {
        let scene = load_scene(path).unwrap();
        (0..scene.triangles().len()).map(|t| scene.corners(t)).collect::<Vec<_>>()
    };
    assert_eq!(corners(&to), corners(&from));
    let (json, binary) = parts(&fs::read(&to).unwrap());
    (json, binary, map)
}

/// The bytes of the items of an accessor.
fn items(json: &Value, binary: &[u8], accessor: &Value) -> Vec<Vec<u8>> {
    let accessor = &json["accessors"][accessor.as_u64().unwrap() as usize];
    let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
    let number = |of: &Value, name: &str| of[name].as_u64().map(|x| x as usize);
    let components = match accessor["type"].as_str().unwrap() {
        "SCALAR" => 1,
        name => name[3..].parse().unwrap(),
    };
    let size = components * if accessor["componentType"] == 5121 { 1 } else { 4 };
    let (start, stride) = (number(view, "byteOffset").unwrap(), number(view, "byteStride"));
    let item = |k: usize| {
        let at = start + k * stride.unwrap_or(size);
        binary[at..at + size].to_vec()
    };
    (0..number(accessor, "count").unwrap()).map(item).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
}

#[test]
fn vertices_have_their_places_and_keep_their_attributes() {
    let source = tiles();
    let (json, binary, map) = written(&source, MapBinding::Extras);
    let old = parts(&source.glb());
    let old_attributes = &old.0["meshes"][0]["primitives"][0]["attributes"];
    let of_old = |name: &str| items(&old.0, &old.1, &old_attributes[name]);
    let scene = map.atlas.scene();
    let mut pages = BTreeSet::new();
    for node in 0..2 {
        let mesh = json["nodes"][node]["mesh"].as_u64().unwrap() as usize;
        assert_eq!(mesh, node);
        let primitive = &json["meshes"][mesh]["primitives"][0];
        let of_new = |accessor: &Value| items(&json, &binary, accessor);
        let indices = of_new(&primitive["indices"]);
        assert_eq!((indices.len(), primitive.get("mode")), (6, None));
        let [positions, places, first, colours] =
            ["POSITION", "TEXCOORD_1", "TEXCOORD_0", "COLOR_0"]
                .map(|name| of_new(&primitive["attributes"][name]));
        let shifts = of_new(&primitive["targets"][0]["POSITION"]);
        assert!(shifts.iter().all(|shift| floats(shift) == [0.0, 0.0, 1.0]));
        // Bytes stay bytes, each with its vertex.
        for v in 0..positions.len() {
            let k = of_old("POSITION").iter().position(|p| *p == positions[v]).unwrap();
            assert_eq!((&first[v], &colours[v]), (&of_old("TEXCOORD_0")[k], &of_old("COLOR_0")[k]));
        }
        for (k, corners) in indices.chunks_exact(3).enumerate() {
            let t = 2 * node + k;
            let (page, wanted) = map.atlas.page_coordinates(t);
            pages.insert(page);
            let file = ["a.exr", "b.exr"][page];
            let extras = json!({ "a": 1, "radiosity": { "lightMap": file, "texCoord": 1 } });
            assert_eq!(primitive["extras"], extras);
            for index in corners {
                let v = u32::from_le_bytes(index.as_slice().try_into().unwrap()) as usize;
                // (x, y) of the mesh is (x, −z) of the world, to rounding.
                let p = floats(&positions[v]);
                let world = DVec3::new(f64::from(p[0]) + 3.0 * node as f64, 0.0, -f64::from(p[1]));
                let at = scene.corners(t).iter().position(|c| c.distance(world) < 1e-9).unwrap();
                assert_eq!(floats(&places[v]), wanted[at].as_vec2().to_array(), "{t} {v}");
            }
        }
    }
    assert_eq!(pages.len(), 2);
    // All else is as it was.
    for part in ["materials", "scenes", "scene", "asset", "extras"] {
        assert_eq!(json[part], old.0[part], "{part}");
    }
    assert_eq!(binary[..old.1.len()], old.1);
}

#[test]
fn materials_show_the_map_if_asked_to() {
    for binding in [MapBinding::Emissive, MapBinding::Occlusion] {
        let (json, binary, map) = written(&tiles(), binding);
        // One for each page, behind the one of the source.
        assert_eq!(json["materials"].as_array().unwrap().len(), 3);
        for (node, material) in [(0, 1), (1, 2)] {
            let mesh = json["nodes"][node]["mesh"].as_u64().unwrap() as usize;
            assert_eq!(json["meshes"][mesh]["primitives"][0]["material"], material);
            let bound = &json["materials"][material];
            assert_eq!((&bound["name"], &bound["doubleSided"]), (&json!("grey"), &json!(true)));
            let colour = &bound["pbrMetallicRoughness"]["baseColorFactor"];
            let texture = match binding {
                MapBinding::Emissive => {
                    assert_eq!(
                        (colour, &bound["emissiveFactor"]),
                        (&json!([0, 0, 0, 0.75]), &json!([1, 1, 1]))
                    );
                    &bound["emissiveTexture"]
                }
                _ => {
                    assert_eq!(*colour, json!([0.5, 0.5, 0.5, 0.75]));
                    &bound["occlusionTexture"]
                }
            };
            assert_eq!(texture["texCoord"], 1);
            let texture = &json["textures"][texture["index"].as_u64().unwrap() as usize];
            let image = &json["images"][texture["source"].as_u64().unwrap() as usize];
            let view = &json["bufferViews"][image["bufferView"].as_u64().unwrap() as usize];
            let [at, length] =
                ["byteOffset", "byteLength"].map(|name| view[name].as_u64().unwrap() as usize);
            let image = image::load_from_memory(&binary[at..at + length]).unwrap();
            let page = map.atlas.page_coordinates(2 * node).0;
            assert_eq!([image.width(), image.height()], map.atlas.pages()[page].size);
        }
    }
}
