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
mod materials;
mod primitives;
mod settings;
mod two_sides;

use std::collections::BTreeMap;
use std::io;

use glam::{DVec3, Vec2, Vec3};
use gltf_json::mesh::Semantic;
use gltf_json::texture::MinFilter;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Texture, Value};
use image::ImageResult;
use rustc_hash::FxHashMap;

use super::Output;
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::scene::Rgb;
use file::{Attributes, GlbFile};
#[cfg(feature = "light-map")]
pub(super) use images::png;
use images::{Images, mean_radiosity};
#[cfg(feature = "light-map")]
pub use light_map::write_light_map_glb;
use materials::{Look, unlit};
use primitives::{Primitive, primitives};
pub use settings::GlbSettings;
use two_sides::TwoSides;

/// Writes `light` as glTF 2.0 binary, `.glb`: the same bytes for the same light.
///
/// A node for each group and a primitive for each of its materials, by their names. Vertices have
/// `POSITION`, `NORMAL`, `COLOR_0` (linear, through a tone curve of radiosity, within [0, 1]) and
/// `_RADIOSITY` (W/m² per channel, linear). Materials are white and unlit
/// (`KHR_materials_unlit`), so that viewers show `COLOR_0` unchanged, and clear panes transmit the
/// mean of their transmittance (`alphaMode` `BLEND`); their `extras` have reflectance and exitance.
/// All numbers are 32-bit floats.
///
/// In a scene with textures, vertices whose corners have texture coordinates in the file have
/// `TEXCOORD_0`, after `-s` and `-o`, and `_IRRADIANCE` (W/m² per channel, linear), to be
/// multiplied by a texture of reflectance; `_RADIOSITY` has its mean around each vertex. The file
/// has an image for each material with `map_Ke`, else `map_Kd`, as its colour (PNG): the texture as
/// the curve shows it under the median light on that material. Viewers multiply it by `COLOR_0`,
/// the ratio of the colour of the texture's mean under the light at a vertex to that under the
/// median light.
///
/// Lengths and axes of vertices are those of the scene, and the top node turns them to +Y up and
/// scales them to metres, as glTF has them ([`Scene::up`](crate::Scene::up), [`GlbSettings`]).
/// A scene more than 16 of its sizes
/// from the origin is moved there, and that node moves it back.
///
/// Of a surface that reflects on both sides each is a face whose back viewers leave out. So that
/// ray tracers, which do not, do not meet both in one place, they lie 1e-4 of the scene's diagonal
/// apart; where the light of both is the same within [`GlbSettings::error`], they are one face with
/// a double-sided material.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
pub fn write_glb<'o>(
    out: impl Into<Output<'o>>,
    light: &GatheredMesh,
    settings: impl Into<GlbSettings>,
) -> Result<(), Error> {
    let (out, settings) = (out.into(), settings.into());
    let model = Model::new(light, &settings);
    let model = model.map_err(|e| out.cannot_write(io::Error::other(e)))?;
    let mut file = GlbFile::new(&model.notes());
    let (mut materials, mut groups) = (BTreeMap::new(), vec![]);
    for of_group in model.primitives.chunk_by(|a, b| a.group == b.group) {
        let mut parts = vec![];
        for primitive in of_group {
            let Primitive { material, shown, is_double_sided, .. } = primitive;
            let key = (*material, shown.is_some(), *is_double_sided);
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
    let top = settings.top_node(light.mesh.scene(), model.origin.as_dvec3());
    file.write(out, top, groups)
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
    settings: &'a GlbSettings,
    primitives: Vec<Primitive<'a>>,
    images: Images,
    /// The point that positions are relative to, scene unit.
    origin: Vec3,
    /// By how much vertices are moved, scene unit.
    shifts: FxHashMap<u32, DVec3>,
}

impl<'a> Model<'a> {
    fn new(light: &'a GatheredMesh, settings: &'a GlbSettings) -> ImageResult<Model<'a>> {
        let sides = TwoSides::of_light(light, settings.error);
        let primitives = primitives(light, &sides);
        let textured = primitives.iter().filter_map(|primitive| {
            let irradiances = primitive.vertices.iter().map(|&v| irradiance(light, v));
            Some((primitive.material, primitive.shown?, irradiances.collect()))
        });
        let images = Images::new(light.mesh.scene().materials(), &settings.tone, textured)?;
        let origin = origin(Aabb::from_points(light.surface.positions.iter().copied()));
        let shifts = shifts(light, &sides);
        Ok(Model { light, settings, primitives, images, origin, shifts })
    }

    fn notes(&self) -> BTreeMap<&'static str, Value> {
        let images = "textures in the median light of a material; COLOR_0 is relative to that";
        BTreeMap::from([
            ("_RADIOSITY", Value::from("W/m2 per channel, linear BT.709")),
            ("COLOR_0", Value::from("_RADIOSITY times exposure, highlights rolled off")),
            ("images", Value::from(images)),
            ("exposure", Value::from(self.settings.tone.exposure())),
        ])
    }

    /// Adds the attributes of the vertices of a primitive, those of textures if they have texture
    /// coordinates.
    fn add_attributes(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Attributes {
        let (surface, vertices) = (&self.light.surface, &primitive.vertices);
        let light = |b: Rgb| b.min(Rgb::splat(f64::from(f32::MAX))).as_vec3().to_array();
        let irradiance = |v: u32| irradiance(self.light, v);
        let tone = &self.settings.tone;
        let image = primitive.shown.and_then(|_| self.images.get(primitive.material));
        let material = &self.light.mesh.scene().materials()[primitive.material as usize];
        let position = |v: u32| {
            let shift = self.shifts.get(&v).copied().unwrap_or_default();
            (surface.positions[v as usize] + shift - self.origin.as_dvec3()).as_vec3()
        };
        // glTF allows only length 1.
        let normal = |v: u32| surface.normals[v as usize].normalize_or(DVec3::Y).as_vec3();
        let colour = |v: u32| match image {
            None => tone.linear(surface.radiosity[v as usize]).as_vec3(),
            Some(image) => {
                let colour = tone.linear(mean_radiosity(material, irradiance(v)));
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

    fn add_material(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Index<Material> {
        let material = &self.light.mesh.scene().materials()[primitive.material as usize];
        let look = Look {
            texture: self.add_texture(file, primitive).map(|index| (index, 0)),
            has_mask: primitive.shown.is_some_and(|shown| shown.mask.is_some()),
            is_double_sided: primitive.is_double_sided,
        };
        file.add_material(unlit(material, look))
    }

    /// Adds the image of a primitive, repeated or not, smoothly filtered; none without a texture.
    fn add_texture(&self, file: &mut GlbFile, primitive: &Primitive<'_>) -> Option<Index<Texture>> {
        let clamped = primitive.shown?.frame()?.clamped;
        let source = Index::new(self.images.number(primitive.material)? as u32);
        Some(file.add_texture(source, MinFilter::LinearMipmapLinear, clamped))
    }
}

/// Irradiance of a vertex; 0 if unknown.
fn irradiance(light: &GatheredMesh, vertex: u32) -> Rgb {
    light.surface.irradiance.get(vertex as usize).copied().unwrap_or(Rgb::ZERO)
}

/// By how much the vertices of `light` are moved, scene unit; none of those that stay.
fn shifts(light: &GatheredMesh, sides: &TwoSides) -> FxHashMap<u32, DVec3> {
    let (surface, mesh) = (&light.surface, &light.mesh);
    let mut shifts = FxHashMap::default();
    for (face, &element) in surface.faces.iter().zip(&surface.elements) {
        let t = mesh.triangle(mesh.element(element as usize));
        for &v in face.iter().filter(|_| sides.is_moved(t)) {
            let weights = mesh.scene().barycentric(t, surface.positions[v as usize]);
            shifts.entry(v).or_insert_with(|| sides.shift(t, weights));
        }
    }
    shifts
}
