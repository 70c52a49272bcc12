//! Files of light maps, read by other crates.

use std::sync::Arc;

use glam::{Quat, Vec2, Vec3};
use radiosity::backend::cpu::RayGather;
use radiosity::io::{
    ToneCurve, write_light_map_exr, write_light_map_glb, write_light_map_radiosity,
};
use radiosity::light_map::{Atlas, Coordinates, LightMap, Resolution};
use radiosity::scene::Sides;
use radiosity::{ErrorKind, GatheredMesh, Mesh, Rgb, SceneSettings};

use crate::common::keep_counting;

/// Two groups: a floor with texture coordinates, and a lamp, with or without. `at` is added to
/// x.
fn map(with_coordinates: bool, at: f64) -> LightMap {
    let lamp = if with_coordinates { "f 5/5 6/6 7/7 8/8" } else { "f 5 6 7 8" };
    let x = [at, at + 1.0];
    let text = format!(
        "v {0} 0 0\nv {1} 0 0\nv {1} 1 0\nv {0} 1 0\nv {0} 0 1\nv {0} 1 1\nv {1} 1 1\nv {1} 0 1\n\
         vt 0 0\nvt 0.5 0\nvt 0.5 0.5\nvt 0 0.5\nvt 0.6 0.6\nvt 0.6 1\nvt 1 1\nvt 1 0.6\n\
         g floor\nusemtl grey\nf 1/1 2/2 3/3 4/4\ng top\nusemtl lamp\n{lamp}\n",
        x[0], x[1]
    );
    let mut settings = SceneSettings::default();
    settings.texture_coordinates = true;
    settings.sides = Sides::Front;
    settings.emit.push(("lamp".into(), Rgb::new(1.0, 2.0, 3.0)));
    let scene = Arc::new(settings.read("a.obj", text.as_bytes(), &[]).unwrap());
    let atlas = Atlas::new(scene.clone(), Resolution::Pixels(32), Coordinates::Auto).unwrap();
    let mesh = Mesh::new(scene, f64::INFINITY).unwrap();
    let radiosity: Vec<Rgb> = (0..mesh.element_count()).map(|e| mesh.exitance(e)).collect();
    let light = GatheredMesh::from_elements(&mesh, &radiosity).unwrap();
    let mut rays = RayGather::new(&mesh, 16).unwrap();
    LightMap::gather(atlas, &light, &mut rays, keep_counting).unwrap().unwrap()
}

#[test]
fn exr_has_irradiance_and_coverage() {
    let (map, folder) = (map(true, 0.0), tempfile::tempdir().unwrap());
    let path = folder.path().join("a.exr");
    write_light_map_exr(&path, &map).unwrap();
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let channel = |name: &str| {
        let found = image.layer_data.channel_data.list.iter().find(|c| c.name.eq(name));
        found.unwrap().sample_data.values_as_f32().collect::<Vec<f32>>()
    };
    let of = |value: &dyn Fn(usize) -> f64| {
        (0..map.irradiance.len()).map(|k| value(k) as f32).collect::<Vec<_>>()
    };
    for (k, name) in ["R", "G", "B"].into_iter().enumerate() {
        assert_eq!(channel(name), of(&|texel| map.irradiance[texel][k]), "{name}");
    }
    let covered = |k: usize| f64::from(u8::from(map.gathered[k]));
    assert_eq!(channel("coverage"), of(&covered));
    let size = image.layer_data.size;
    assert_eq!((size.x(), size.y()), (32, 32));
    assert!(map.gathered.contains(&true) && map.gathered.contains(&false));
    // Scan lines, ZIP: some engines do not read tiles.
    let attributes = exr::meta::MetaData::read_from_file(&path, true).unwrap().headers.remove(0);
    assert_eq!(attributes.blocks, exr::meta::BlockDescription::ScanLines);
    assert_eq!(attributes.compression, exr::compression::Compression::ZIP16);
    let path = folder.path().join("b.exr");
    write_light_map_radiosity(&path, &map).unwrap();
    let image = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
    let blue = image.layer_data.channel_data.list.iter().find(|c| c.name.eq("B")).unwrap();
    let found: Vec<f32> = blue.sample_data.values_as_f32().collect();
    assert_eq!(found, map.radiosity().iter().map(|b| b.z as f32).collect::<Vec<_>>());
    let e = write_light_map_exr("no/such/folder/a.exr", &map).unwrap_err();
    assert!(e.kind() == ErrorKind::File && e.to_string().contains("no/such/folder"), "{e}");
}

#[test]
fn glb_has_places_in_the_map_and_in_the_textures_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.glb");
    for (with_coordinates, at) in [(true, 0.0), (false, 0.0), (true, 4e5)] {
        let map = map(with_coordinates, at);
        let (scene, tone) = (map.atlas.scene(), ToneCurve::fit(&map.radiosity()));
        write_light_map_glb(&path, &map, &tone).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        // Validates all that the specification says of the JSON.
        let gltf::Gltf { document, blob } = gltf::Gltf::from_slice(&bytes).unwrap();
        let binary = blob.unwrap();
        let top = document.default_scene().unwrap().nodes().next().unwrap();
        // Far from the origin positions are relative to the middle.
        let middle = scene.bounds().centre().as_vec3();
        let origin = if at > 0.0 { middle } else { Vec3::ZERO };
        let (moved, rotation, _) = top.transform().decomposed();
        let moved = Quat::from_array(rotation).inverse() * Vec3::from(moved);
        // Rotations of 24 bits, and back.
        assert!(moved.distance(origin) <= 1e-6 * origin.length());
        let mut t = 0;
        for node in top.children() {
            for primitive in node.mesh().unwrap().primitives() {
                let reader = primitive.reader(|_| Some(&binary));
                let positions: Vec<Vec3> =
                    reader.read_positions().unwrap().map(Vec3::from).collect();
                let normals: Vec<Vec3> = reader.read_normals().unwrap().map(Vec3::from).collect();
                let set = |k: u32| -> Vec<Vec2> {
                    let places = reader.read_tex_coords(k).unwrap().into_f32();
                    places.map(Vec2::from).collect()
                };
                let (given, places) = (set(0), set(1));
                let indices: Vec<u32> = reader.read_indices().unwrap().into_u32().collect();
                for face in indices.chunks_exact(3) {
                    let name = &scene.groups()[scene.triangles()[t].group as usize];
                    assert_eq!(node.name(), Some(name.as_str()));
                    let of_file = scene.texture_coordinates(t).unwrap();
                    for (k, &v) in face.iter().enumerate() {
                        let v = v as usize;
                        let wanted = (scene.corners(t)[k] - origin.as_dvec3()).as_vec3();
                        assert_eq!(positions[v], wanted);
                        assert_eq!(normals[v], scene.normal(t).as_vec3());
                        assert_eq!(places[v], map.atlas.coordinates(t)[k].as_vec2());
                        let of_file = Vec2::new(of_file[k].x as f32, (1.0 - of_file[k].y) as f32);
                        // glTF numbers sets from 0 on.
                        let first = if of_file.is_finite() { of_file } else { places[v] };
                        assert_eq!(given[v], first);
                    }
                    t += 1;
                }
                let colour = primitive.material().pbr_metallic_roughness();
                assert_eq!(colour.base_color_texture().unwrap().tex_coord(), 1);
                assert!(primitive.material().unlit());
            }
        }
        assert_eq!(t, scene.triangles().len());
        // The image is the radiosity through the tone curve.
        let gltf::image::Source::View { view, .. } = document.images().next().unwrap().source()
        else {
            panic!("an image of its own")
        };
        let png = &binary[view.offset()..view.offset() + view.length()];
        let image = ::image::load_from_memory(png).unwrap().into_rgb8();
        let wanted: Vec<u8> = map.radiosity().into_iter().flat_map(|c| tone.display(c)).collect();
        assert_eq!(image.dimensions(), (map.atlas.width(), map.atlas.height()));
        assert_eq!(image.into_raw(), wanted);
    }
}
