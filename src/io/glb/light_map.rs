//! A scene with its light map as glTF binary: the scene's own triangles, and one image for all.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use glam::{DVec2, Vec3};
use gltf_json::material::PbrMetallicRoughness;
use gltf_json::mesh::Semantic;
use gltf_json::texture::{Info, MinFilter};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Value};
use image::ExtendedColorType;
use rustc_hash::FxHashMap;

use super::file::{Attributes, GlbFile, unlit};
use super::images::png;
use super::origin;
use super::primitives::Shown;
use crate::error::Error;
use crate::io::cannot_write;
use crate::io::tone::ToneCurve;
use crate::light_map::LightMap;
use crate::mesh::SurfaceTopology;

/// Writes the scene of a light map as glTF 2.0 binary, `.glb`: its own triangles with `POSITION`,
/// `NORMAL` (of smooth surfaces), `TEXCOORD_1`, the coordinates in the light map, and `TEXCOORD_0`,
/// those of the scene's file on materials all of whose faces have some, else the same as
/// `TEXCOORD_1`.
///
/// A node for each group and a primitive for each of its materials, by their names; their `extras`
/// have reflectance and exitance. The file has the map's radiosity, without textures, as an image
/// (PNG) through `tone`, a curve of radiosity. Materials are unlit and have it as their colour, so
/// that viewers show the light unchanged. A program with its own textures takes the irradiance of
/// [`write_light_map_exr`](crate::io::write_light_map_exr) instead.
///
/// Lengths and axes are those of the scene's file, as with [`write_glb`](crate::write_glb).
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
pub fn write_light_map_glb(
    path: impl AsRef<Path>,
    map: &LightMap,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let path = path.as_ref();
    let bytes: Vec<u8> = map.radiosity().into_iter().flat_map(|c| tone.display(c)).collect();
    let size = [map.atlas.width(), map.atlas.height()];
    let png = png(&bytes, size, ExtendedColorType::Rgb8);
    let png = png.map_err(|e| cannot_write(path, io::Error::other(e)))?;
    let (scene, origin) = (map.atlas.scene(), origin(map.atlas.scene().bounds()));
    let mut file = GlbFile::new(&BTreeMap::from([
        ("axes", Value::from("those of the scene's file")),
        ("unit", Value::from("that of the scene's file")),
        ("TEXCOORD_1", Value::from("places in the light map")),
        ("light map", Value::from("radiosity times exposure, highlights rolled off")),
        ("exposure", Value::from(tone.exposure())),
    ]));
    // Without mipmaps, in which charts would run together.
    let index = file.add_texture(Index::new(0), MinFilter::Linear, true);
    let (mut materials, mut groups) = (BTreeMap::new(), vec![]);
    for of_group in primitives(map, origin).chunk_by(|a, b| a.group == b.group) {
        let mut parts = vec![];
        for primitive in of_group {
            let material = *materials.entry(primitive.material).or_insert_with(|| {
                let texture = Info { index, tex_coord: 1, extensions: None, extras: None };
                let colour = PbrMetallicRoughness {
                    base_color_texture: Some(texture),
                    ..Default::default()
                };
                let material = &scene.materials()[primitive.material as usize];
                file.add_material(unlit(material, colour))
            });
            let attributes = primitive.add_attributes(&mut file);
            parts.push(file.triangles(attributes, &primitive.faces, material));
        }
        groups.push(file.add_group(&scene.groups()[of_group[0].group as usize], parts));
    }
    file.add_image(png, Some("light map"));
    file.write(path, groups, origin)
}

/// The triangles of one group and one material.
#[derive(Default)]
struct Primitive {
    group: u32,
    material: u32,
    /// Of each vertex.
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    /// Texture coordinates in the map and in the scene's file, v downwards; the latter not finite
    /// where it has none.
    places: Vec<[f32; 2]>,
    given: Vec<[f32; 2]>,
    faces: Vec<[u32; 3]>,
}

/// The triangles of a map's scene by group, then material, positions relative to `origin`.
fn primitives(map: &LightMap, origin: Vec3) -> Vec<Primitive> {
    let scene = map.atlas.scene();
    let (topology, normals) = (SurfaceTopology::of_scene(scene), scene_normals(map));
    let mut primitives: BTreeMap<(u32, u32), Primitive> = BTreeMap::new();
    // Corners of one smooth surface are one vertex if their coordinates are equal.
    let mut numbers: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
    for (t, triangle) in scene.triangles().iter().enumerate() {
        let (group, material) = (triangle.group, triangle.material);
        let primitive = primitives.entry((group, material));
        let primitive = primitive.or_insert(Primitive { group, material, ..Default::default() });
        let (corners, places, given) =
            (scene.corners(t), map.atlas.coordinates(t), given_places(map, t));
        let face = [0, 1, 2].map(|k| {
            let (place, given) = (places[k].as_vec2(), given[k].as_vec2());
            let bits = [place.x, place.y, given.x, given.y].map(f32::to_bits);
            // A smooth surface has one group and one material.
            *numbers.entry((topology.corners[t][k], bits)).or_insert_with(|| {
                let position = (corners[k] - origin.as_dvec3()).as_vec3();
                primitive.positions.push(position.to_array());
                primitive.normals.push(normals[t][k].to_array());
                primitive.places.push(place.to_array());
                primitive.given.push(given.to_array());
                primitive.positions.len() as u32 - 1
            })
        });
        primitive.faces.push(face);
    }
    primitives.into_values().collect()
}

impl Primitive {
    fn add_attributes(&self, file: &mut GlbFile) -> Attributes {
        let positions = file.add_positions(&self.positions);
        let normals = file.add_vectors("NORMAL", &self.normals);
        let places = file.add_vectors("TEXCOORD_1", &self.places);
        // glTF numbers sets of coordinates from 0 on: without the file's, the map's are used for
        // both.
        let given = match self.given.as_flattened().iter().all(|x| x.is_finite()) {
            true => file.add_vectors("TEXCOORD_0", &self.given),
            false => places,
        };
        Attributes::from([
            (Valid(Semantic::Positions), positions),
            (Valid(Semantic::Normals), normals),
            (Valid(Semantic::TexCoords(0)), given),
            (Valid(Semantic::TexCoords(1)), places),
        ])
    }
}

/// Unit normals at the corners of each triangle, as glTF requires.
fn scene_normals(map: &LightMap) -> Vec<[Vec3; 3]> {
    let unit = |corners: [glam::DVec3; 3]| corners.map(|n| n.as_vec3().normalize_or(Vec3::Y));
    map.atlas.corner_normals().into_iter().map(unit).collect()
}

/// Texture coordinates of the corners of triangle `t` in its file, v downwards; not finite if it
/// has none.
fn given_places(map: &LightMap, t: usize) -> [DVec2; 3] {
    let scene = map.atlas.scene();
    let frame = scene.textures(t).and_then(Shown::of).and_then(|shown| shown.frame());
    scene.texture_coordinates(t).unwrap_or([DVec2::NAN; 3]).map(|place| {
        let place = frame.map_or(place, |map| place * map.scale + map.offset);
        DVec2::new(place.x, 1.0 - place.y)
    })
}
