//! A scene with its light map as glTF binary: the scene's own triangles, and one image for all.
//!
//! ```text
//! binary chunk │ vertices, one after the other               │ indices │ PNG
//!              │ position normal  uv in map  uv in file      │         │
//! ```

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use glam::{DVec2, Vec2, Vec3};
use gltf_json::accessor::Type;
use gltf_json::buffer::Target;
use gltf_json::material::PbrMetallicRoughness;
use gltf_json::mesh::Semantic;
use gltf_json::scene::Node;
use gltf_json::texture::{Info, MagFilter, MinFilter, Sampler, Texture, WrappingMode};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Material, Root, Value};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use rustc_hash::FxHashMap;

use super::parts::{self, Attributes, accessor};
use super::primitives::Shown;
use super::{INDEX_BYTES, PLACE_BYTES, VECTOR_BYTES, container, origin};
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
    let png = png(map, tone).map_err(|e| cannot_write(path, io::Error::other(e)))?;
    let model = Model::new(map, png);
    container::write(path, &model.document(tone), model.binary_length(), |out| {
        model.write_binary(out)
    })
}

/// The radiosity of a map through `tone`, as PNG.
fn png(map: &LightMap, tone: &ToneCurve) -> image::ImageResult<Vec<u8>> {
    let bytes: Vec<u8> = map.radiosity().into_iter().flat_map(|c| tone.display(c)).collect();
    let (mut png, [width, height]) = (vec![], [map.atlas.width(), map.atlas.height()]);
    PngEncoder::new_with_quality(&mut png, CompressionType::Default, FilterType::Adaptive)
        .write_image(&bytes, width, height, ExtendedColorType::Rgb8)?;
    Ok(png)
}

/// The file's content.
struct Model<'a> {
    map: &'a LightMap,
    primitives: Vec<Primitive>,
    /// The point that positions are relative to, scene unit.
    origin: Vec3,
    png: Vec<u8>,
}

/// The triangles of one group and one material.
#[derive(Default)]
struct Primitive {
    group: u32,
    material: u32,
    vertices: Vec<Vertex>,
    faces: Vec<[u32; 3]>,
}

/// As written, except for the file's texture coordinates if not all vertices of a primitive have
/// them.
struct Vertex {
    position: Vec3,
    normal: Vec3,
    place: Vec2,
    given: Vec2,
}

/// Bytes of a vertex.
const VERTEX_BYTES: u64 = 2 * VECTOR_BYTES + 2 * PLACE_BYTES;

impl Model<'_> {
    fn new(map: &LightMap, png: Vec<u8>) -> Model<'_> {
        let scene = map.atlas.scene();
        let (topology, normals) = (SurfaceTopology::of_scene(scene), scene_normals(map));
        let origin = origin(scene.bounds());
        let mut primitives: BTreeMap<(u32, u32), Primitive> = BTreeMap::new();
        // Corners of one smooth surface are one vertex if their coordinates are equal.
        let mut numbers: FxHashMap<(u32, [u32; 4]), u32> = FxHashMap::default();
        for (t, triangle) in scene.triangles().iter().enumerate() {
            let primitive =
                primitives.entry((triangle.group, triangle.material)).or_insert_with(|| {
                    Primitive {
                        group: triangle.group,
                        material: triangle.material,
                        ..Primitive::default()
                    }
                });
            let corners = scene.corners(t);
            let (places, given) = (map.atlas.coordinates(t), given_places(map, t));
            let face = [0, 1, 2].map(|k| {
                let (place, given) = (places[k].as_vec2(), given[k].as_vec2());
                let bits = [place.x, place.y, given.x, given.y].map(f32::to_bits);
                // A smooth surface has one group and one material.
                *numbers.entry((topology.corners[t][k], bits)).or_insert_with(|| {
                    let position = (corners[k] - origin.as_dvec3()).as_vec3();
                    let normal = normals[t][k];
                    primitive.vertices.push(Vertex { position, normal, place, given });
                    primitive.vertices.len() as u32 - 1
                })
            });
            primitive.faces.push(face);
        }
        Model { map, primitives: primitives.into_values().collect(), origin, png }
    }

    fn vertex_bytes(&self) -> u64 {
        self.primitives.iter().map(|p| p.vertices.len() as u64).sum::<u64>() * VERTEX_BYTES
    }

    fn index_bytes(&self) -> u64 {
        3 * self.primitives.iter().map(|p| p.faces.len() as u64).sum::<u64>() * INDEX_BYTES
    }

    fn binary_length(&self) -> u64 {
        (self.vertex_bytes() + self.index_bytes() + self.png.len() as u64).next_multiple_of(4)
    }

    fn write_binary(&self, out: &mut impl Write) -> io::Result<()> {
        for primitive in &self.primitives {
            let has_given = primitive.has_given_places();
            for vertex in &primitive.vertices {
                let Vertex { position, normal, place, given } = vertex;
                // Unused numbers must not be NaN, which glTF forbids.
                let given = if has_given { *given } else { Vec2::ZERO };
                let vectors = [position.to_array(), normal.to_array()];
                let places = [place.to_array(), given.to_array()];
                for x in vectors.as_flattened().iter().chain(places.as_flattened()) {
                    out.write_all(&x.to_le_bytes())?;
                }
            }
        }
        for &v in self.primitives.iter().flat_map(|primitive| primitive.faces.as_flattened()) {
            out.write_all(&v.to_le_bytes())?;
        }
        out.write_all(&self.png)?;
        let written = self.vertex_bytes() + self.index_bytes() + self.png.len() as u64;
        out.write_all(&[0; 4][..(self.binary_length() - written) as usize])
    }

    fn document(&self, tone: &ToneCurve) -> Root {
        let notes = BTreeMap::from([
            ("axes", Value::from("those of the scene's file")),
            ("unit", Value::from("that of the scene's file")),
            ("TEXCOORD_1", Value::from("places in the light map")),
            ("light map", Value::from("radiosity times exposure, highlights rolled off")),
            ("exposure", Value::from(tone.exposure())),
        ]);
        let mut root = parts::document(self.binary_length(), &notes);
        self.add_views(&mut root);
        let texture = add_texture(&mut root);
        let groups = self.add_groups(&mut root, texture);
        parts::add_scene(&mut root, groups, self.origin);
        root
    }

    fn add_views(&self, root: &mut Root) {
        let (offset, target) = (&mut 0, Target::ArrayBuffer);
        parts::add_view(root, offset, self.vertex_bytes(), Some(VERTEX_BYTES), Some(target));
        let target = Target::ElementArrayBuffer;
        parts::add_view(root, offset, self.index_bytes(), None, Some(target));
        parts::add_view(root, offset, self.png.len() as u64, None, None);
    }

    /// A node and a mesh for each group with triangles.
    fn add_groups(&self, root: &mut Root, texture: Index<Texture>) -> Vec<Index<Node>> {
        let mut materials = BTreeMap::new();
        let (mut vertices, mut faces, mut nodes) = (0, 0, vec![]);
        for of_group in self.primitives.chunk_by(|a, b| a.group == b.group) {
            let mut primitives = vec![];
            for primitive in of_group {
                let material = *materials.entry(primitive.material).or_insert_with(|| {
                    let material = self.material(primitive.material, texture);
                    root.push(material)
                });
                let attributes = primitive.attributes(root, vertices * VERTEX_BYTES);
                let indices = (1, faces, primitive.faces.len());
                primitives.push(parts::triangles(root, attributes, indices, material));
                vertices += primitive.vertices.len() as u64;
                faces += primitive.faces.len() as u64;
            }
            let name = &self.map.atlas.scene().groups()[of_group[0].group as usize];
            nodes.push(parts::add_group(root, name, primitives));
        }
        nodes
    }

    fn material(&self, number: u32, index: Index<Texture>) -> Material {
        let material = &self.map.atlas.scene().materials()[number as usize];
        let texture = Info { index, tex_coord: 1, extensions: None, extras: None };
        let colour =
            PbrMetallicRoughness { base_color_texture: Some(texture), ..Default::default() };
        parts::unlit(material, colour)
    }
}

/// Adds the map as a texture, smoothly filtered and not repeated.
fn add_texture(root: &mut Root) -> Index<Texture> {
    let source = parts::add_image(root, 2, Some("light map"));
    let sampler = Sampler {
        mag_filter: Some(Valid(MagFilter::Linear)),
        // Without mipmaps, in which charts would run together.
        min_filter: Some(Valid(MinFilter::Linear)),
        wrap_s: Valid(WrappingMode::ClampToEdge),
        wrap_t: Valid(WrappingMode::ClampToEdge),
        ..Default::default()
    };
    parts::add_texture(root, source, sampler)
}

impl Primitive {
    /// Whether all vertices have texture coordinates in the file.
    fn has_given_places(&self) -> bool {
        self.vertices.iter().all(|vertex| vertex.given.is_finite())
    }

    /// Its attributes, whose numbers begin at an offset in bytes of the vertices.
    fn attributes(&self, root: &mut Root, offset: u64) -> Attributes {
        let positions = self.vertices.iter().map(|vertex| vertex.position);
        let count = self.vertices.len();
        let at = |bytes: u64, type_: Type| Accessor {
            // Views of the binary chunk: 0 vertices, 1 indices, 2 image.
            type_: Valid(type_),
            ..accessor(0, offset + bytes, count)
        };
        let position = parts::with_bounds(at(0, Type::Vec3), positions);
        let mut attributes = vec![
            (Semantic::Positions, position),
            (Semantic::Normals, at(VECTOR_BYTES, Type::Vec3)),
            (Semantic::TexCoords(1), at(2 * VECTOR_BYTES, Type::Vec2)),
        ];
        // glTF numbers sets of coordinates from 0 on: without the file's, the map's are used for
        // both.
        let given = if self.has_given_places() { PLACE_BYTES } else { 0 };
        let first = at(2 * VECTOR_BYTES + given, Type::Vec2);
        attributes.push((Semantic::TexCoords(0), first));
        attributes.into_iter().map(|(name, numbers)| (Valid(name), root.push(numbers))).collect()
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
