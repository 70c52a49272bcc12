//! glTF 2.0 binary out: the mesh with radiosity, for viewers, engines and modellers.
//!
//! ```text
//!   header │ JSON chunk: what lies where     │ binary chunk
//! │ scene ── node ── node per group │ positions   normals     colours   radiosity  indices
//!          │   └ mesh: a primitive for each  │ p₀ p₁ p₂ …  p₀ p₁ p₂ …  …                    p₀ p₁
//!          │     material, by its name       │ (of each primitive, one after the other)
//! ```
//!
//! The numbers are written as they are computed; the JSON, which comes first, needs but counts and
//! the box of each primitive. (Khronos, "glTF 2.0 Specification", 2021.)

mod document;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use glam::{DVec3, Vec3};

use super::{cannot_write, write_file};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::geometry::aabb::Aabb;
use crate::io::tone::ToneCurve;
use crate::scene::Rgb;

/// Writes `light` as glTF 2.0 binary, `.glb`: the same bytes for the same light.
///
/// A node for each group and a primitive for each of its materials, by their names. Vertices have
/// `POSITION`, `NORMAL`, `COLOR_0` (linear, through `tone`, a curve of radiosity, within [0, 1])
/// and `_RADIOSITY` (W/m² per channel, linear). Materials are white and unlit
/// (`KHR_materials_unlit`), so that viewers show `COLOR_0` as it is; their `extras` have
/// reflectance and exitance. All numbers are 32-bit floats.
///
/// Lengths and axes are those of the scene's file, as the asset's `extras` say, although glTF means
/// metres with +y up: nothing is turned or scaled. A scene that lies more than 16 of its sizes from
/// the origin is moved there, and its node moves it back.
///
/// # Errors
/// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
pub fn write_glb(
    path: impl AsRef<Path>,
    light: &GatheredMesh,
    tone: &ToneCurve,
) -> Result<(), Error> {
    let path = path.as_ref();
    let model = Model::new(light, tone);
    let mut json = model.document().to_vec().map_err(|e| cannot_write(path, e))?;
    json.resize(json.len().next_multiple_of(4), b' ');
    let binary = model.binary_length();
    let total = 12 + 8 + json.len() as u64 + 8 + binary;
    let Ok(total) = u32::try_from(total) else {
        let found = format!("{total} bytes, where glTF binary has room for 4 GiB");
        return Err(cannot_write(path, io::Error::new(io::ErrorKind::FileTooLarge, found)));
    };
    write_file(path, |out| {
        for word in [MAGIC, VERSION, total, json.len() as u32, JSON_CHUNK] {
            out.write_all(&word.to_le_bytes())?;
        }
        out.write_all(&json)?;
        for word in [binary as u32, BINARY_CHUNK] {
            out.write_all(&word.to_le_bytes())?;
        }
        model.write_binary(out)
    })
}

/// "glTF", the version of the container, and the kinds of its chunks, "JSON" and "BIN".
const MAGIC: u32 = 0x4654_6C67;
const VERSION: u32 = 2;
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BINARY_CHUNK: u32 = 0x004E_4942;

/// Bytes of three floats.
const VECTOR_BYTES: u64 = 12;

/// Bytes of an index.
const INDEX_BYTES: u64 = 4;

/// Sizes of a scene between it and the origin from which on it is moved: see [`write_glb`].
const FAR_AWAY: f64 = 16.0;

/// What is written: the surface, cut up by groups and materials.
struct Model<'a> {
    light: &'a GatheredMesh,
    tone: &'a ToneCurve,
    primitives: Vec<Primitive>,
    /// The place that positions are relative to, scene unit.
    origin: Vec3,
}

/// The faces of one group and one material.
struct Primitive {
    group: u32,
    material: u32,
    /// Vertices of the surface, in the order of the file.
    vertices: Vec<u32>,
    /// Faces, by the places of their corners in `vertices`.
    faces: Vec<[u32; 3]>,
}

/// What a vertex has, each three floats, in the order of the file.
#[derive(Clone, Copy, PartialEq)]
enum Attribute {
    Position,
    Normal,
    Colour,
    Radiosity,
    // Texture coordinates, two floats, come here: TEXCOORD_0, of vertices of surfaces that have
    // them.
}

const ATTRIBUTES: [Attribute; 4] =
    [Attribute::Position, Attribute::Normal, Attribute::Colour, Attribute::Radiosity];

impl Model<'_> {
    fn new<'a>(light: &'a GatheredMesh, tone: &'a ToneCurve) -> Model<'a> {
        let bounds = Aabb::from_points(light.surface.positions.iter().copied());
        let reach = bounds.low.abs().max(bounds.high.abs()).max_element();
        let far = reach > FAR_AWAY * bounds.longest_side();
        let origin = if far { bounds.centre().as_vec3() } else { Vec3::ZERO };
        Model { light, tone, primitives: primitives(light), origin }
    }

    /// Vertices of all primitives.
    fn vertex_count(&self) -> u64 {
        self.primitives.iter().map(|primitive| primitive.vertices.len() as u64).sum()
    }

    /// Faces of all primitives.
    fn face_count(&self) -> u64 {
        self.primitives.iter().map(|primitive| primitive.faces.len() as u64).sum()
    }

    fn binary_length(&self) -> u64 {
        let vectors = ATTRIBUTES.len() as u64 * self.vertex_count();
        vectors * VECTOR_BYTES + 3 * self.face_count() * INDEX_BYTES
    }

    fn write_binary(&self, out: &mut impl Write) -> io::Result<()> {
        for attribute in ATTRIBUTES {
            for &v in self.primitives.iter().flat_map(|primitive| &primitive.vertices) {
                for x in self.value(attribute, v as usize).to_array() {
                    out.write_all(&x.to_le_bytes())?;
                }
            }
        }
        for &v in self.primitives.iter().flat_map(|primitive| primitive.faces.as_flattened()) {
            out.write_all(&v.to_le_bytes())?;
        }
        Ok(())
    }

    /// What vertex `v` of the surface has, as it is written.
    fn value(&self, attribute: Attribute, v: usize) -> Vec3 {
        let surface = &self.light.surface;
        match attribute {
            Attribute::Position => (surface.positions[v] - self.origin.as_dvec3()).as_vec3(),
            // glTF allows no other length than 1.
            Attribute::Normal => surface.normals[v].normalize_or(DVec3::Y).as_vec3(),
            Attribute::Colour => self.tone.linear(surface.radiosity[v]).as_vec3(),
            Attribute::Radiosity => {
                surface.radiosity[v].min(Rgb::splat(f64::from(f32::MAX))).as_vec3()
            }
        }
    }
}

/// The faces of `light` by group, then material, in the order of the scene's.
fn primitives(light: &GatheredMesh) -> Vec<Primitive> {
    let (surface, mesh) = (&light.surface, &light.mesh);
    let mut faces: BTreeMap<(u32, u32), Vec<[u32; 3]>> = BTreeMap::new();
    for (&face, &element) in surface.faces.iter().zip(&surface.elements) {
        let t = mesh.triangle(mesh.element(element as usize));
        let triangle = mesh.scene().triangles()[t];
        faces.entry((triangle.group, triangle.material)).or_default().push(face);
    }
    // Per vertex of the surface, the primitive that had it last, and its place there.
    let mut places = vec![(usize::MAX, 0); surface.positions.len()];
    let mut primitives = vec![];
    for ((group, material), mut faces) in faces {
        let mut vertices = vec![];
        for corner in faces.as_flattened_mut() {
            let place = &mut places[*corner as usize];
            if place.0 != primitives.len() {
                *place = (primitives.len(), vertices.len() as u32);
                vertices.push(*corner);
            }
            *corner = place.1;
        }
        primitives.push(Primitive { group, material, vertices, faces });
    }
    primitives
}
