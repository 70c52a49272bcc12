//! The same glTF file with light at its vertices.
//!
//! ```text
//!   document ── as it is, but for meshes of lit nodes ── attributes COLOR_0, _IRRADIANCE
//!   buffers  ── as they are                           ── and their numbers behind them
//! ```
//!
//! A mesh of several nodes has one copy for each whose light differs.

use glam::{DAffine3, DMat3, DVec3};
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Value, json};

use super::accessors::Values;
use super::additions::{ARRAY_BUFFER, Additions, add_extras, has_other_users};
use super::fault::Fault;
use super::geometry::{Group, bits};
use super::rewritten::{Source, rewritten};
use crate::error::Error;
use crate::gather::GatheredMesh;
use crate::io::glb::GlbSettings;
use crate::io::{Input, Output};
use crate::scene::Rgb;

/// Cosine below which two normals at one point are of different surfaces: 20°, half of
/// [`Mesh::CREASE_DEGREES`](crate::Mesh::CREASE_DEGREES).
const SAME_SURFACE: f64 = 0.94;

/// Writes the glTF file `source` again to `out`, binary or JSON as it is, with the `light` of a
/// bake of it: a primitive gets `_IRRADIANCE` (W/m² per channel, linear, 32-bit floats) and, where
/// it has no colours, `COLOR_0`: irradiance times reflectance 1 through the tone curve, within
/// [0, 1], linear. Vertices keep their number and order, and all else in the document and its
/// buffers stays as it is. The new numbers are behind those of the binary file, or in a data URI.
///
/// A vertex has the light of the baked vertices at its point in its node's group, of those whose
/// normals are within 20° of its own; without normals, of all. Both sides of a surface that are lit
/// share a vertex: it has their mean. Instances (`EXT_mesh_gpu_instancing`) are left out, since
/// they share vertices.
///
/// # Errors
/// [`crate::ErrorKind::File`] when a file cannot be read or written, [`crate::ErrorKind::Scene`]
/// for a source that is no glTF file.
pub fn write_lit_gltf<'i, 'o>(
    out: impl Into<Output<'o>>,
    source: impl Into<Input<'i>>,
    light: &GatheredMesh,
    scene: Option<&str>,
    settings: impl Into<GlbSettings>,
) -> Result<LitVertices, Error> {
    rewritten(out.into(), &source.into(), scene, |source, new| {
        let mut writer = Writer {
            source: &source,
            light: LightOfGroups::new(light),
            settings: settings.into(),
            new,
            known: FxHashMap::default(),
            counts: LitVertices::default(),
        };
        for (number, group) in (0u32..).zip(source.groups) {
            writer.light_node(number, group).map_err(|fault| source.error(fault))?;
        }
        Ok(writer.counts)
    })
}

/// How many vertices of a file have light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LitVertices {
    /// Vertices that have the light of the bake.
    pub lit: usize,
    /// Those at whose point there is none: of triangles without area, or of no triangle. They are
    /// black.
    pub without: usize,
    /// Instances that are left out.
    pub instances: usize,
}

/// Light of the vertices of a bake at one point of a group.
#[derive(Clone, Copy)]
struct AtPoint {
    normal: DVec3,
    irradiance: Rgb,
}

/// Light of a bake, by group and point.
struct LightOfGroups(FxHashMap<(u32, [u64; 3]), Vec<AtPoint>>);

impl LightOfGroups {
    fn new(light: &GatheredMesh) -> LightOfGroups {
        let (surface, mesh) = (&light.surface, &light.mesh);
        let mut all: FxHashMap<(u32, [u64; 3]), Vec<AtPoint>> = FxHashMap::default();
        let mut seen: FxHashSet<(u32, u32)> = FxHashSet::default();
        for (face, &element) in surface.faces.iter().zip(&surface.elements) {
            let t = mesh.triangle(mesh.element(element as usize));
            let group = mesh.scene().triangles()[t].group;
            for &v in face {
                if seen.insert((group, v)) {
                    let normal = surface.normals[v as usize];
                    let irradiance = surface.irradiance.get(v as usize).copied();
                    let at = AtPoint { normal, irradiance: irradiance.unwrap_or(Rgb::ZERO) };
                    let key = (group, bits(surface.positions[v as usize]));
                    all.entry(key).or_default().push(at);
                }
            }
        }
        LightOfGroups(all)
    }

    /// Irradiance of a vertex of `group`, with its unit normal if it has one.
    fn at(&self, group: u32, position: DVec3, normal: Option<DVec3>) -> Option<Rgb> {
        let all = self.0.get(&(group, bits(position)))?;
        // A surface that was turned to the light has another front than the file's.
        let cosine = |at: &AtPoint| normal.map_or(1.0, |normal| at.normal.dot(normal).abs());
        let nearest = all.iter().map(cosine).fold(0.0, f64::max);
        let is_of_it = |at: &&AtPoint| cosine(at) >= SAME_SURFACE.min(nearest);
        let (sum, count) = all
            .iter()
            .filter(is_of_it)
            .fold((Rgb::ZERO, 0.0), |(sum, count), at| (sum + at.irradiance, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }
}

/// A mesh of the new file: that of the source, the irradiance of its vertices by primitives, and
/// its number.
struct LitMesh {
    irradiance: Vec<Vec<Rgb>>,
    number: usize,
}

struct Writer<'a, 'b> {
    source: &'a Source<'a, 'b>,
    light: LightOfGroups,
    settings: GlbSettings,
    new: &'a mut Additions,
    /// Of each mesh of the source.
    known: FxHashMap<usize, Vec<LitMesh>>,
    counts: LitVertices,
}

impl Writer<'_, '_> {
    /// Gives light to the mesh of a node.
    fn light_node(&mut self, number: u32, group: &Group) -> Result<(), Fault> {
        if group.is_instance {
            self.counts.instances += 1;
            return Ok(());
        }
        let node = &self.source.document.nodes[group.node];
        let Some(mesh) = node.mesh else { return Ok(()) };
        let irradiance = self.irradiance(number, group, mesh)?;
        let same = self.known.get(&mesh).and_then(|all| {
            let is_same =
                |lit: &&LitMesh| are_equal(&lit.irradiance, &irradiance, self.settings.error);
            all.iter().find(is_same).map(|lit| lit.number)
        });
        let number = match same {
            Some(number) => number,
            None => self.add_mesh(mesh, irradiance),
        };
        self.new.json["nodes"][group.node]["mesh"] = json!(number);
        Ok(())
    }

    /// Irradiance of the vertices of each primitive.
    fn irradiance(
        &mut self,
        number: u32,
        group: &Group,
        mesh: usize,
    ) -> Result<Vec<Vec<Rgb>>, Fault> {
        let node = &self.source.document.nodes[group.node];
        let mut all = vec![];
        for primitive in &self.source.document.meshes[mesh].primitives {
            let mut of_primitive = vec![];
            if primitive.mode.is_none_or(|mode| (4..=6).contains(&mode))
                && let Some(positions) = self.source.reader.posed_vertices(node, mesh, primitive)?
            {
                let normals = primitive.attributes.others.get("NORMAL").and_then(Value::as_u64);
                let normals = normals.map(|k| self.source.reader.values(k as usize)).transpose()?;
                let normals = normals.filter(|values| values.has_components(3));
                let turn = normal_transform(group.world);
                for (v, p) in positions.into_iter().enumerate() {
                    let normal = normals
                        .as_ref()
                        .map(|normals: &Values<'_>| turn * DVec3::from_array(normals.get(v)));
                    let normal = normal.and_then(DVec3::try_normalize);
                    let found = self.light.at(number, group.world.transform_point3(p), normal);
                    match found {
                        Some(_) => self.counts.lit += 1,
                        None => self.counts.without += 1,
                    }
                    of_primitive.push(found.unwrap_or(Rgb::ZERO));
                }
            }
            all.push(of_primitive);
        }
        Ok(all)
    }

    /// Adds a mesh like `mesh` of the source with this light, or adds it to that mesh, if all nodes
    /// that have it are lit and it is the first: its number.
    fn add_mesh(&mut self, mesh: usize, irradiance: Vec<Vec<Rgb>>) -> usize {
        let is_shared = has_other_users(self.source.document, &self.source.is_placed, mesh);
        let number = if self.known.contains_key(&mesh) || is_shared {
            let copy = self.new.source["meshes"][mesh].clone();
            self.new.push("meshes", copy)
        } else {
            mesh
        };
        // Primitives that share their vertices share their light.
        let mut shared: FxHashMap<(usize, bool), [Option<usize>; 2]> = FxHashMap::default();
        for (k, of_primitive) in irradiance.iter().enumerate().filter(|(_, all)| !all.is_empty()) {
            let attributes = &self.source.document.meshes[mesh].primitives[k].attributes;
            let Some(position) = attributes.position else { continue };
            let has_colours = attributes.colour.is_some();
            let accessors = match shared.get(&(position, has_colours)) {
                Some(known) => *known,
                None => {
                    let added = self.add_light(of_primitive, has_colours);
                    shared.insert((position, has_colours), added);
                    added
                }
            };
            let to = &mut self.new.json["meshes"][number]["primitives"][k]["attributes"];
            for (name, accessor) in ["_IRRADIANCE", "COLOR_0"].into_iter().zip(accessors) {
                if let Some(accessor) = accessor {
                    to[name] = json!(accessor);
                }
            }
            // For programs that take the light from the other attribute.
            if !has_colours {
                let primitive = &mut self.new.json["meshes"][number]["primitives"][k];
                add_extras(primitive, json!({ "COLOR_0": "light" }));
            }
        }
        self.known.entry(mesh).or_default().push(LitMesh { irradiance, number });
        number
    }

    /// Adds irradiance and, unless there are colours, the colours that show it: their accessors.
    fn add_light(&mut self, irradiance: &[Rgb], has_colours: bool) -> [Option<usize>; 2] {
        let limit = Rgb::splat(f64::from(f32::MAX));
        let numbers = irradiance.iter().map(|e| e.min(limit).as_vec3().to_array()).collect();
        let tone = self.settings.tone;
        let colours = || irradiance.iter().map(|e| tone.linear(*e).as_vec3().to_array()).collect();
        let colours = (!has_colours).then(colours);
        [Some(self.add_accessor(numbers)), colours.map(|colours| self.add_accessor(colours))]
    }

    fn add_accessor(&mut self, vectors: Vec<[f32; 3]>) -> usize {
        let bytes: Vec<u8> = vectors.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let view = self.new.view(&bytes, Some(12), Some(ARRAY_BUFFER));
        let accessor = json!({
            "bufferView": view, "componentType": 5126, "count": vectors.len(), "type": "VEC3",
        });
        self.new.push("accessors", accessor)
    }
}

/// From normals of a mesh to those of the world, up to their length.
fn normal_transform(world: DAffine3) -> DMat3 {
    let m = world.matrix3;
    // Cofactors: the inverse transpose times the determinant, which may be 0.
    let (x, y, z) = (m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    DMat3::from_cols(x, y, z)
}

/// Whether light is the same but for `error`, as a share of its mean.
fn are_equal(a: &[Vec<Rgb>], b: &[Vec<Rgb>], error: f64) -> bool {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    let mean = pairs().map(|(a, b)| (*a + *b).element_sum() / 6.0).sum::<f64>()
        / pairs().count().max(1) as f64;
    pairs().all(|(a, b)| (*a - *b).abs().max_element() <= error * mean)
}
