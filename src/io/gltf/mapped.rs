//! The same glTF file with coordinates in a light map.
//!
//! ```text
//!   triangle of the file ── the same corners and group ── triangle of the map's scene
//!   vertex of the file   ── one for each place in the map ── attributes as they are, TEXCOORD_n
//! ```

use glam::{DVec2, DVec3};
use image::ExtendedColorType;
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Value, json};

use super::accessors::Values;
use super::additions::{
    ARRAY_BUFFER, Additions, ELEMENT_ARRAY_BUFFER, add_extras, has_other_users,
};
use super::document::Primitive;
use super::fault::Fault;
use super::geometry::{Group, bits, check_number, triangles_of};
use super::rewritten::{Source, rewritten};
use crate::error::Error;
use crate::io::glb::{GlbSettings, png};
use crate::io::{Input, Output};
use crate::light_map::{LightMap, MapPage};
use crate::scene::{Rgb, luminance};

/// How a glTF file names its light map: glTF has no place for one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum MapBinding {
    /// As `extras` of primitives: `{"radiosity": {"lightMap": FILE, "texCoord": n}}`, for programs
    /// that set the map themselves. Materials stay as they are.
    #[default]
    Extras,
    /// As `emissiveTexture` of materials that reflect nothing: what surfaces emit and reflect, by
    /// materials without their textures, through the tone curve. Any program shows it.
    Emissive,
    /// As `occlusionTexture`: the luminance of the irradiance over its largest, for programs that
    /// light scenes evenly.
    Occlusion,
}

/// Writes the glTF file `source` again to `out`, binary or JSON as it is, with a set of texture
/// coordinates behind those that primitives have, those of the light `map` of a bake of it. A mesh
/// of several nodes has one copy for each. Vertices are those of the file, once for each place that
/// they have in the map; attributes and morph targets keep their types, and all else in the
/// document stays as it is. Of a triangle that is lit on both sides it is the front's light.
/// `files` names the file of each page for [`MapBinding::Extras`]. Instances
/// (`EXT_mesh_gpu_instancing`) share vertices, and have none: their number is returned.
///
/// # Errors
/// [`crate::ErrorKind::File`] when a file cannot be read or written, [`crate::ErrorKind::Scene`]
/// for a source that is no glTF file.
pub fn write_mapped_gltf<'i, 'o>(
    out: impl Into<Output<'o>>,
    source: impl Into<Input<'i>>,
    map: &LightMap,
    scene: Option<&str>,
    (binding, files): (MapBinding, &[String]),
    settings: impl Into<GlbSettings>,
) -> Result<usize, Error> {
    rewritten(out.into(), &source.into(), scene, |source, new| {
        let mut writer = Writer {
            source: &source,
            places: places(map),
            map,
            binding,
            files,
            textures: vec![],
            materials: FxHashMap::default(),
            used: FxHashSet::default(),
            new,
        };
        let textures = writer.add_textures(&settings.into());
        textures.map_err(|e| {
            let found = format!("the light map cannot be encoded as PNG: {e}");
            source.error(Fault::new(found, "make a smaller map"))
        })?;
        let mut instances = 0;
        for (number, group) in (0u32..).zip(source.groups) {
            if group.is_instance {
                instances += 1;
            } else {
                writer.map_node(number, group).map_err(|fault| source.error(fault))?;
            }
        }
        Ok(instances)
    })
}

/// Three corners in any order, and the group of their triangle.
type Corners = (u32, [[u64; 3]; 3]);

fn corners_of(group: u32, corners: [DVec3; 3]) -> Corners {
    let mut points = corners.map(bits);
    points.sort_unstable();
    (group, points)
}

/// The triangles of the map's scene by their corners: the first at each place, which is the front.
fn places(map: &LightMap) -> FxHashMap<Corners, usize> {
    let scene = map.atlas.scene();
    let mut places = FxHashMap::default();
    for (t, triangle) in scene.triangles().iter().enumerate() {
        places.entry(corners_of(triangle.group, scene.corners(t))).or_insert(t);
    }
    places
}

/// Where a vertex of the file is in the map.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct PlacedVertex {
    vertex: usize,
    place: [u32; 2],
}

/// Triangles of one page.
#[derive(Default)]
struct PagePart {
    vertices: Vec<PlacedVertex>,
    numbers: FxHashMap<PlacedVertex, u32>,
    indices: Vec<u32>,
}

struct Writer<'a, 'b> {
    source: &'a Source<'a, 'b>,
    places: FxHashMap<Corners, usize>,
    map: &'a LightMap,
    binding: MapBinding,
    files: &'a [String],
    /// Of each page, unless materials stay as they are.
    textures: Vec<usize>,
    /// The copy of each material for a page and a set of coordinates.
    materials: FxHashMap<(Option<usize>, usize, usize), usize>,
    /// Meshes of the source that a node has taken for its own.
    used: FxHashSet<usize>,
    new: &'a mut Additions,
}

impl Writer<'_, '_> {
    /// Adds the images of the map that materials show.
    fn add_textures(&mut self, settings: &GlbSettings) -> image::ImageResult<()> {
        let pages = self.map.atlas.pages().len();
        let tone = settings.tone;
        let image = |page: MapPage, values: &[Rgb], shown: &dyn Fn(Rgb) -> [u8; 3]| {
            let bytes: Vec<u8> = page.of(values).into_iter().flat_map(shown).collect();
            png(&bytes, page.size(), ExtendedColorType::Rgb8)
        };
        let largest = self.map.irradiance.iter().map(|e| luminance(*e)).fold(0.0, f64::max);
        let radiosity = match self.binding {
            MapBinding::Emissive => self.map.radiosity(),
            _ => vec![],
        };
        for page in (0..pages).map(|k| self.map.page(k)) {
            let image = match self.binding {
                MapBinding::Extras => return Ok(()),
                MapBinding::Emissive => image(page, &radiosity, &|b| tone.display(b))?,
                MapBinding::Occlusion => {
                    let share = |e: Rgb| (255.0 * luminance(e) / largest.max(1e-300)).round() as u8;
                    image(page, &self.map.irradiance, &|e| [share(e); 3])?
                }
            };
            let view = self.new.view(&image, None, None);
            let source =
                self.new.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
            // Without smaller images, in which charts would run together.
            let sampler =
                json!({ "magFilter": 9729, "minFilter": 9729, "wrapS": 33071, "wrapT": 33071 });
            let sampler = self.new.push("samplers", sampler);
            let texture =
                self.new.push("textures", json!({ "source": source, "sampler": sampler }));
            self.textures.push(texture);
        }
        Ok(())
    }

    /// Gives the mesh of a node its places in the map.
    fn map_node(&mut self, number: u32, group: &Group) -> Result<(), Fault> {
        let node = &self.source.document.nodes[group.node];
        let Some(mesh) = node.mesh else { return Ok(()) };
        let mut primitives = vec![];
        for (k, primitive) in self.source.document.meshes[mesh].primitives.iter().enumerate() {
            let old = self.old_primitive(mesh, k);
            let is_mapped = primitive.mode.is_none_or(|mode| (4..=6).contains(&mode));
            let positions = match is_mapped {
                true => self.source.reader.posed_vertices(node, mesh, primitive)?,
                false => None,
            };
            match positions {
                None => primitives.push(old),
                Some(positions) => {
                    let world: Vec<DVec3> =
                        positions.into_iter().map(|p| group.world.transform_point3(p)).collect();
                    for (page, part) in self.parts(number, primitive, &world)? {
                        primitives.push(self.new_primitive(&old, primitive, page, &part)?);
                    }
                }
            }
        }
        let is_shared = has_other_users(self.source.document, &self.source.is_placed, mesh);
        if self.used.insert(mesh) && !is_shared {
            self.new.json["meshes"][mesh]["primitives"] = json!(primitives);
        } else {
            let mut copy = self.new.source["meshes"][mesh].clone();
            copy["primitives"] = json!(primitives);
            let number = self.new.push("meshes", copy);
            self.new.json["nodes"][group.node]["mesh"] = json!(number);
        }
        Ok(())
    }

    /// A primitive of the source.
    fn old_primitive(&self, mesh: usize, k: usize) -> Value {
        self.new.source["meshes"][mesh]["primitives"][k].clone()
    }

    /// The triangles of a primitive by pages of the map, with their vertices at `positions` in the
    /// world.
    fn parts(
        &self,
        group: u32,
        primitive: &Primitive,
        positions: &[DVec3],
    ) -> Result<Vec<(usize, PagePart)>, Fault> {
        let indices = primitive.indices.map(|k| self.source.reader.values(k)).transpose()?;
        let count = indices.as_ref().map_or(positions.len(), Values::count);
        let triangles = triangles_of(primitive.mode, count)?;
        check_number(triangles.len())?;
        let (scene, mut parts) = (self.map.atlas.scene(), vec![]);
        for items in triangles {
            let vertices = items.map(|k| indices.as_ref().map_or(k, |indices| indices.index(k)));
            if vertices.iter().any(|&v| v >= positions.len()) {
                continue; // Read before, and refused there.
            }
            let corners = vertices.map(|v| positions[v]);
            let found = self.places.get(&corners_of(group, corners));
            let (page, coordinates) = match found {
                Some(&t) => {
                    let (page, coordinates) = self.map.atlas.page_coordinates(t);
                    let of = scene.corners(t).map(bits);
                    let at = |p: DVec3| of.iter().position(|&q| q == bits(p)).unwrap_or(0);
                    (page, corners.map(|p| coordinates[at(p)]))
                }
                // Without area.
                None => (0, [DVec2::ZERO; 3]),
            };
            let k = parts.iter().position(|(of, _): &(usize, PagePart)| *of == page);
            let k = k.unwrap_or_else(|| {
                parts.push((page, PagePart::default()));
                parts.len() - 1
            });
            let part = &mut parts[k].1;
            for (vertex, place) in vertices.into_iter().zip(coordinates) {
                let place = place.as_vec2().to_array().map(f32::to_bits);
                let placed = PlacedVertex { vertex, place };
                let next = part.vertices.len() as u32;
                let number = *part.numbers.entry(placed).or_insert(next);
                if number == next {
                    part.vertices.push(placed);
                }
                part.indices.push(number);
            }
        }
        Ok(parts)
    }

    /// A primitive of the part of one on a page.
    fn new_primitive(
        &mut self,
        old: &Value,
        primitive: &Primitive,
        page: usize,
        part: &PagePart,
    ) -> Result<Value, Fault> {
        let mut new = old.clone();
        let gathered = |this: &mut Self, attributes: &mut Value| -> Result<(), Fault> {
            for (name, accessor) in attributes.as_object_mut().into_iter().flatten() {
                if let Some(k) = accessor.as_u64() {
                    let is_position = name == "POSITION";
                    *accessor = json!(this.gathered(k as usize, &part.vertices, is_position)?);
                }
            }
            Ok(())
        };
        gathered(self, &mut new["attributes"])?;
        let targets = new.get_mut("targets").and_then(Value::as_array_mut);
        for target in targets.into_iter().flatten() {
            gathered(self, target)?;
        }
        let attributes = &primitive.attributes.others;
        let set = (0..).find(|n| !attributes.contains_key(&format!("TEXCOORD_{n}"))).unwrap_or(0);
        let places: Vec<u8> =
            part.vertices.iter().flat_map(|v| v.place).flat_map(u32::to_le_bytes).collect();
        let view = self.new.view(&places, Some(8), Some(ARRAY_BUFFER));
        let count = part.vertices.len();
        let places =
            json!({ "bufferView": view, "componentType": 5126, "count": count, "type": "VEC2" });
        let places = self.new.push("accessors", places);
        new["attributes"][format!("TEXCOORD_{set}")] = json!(places);
        let indices: Vec<u8> = part.indices.iter().flat_map(|k| k.to_le_bytes()).collect();
        let view = self.new.view(&indices, None, Some(ELEMENT_ARRAY_BUFFER));
        let count = part.indices.len();
        let indices =
            json!({ "bufferView": view, "componentType": 5125, "count": count, "type": "SCALAR" });
        new["indices"] = json!(self.new.push("accessors", indices));
        if let Some(object) = new.as_object_mut() {
            object.shift_remove("mode");
            // Its compressed form has other vertices.
            if let Some(extensions) = object.get_mut("extensions").and_then(Value::as_object_mut) {
                extensions.shift_remove("KHR_draco_mesh_compression");
                if extensions.is_empty() {
                    object.shift_remove("extensions");
                }
            }
        }
        match self.binding {
            MapBinding::Extras => {
                let file = self.files.get(page);
                add_extras(&mut new, json!({ "lightMap": file, "texCoord": set }));
            }
            _ => new["material"] = json!(self.bound(primitive.material, page, set)),
        }
        Ok(new)
    }

    /// An accessor of the items of another at these vertices.
    fn gathered(
        &mut self,
        accessor: usize,
        vertices: &[PlacedVertex],
        has_range: bool,
    ) -> Result<usize, Fault> {
        let values = self.source.reader.values(accessor)?;
        let stride = values.item_bytes().next_multiple_of(4);
        let mut bytes = Vec::with_capacity(stride * vertices.len());
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for PlacedVertex { vertex, .. } in vertices {
            bytes.extend(values.raw(*vertex));
            bytes.resize(bytes.len().next_multiple_of(stride), 0);
            for (k, x) in values.raw_numbers::<3>(*vertex).into_iter().enumerate() {
                (low[k], high[k]) = (low[k].min(x), high[k].max(x));
            }
        }
        let view = self.new.view(&bytes, Some(stride), Some(ARRAY_BUFFER));
        let of = &self.source.document.accessors[accessor];
        let mut new = json!({
            "bufferView": view, "componentType": of.component_type, "count": vertices.len(),
            "type": of.kind,
        });
        if of.normalized {
            new["normalized"] = json!(true);
        }
        if has_range {
            (new["min"], new["max"]) = (json!(low), json!(high));
        }
        Ok(self.new.push("accessors", new))
    }

    /// The copy of a material that shows a page of the map at a set of coordinates.
    fn bound(&mut self, material: Option<usize>, page: usize, set: usize) -> usize {
        if let Some(&known) = self.materials.get(&(material, page, set)) {
            return known;
        }
        let mut bound = material.map_or(json!({}), |k| self.new.source["materials"][k].clone());
        let texture = json!({ "index": self.textures[page], "texCoord": set });
        if self.binding == MapBinding::Occlusion {
            bound["occlusionTexture"] = texture;
        } else {
            let alpha = bound["pbrMetallicRoughness"]["baseColorFactor"][3].as_f64().unwrap_or(1.0);
            bound["pbrMetallicRoughness"] = json!({
                "baseColorFactor": [0, 0, 0, alpha], "metallicFactor": 0, "roughnessFactor": 1,
            });
            (bound["emissiveFactor"], bound["emissiveTexture"]) = (json!([1, 1, 1]), texture);
            if let Some(object) = bound.as_object_mut() {
                object.shift_remove("extensions");
            }
        }
        let number = self.new.push("materials", bound);
        self.materials.insert((material, page, set), number);
        number
    }
}
