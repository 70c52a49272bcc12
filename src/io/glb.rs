//! glTF 2.0 binary output: the mesh with radiosity, for viewers, engines and modellers.
//!
//! ```text
//!   header │ JSON chunk: layout of the data  │ binary chunk
//!          │ scene ── node ── node per group │ positions   normals     colours  radiosity  indices
//!          │   └ mesh: a primitive for each  │ p₀ p₁ p₂ …  p₀ p₁ p₂ …  …                   p₀ p₁
//!          │     material, by its name       │ (of each primitive, one after the other)
//! ```
//!
//! (Khronos, "glTF 2.0 Specification", 2021.)

mod file;
mod images;
#[cfg(feature = "light-map")]
mod light_map;
mod primitives;

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};
use gltf_json::material::{AlphaCutoff, AlphaMode, PbrBaseColorFactor, PbrMetallicRoughness};
use gltf_json::mesh::Semantic;
use gltf_json::texture::{Info, MinFilter};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Value};

use super::cannot_write;
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::io::tone::ToneCurve;
use crate::scene::Rgb;
use file::{Attributes, GlbFile, unlit};
use images::{Images, irradiance, mean_radiosity};
#[cfg(feature = "light-map")]
pub use light_map::write_light_map_glb;
use primitives::{Primitive, primitives};

/// Writes `light` as glTF 2.0 binary, `.glb`: the same bytes for the same light.
///
/// A node for each group and a primitive for each of its materials, by their names. Vertices have
/// `POSITION`, `NORMAL`, `COLOR_0` (linear, through `tone`, a curve of radiosity, within [0, 1])
/// and `_RADIOSITY` (W/m² per channel, linear). Materials are white and unlit
/// (`KHR_materials_unlit`), so that viewers show `COLOR_0` unchanged, and clear panes transmit the
/// mean of their transmittance (`alphaMode` `BLEND`); their `extras` have reflectance and exitance.
/// All numbers are 32-bit floats.
///
/// In a scene with textures, vertices whose corners have texture coordinates in the file have
/// `TEXCOORD_0`, after `-s` and `-o`, and `_IRRADIANCE` (W/m² per channel, linear), to be
/// multiplied by a texture of reflectance; `_RADIOSITY` has its mean around each vertex. The file
/// has an image for each material with `map_Ke`, else `map_Kd`, as its colour (PNG): the texture as
/// `tone` shows it under the median light on that material. Viewers multiply it by `COLOR_0`, the
/// ratio of the colour of the texture's mean under the light at a vertex to that under the median
/// light.
///
/// Lengths and axes are those of the scene's file, as the asset's `extras` say, although glTF has
/// metres with +y up: nothing is turned or scaled. A scene more than 16 of its sizes from the
/// origin is moved there, and its node moves it back.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
pub fn write_glb(
    path: impl AsRef<Path>,
    light: &GatheredMesh,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let path = path.as_ref();
    let origin = origin(Aabb::from_points(light.surface.positions.iter().copied()));
    let primitives = primitives(light);
    let images = Images::new(light, tone, &primitives);
    let images = images.map_err(|e| cannot_write(path, io::Error::other(e)))?;
    let model = Model { light, tone, images, origin };
    let mut file = GlbFile::new(&model.notes());
    let (mut materials, mut groups) = (BTreeMap::new(), vec![]);
    for of_group in primitives.chunk_by(|a, b| a.group == b.group) {
        let mut parts = vec![];
        for primitive in of_group {
            let key = (primitive.material, primitive.shown.is_some());
            let material = || model.add_material(&mut file, primitive);
            let material = *materials.entry(key).or_insert_with(material);
            let attributes = model.add_attributes(&mut file, primitive);
            parts.push(file.triangles(attributes, &primitive.faces, material));
        }
        let name = &light.mesh.scene().groups()[of_group[0].group as usize];
        groups.push(file.add_group(name, parts));
    }
    for png in model.images.into_files() {
        file.add_image(png, None);
    }
    file.write(path, groups, origin)
}

/// Origin of the positions written for a scene with these `bounds`, scene unit.
fn origin(bounds: Aabb) -> Vec3 {
    let reach = bounds.low.abs().max(bounds.high.abs()).max_element();
    // See `write_glb`.
    let far = reach > 16.0 * bounds.longest_side();
    if far { bounds.centre().as_vec3() } else { Vec3::ZERO }
}

/// The file's content: the surface, split by groups and materials.
struct Model<'a> {
    light: &'a GatheredMesh,
    tone: &'a ToneCurve,
    images: Images,
    /// The point that positions are relative to, scene unit.
    origin: Vec3,
}

impl Model<'_> {
    fn notes(&self) -> BTreeMap<&'static str, Value> {
        let images = "textures in the median light of a material; COLOR_0 is relative to that";
        BTreeMap::from([
            ("axes", Value::from("those of the scene's file")),
            ("unit", Value::from("that of the scene's file")),
            ("_RADIOSITY", Value::from("W/m2 per channel, linear BT.709")),
            ("COLOR_0", Value::from("_RADIOSITY times exposure, highlights rolled off")),
            ("images", Value::from(images)),
            ("exposure", Value::from(self.tone.exposure())),
        ])
    }

    /// Adds the attributes of the vertices of a primitive, those of textures if they have texture
    /// coordinates.
    fn add_attributes(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Attributes {
        let (surface, vertices) = (&self.light.surface, &primitive.vertices);
        let light = |b: Rgb| b.min(Rgb::splat(f64::from(f32::MAX))).as_vec3().to_array();
        let irradiance = |v: u32| irradiance(self.light, v);
        let image = primitive.shown.and_then(|_| self.images.get(primitive.material));
        let material = &self.light.mesh.scene().materials()[primitive.material as usize];
        let position = |v: u32| (surface.positions[v as usize] - self.origin.as_dvec3()).as_vec3();
        // glTF allows only length 1.
        let normal = |v: u32| surface.normals[v as usize].normalize_or(DVec3::Y).as_vec3();
        let colour = |v: u32| match image {
            None => self.tone.linear(surface.radiosity[v as usize]).as_vec3(),
            Some(image) => {
                let colour = self.tone.linear(mean_radiosity(material, irradiance(v)));
                image.vertex_colour(colour).as_vec3()
            }
        };
        let of_all = |value: &dyn Fn(u32) -> [f32; 3]| -> Vec<[f32; 3]> {
            vertices.iter().map(|&v| value(v)).collect()
        };
        let positions = file.add_positions(&of_all(&|v| position(v).to_array()));
        let normals = file.add_vectors("NORMAL", &of_all(&|v| normal(v).to_array()));
        let colours = file.add_vectors("COLOR_0", &of_all(&|v| colour(v).to_array()));
        let radiosity = of_all(&|v| light(surface.radiosity[v as usize]));
        let radiosity = file.add_vectors("_RADIOSITY", &radiosity);
        // Custom names are written with a leading underscore, which glTF requires.
        let mut all = Attributes::from([
            (Valid(Semantic::Positions), positions),
            (Valid(Semantic::Normals), normals),
            (Valid(Semantic::Colors(0)), colours),
            (Valid(Semantic::Extras("RADIOSITY".into())), radiosity),
        ]);
        if !primitive.places.is_empty() {
            let irradiance = file.add_vectors("_IRRADIANCE", &of_all(&|v| light(irradiance(v))));
            let places: Vec<[f32; 2]> = primitive.places.iter().map(Vec2::to_array).collect();
            let places = file.add_vectors("TEXCOORD_0", &places);
            all.insert(Valid(Semantic::Extras("IRRADIANCE".into())), irradiance);
            all.insert(Valid(Semantic::TexCoords(0)), places);
        }
        all
    }

    /// Adds an unlit material: the colour is in the vertices, and in the image if there is one.
    fn add_material(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Index<Material> {
        let material = &self.light.mesh.scene().materials()[primitive.material as usize];
        // Clear panes are transparent in viewers.
        let passed = material.clear_transmittance().map(|share| share.element_sum() / 3.0);
        let has_mask = primitive.shown.is_some_and(|shown| shown.mask.is_some());
        let alpha_mode = match (passed, has_mask) {
            (Some(_), _) => AlphaMode::Blend,
            (None, true) => AlphaMode::Mask,
            (None, false) => AlphaMode::Opaque,
        };
        let alpha = 1.0 - passed.unwrap_or(0.0) as f32;
        let colour = PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([1.0, 1.0, 1.0, alpha]),
            base_color_texture: self.add_texture(file, primitive),
            ..Default::default()
        };
        file.add_material(Material {
            alpha_mode: Valid(alpha_mode),
            alpha_cutoff: (alpha_mode == AlphaMode::Mask).then_some(AlphaCutoff(0.5)),
            ..unlit(material, colour)
        })
    }

    /// Adds the image of a primitive, repeated or not, smoothly filtered; none without a texture.
    fn add_texture(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Option<Info> {
        let clamped = primitive.shown?.frame()?.clamped;
        let source = Index::new(self.images.number(primitive.material)? as u32);
        let index = file.add_texture(source, MinFilter::LinearMipmapLinear, clamped);
        Some(Info { index, tex_coord: 0, extensions: None, extras: None })
    }
}
