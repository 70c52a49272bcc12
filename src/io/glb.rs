//! glTF 2.0 binary output: the mesh with radiosity, for viewers, engines and modellers.
//!
//! ```text
//!   header │ JSON chunk: layout of the data  │ binary chunk
//!          │ scene ── node ── node per group │ positions   normals     colours  radiosity  indices
//!          │   └ mesh: a primitive for each  │ p₀ p₁ p₂ …  p₀ p₁ p₂ …  …                   p₀ p₁
//!          │     material, by its name       │ (of each primitive, one after the other)
//! ```
//!
//! The numbers are written as they are computed; the JSON, which comes first, needs only counts and
//! the box of each primitive. (Khronos, "glTF 2.0 Specification", 2021.)

mod container;
mod document;
mod images;
#[cfg(feature = "light-map")]
mod light_map;
mod parts;
mod primitives;

use std::io::{self, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

use super::cannot_write;
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::io::tone::ToneCurve;
use crate::scene::Rgb;
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
    let model = Model::new(light, tone).map_err(|e| cannot_write(path, io::Error::other(e)))?;
    container::write(path, &model.document(), model.binary_length(), |out| model.write_binary(out))
}

/// Bytes of three floats.
const VECTOR_BYTES: u64 = 12;

/// Bytes of two floats.
const PLACE_BYTES: u64 = 8;

/// Bytes of an index.
const INDEX_BYTES: u64 = 4;

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
    primitives: Vec<Primitive<'a>>,
    images: Images,
    /// The point that positions are relative to, scene unit.
    origin: Vec3,
}

/// Attributes of a vertex, in the order of the file: three floats each, except two for texture
/// coordinates. The last two are for vertices that have texture coordinates.
#[derive(Clone, Copy, PartialEq)]
enum Attribute {
    Position,
    Normal,
    Colour,
    Radiosity,
    Irradiance,
    TextureCoordinates,
}

impl Attribute {
    /// Bytes of one value.
    fn size(self) -> u64 {
        if self == Attribute::TextureCoordinates { PLACE_BYTES } else { VECTOR_BYTES }
    }

    /// Whether vertices of `primitive` have it.
    fn is_of(self, primitive: &Primitive<'_>) -> bool {
        let of_textures = matches!(self, Attribute::Irradiance | Attribute::TextureCoordinates);
        !of_textures || !primitive.places.is_empty()
    }
}

impl Model<'_> {
    fn new<'a>(light: &'a GatheredMesh, tone: &'a ToneCurve) -> image::ImageResult<Model<'a>> {
        let origin = origin(Aabb::from_points(light.surface.positions.iter().copied()));
        let primitives = primitives(light);
        let images = Images::new(light, tone, &primitives)?;
        Ok(Model { light, tone, primitives, images, origin })
    }

    /// The attributes that any primitive has.
    fn attributes(&self) -> impl Iterator<Item = Attribute> {
        [
            Attribute::Position,
            Attribute::Normal,
            Attribute::Colour,
            Attribute::Radiosity,
            Attribute::Irradiance,
            Attribute::TextureCoordinates,
        ]
        .into_iter()
        .filter(|a| self.primitives.iter().any(|p| a.is_of(p)))
    }

    /// Number of vertices of all primitives with an attribute.
    fn vertex_count(&self, attribute: Attribute) -> u64 {
        let having = self.primitives.iter().filter(|primitive| attribute.is_of(primitive));
        having.map(|primitive| primitive.vertices.len() as u64).sum()
    }

    /// Number of faces of all primitives.
    fn face_count(&self) -> u64 {
        self.primitives.iter().map(|primitive| primitive.faces.len() as u64).sum()
    }

    /// Bytes of the binary chunk, a multiple of four.
    fn binary_length(&self) -> u64 {
        (self.geometry_length() + self.images.length()).next_multiple_of(4)
    }

    /// Bytes of attributes and indices.
    fn geometry_length(&self) -> u64 {
        let bytes = |a: Attribute| self.vertex_count(a) * a.size();
        self.attributes().map(bytes).sum::<u64>() + 3 * self.face_count() * INDEX_BYTES
    }

    fn write_binary(&self, out: &mut impl Write) -> io::Result<()> {
        for attribute in self.attributes() {
            for primitive in self.primitives.iter().filter(|p| attribute.is_of(p)) {
                for k in 0..primitive.vertices.len() {
                    let numbers = self.value(attribute, primitive, k).to_array();
                    for x in &numbers[..attribute.size() as usize / size_of::<f32>()] {
                        out.write_all(&x.to_le_bytes())?;
                    }
                }
            }
        }
        for &v in self.primitives.iter().flat_map(|primitive| primitive.faces.as_flattened()) {
            out.write_all(&v.to_le_bytes())?;
        }
        for image in self.images.iter() {
            out.write_all(&image.png)?;
        }
        let padding = self.binary_length() - self.geometry_length() - self.images.length();
        out.write_all(&[0; 4][..padding as usize])
    }

    /// The value of an attribute of vertex `k` of `primitive`, as written.
    fn value(&self, attribute: Attribute, primitive: &Primitive<'_>, k: usize) -> Vec3 {
        let (surface, v) = (&self.light.surface, primitive.vertices[k] as usize);
        let light = |b: Rgb| b.min(Rgb::splat(f64::from(f32::MAX))).as_vec3();
        let irradiance = || irradiance(self.light, primitive.vertices[k]);
        match attribute {
            Attribute::Position => (surface.positions[v] - self.origin.as_dvec3()).as_vec3(),
            // glTF allows only length 1.
            Attribute::Normal => surface.normals[v].normalize_or(DVec3::Y).as_vec3(),
            Attribute::Colour => {
                let image = primitive.shown.and_then(|_| self.images.get(primitive.material));
                let Some(image) = image else {
                    return self.tone.linear(surface.radiosity[v]).as_vec3();
                };
                let material = &self.light.mesh.scene().materials()[primitive.material as usize];
                let colour = self.tone.linear(mean_radiosity(material, irradiance()));
                image.vertex_colour(colour).as_vec3()
            }
            Attribute::Radiosity => light(surface.radiosity[v]),
            Attribute::Irradiance => light(irradiance()),
            Attribute::TextureCoordinates => primitive.places[k].extend(0.0),
        }
    }
}
