//! The JSON of a glTF file: nodes, meshes and materials by name, and the offsets of their data.

use std::collections::BTreeMap;

use gltf_json::accessor::Type;
use gltf_json::buffer::Target;
use gltf_json::material::{AlphaCutoff, AlphaMode, PbrBaseColorFactor, PbrMetallicRoughness};
use gltf_json::mesh::Semantic;
use gltf_json::scene::Node;
use gltf_json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Accessor, Index, Material, Root, Value};

use super::parts::{self, accessor};
use super::primitives::Primitive;
use super::{Attribute, INDEX_BYTES, Model};

impl Attribute {
    fn semantic(self) -> Semantic {
        match self {
            Attribute::Position => Semantic::Positions,
            Attribute::Normal => Semantic::Normals,
            Attribute::Colour => Semantic::Colors(0),
            // Written with a leading underscore, which glTF requires for custom names.
            Attribute::Radiosity => Semantic::Extras("RADIOSITY".into()),
            Attribute::Irradiance => Semantic::Extras("IRRADIANCE".into()),
            Attribute::TextureCoordinates => Semantic::TexCoords(0),
        }
    }

    fn type_(self) -> Type {
        if self == Attribute::TextureCoordinates { Type::Vec2 } else { Type::Vec3 }
    }
}

impl Model<'_> {
    pub fn document(&self) -> Root {
        let notes = BTreeMap::from([
            ("axes", Value::from("those of the scene's file")),
            ("unit", Value::from("that of the scene's file")),
            ("_RADIOSITY", Value::from("W/m2 per channel, linear BT.709")),
            ("COLOR_0", Value::from("_RADIOSITY times exposure, highlights rolled off")),
            (
                "images",
                Value::from(
                    "textures in the median light of a material; COLOR_0 is relative to that",
                ),
            ),
            ("exposure", Value::from(self.tone.exposure())),
        ]);
        let mut root = parts::document(self.binary_length(), &notes);
        self.add_views(&mut root);
        self.add_images(&mut root);
        let groups = self.add_groups(&mut root);
        parts::add_scene(&mut root, groups, self.origin);
        root
    }

    /// A view of the binary chunk for each attribute, and one for the indices.
    fn add_views(&self, root: &mut Root) {
        let mut offset = 0;
        let mut add = |length: u64, stride: Option<u64>, target: Option<Target>| {
            parts::add_view(root, &mut offset, length, stride, target);
        };
        for attribute in self.attributes() {
            let (count, size) = (self.vertex_count(attribute), attribute.size());
            add(count * size, Some(size), Some(Target::ArrayBuffer));
        }
        add(3 * self.face_count() * INDEX_BYTES, None, Some(Target::ElementArrayBuffer));
        for image in self.images.iter() {
            add(image.png.len() as u64, None, None);
        }
    }

    /// An image for each texture shown, in the views after those of the indices.
    fn add_images(&self, root: &mut Root) {
        let first = self.attributes().count() + 1;
        for (k, _) in self.images.iter().enumerate() {
            parts::add_image(root, (first + k) as u32, None);
        }
    }

    /// A node and a mesh for each group that has faces.
    fn add_groups(&self, root: &mut Root) -> Vec<Index<Node>> {
        let mut materials = BTreeMap::new();
        let mut written = Written::default();
        let mut nodes = vec![];
        for of_group in self.primitives.chunk_by(|a, b| a.group == b.group) {
            let mut primitives = vec![];
            for primitive in of_group {
                let material = *materials
                    .entry((primitive.material, primitive.shown.is_some()))
                    .or_insert_with(|| {
                        let material = self.material(root, primitive);
                        root.push(material)
                    });
                primitives.push(self.primitive(root, primitive, material, &written));
                written.add(primitive);
            }
            let name = &self.light.mesh.scene().groups()[of_group[0].group as usize];
            nodes.push(parts::add_group(root, name, primitives));
        }
        nodes
    }

    /// A primitive that follows those already `written`.
    fn primitive(
        &self,
        root: &mut Root,
        primitive: &Primitive<'_>,
        material: Index<Material>,
        written: &Written,
    ) -> gltf_json::mesh::Primitive {
        let mut attributes = BTreeMap::new();
        let attributes_of_all = self.attributes().enumerate();
        for (view, attribute) in attributes_of_all.filter(|(_, a)| a.is_of(primitive)) {
            let offset = written.vertices_with(attribute) * attribute.size();
            let mut accessor = Accessor {
                type_: Valid(attribute.type_()),
                ..accessor(view, offset, primitive.vertices.len())
            };
            if attribute == Attribute::Position {
                let vertices = 0..primitive.vertices.len();
                let positions = vertices.map(|k| self.value(attribute, primitive, k));
                accessor = parts::with_bounds(accessor, positions);
            }
            attributes.insert(Valid(attribute.semantic()), root.push(accessor));
        }
        let indices = (self.attributes().count(), written.faces, primitive.faces.len());
        parts::triangles(root, attributes, indices, material)
    }

    /// Unlit: the colour is in the vertices, and in the image if there is one.
    fn material(&self, root: &mut Root, primitive: &Primitive<'_>) -> Material {
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
            base_color_texture: self.texture(root, primitive),
            ..Default::default()
        };
        Material {
            alpha_mode: Valid(alpha_mode),
            alpha_cutoff: (alpha_mode == AlphaMode::Mask).then_some(AlphaCutoff(0.5)),
            ..parts::unlit(material, colour)
        }
    }

    /// The image of a primitive, repeated or not, smoothly filtered; none without a texture.
    fn texture(&self, root: &mut Root, primitive: &Primitive<'_>) -> Option<Info> {
        let clamped = primitive.shown?.frame()?.clamped;
        let wrap = Valid(if clamped { WrappingMode::ClampToEdge } else { WrappingMode::Repeat });
        let sampler = Sampler {
            mag_filter: Some(Valid(MagFilter::Linear)),
            min_filter: Some(Valid(MinFilter::LinearMipmapLinear)),
            wrap_s: wrap,
            wrap_t: wrap,
            ..Default::default()
        };
        let source = Index::new(self.images.number(primitive.material)? as u32);
        let texture = parts::add_texture(root, source, sampler);
        Some(Info { index: texture, tex_coord: 0, extensions: None, extras: None })
    }
}

/// Counts over the primitives before one.
#[derive(Default)]
struct Written {
    vertices: u64,
    /// Those of them with texture coordinates.
    textured: u64,
    faces: u64,
}

impl Written {
    fn add(&mut self, primitive: &Primitive<'_>) {
        self.vertices += primitive.vertices.len() as u64;
        self.textured += primitive.places.len() as u64;
        self.faces += primitive.faces.len() as u64;
    }

    fn vertices_with(&self, attribute: Attribute) -> u64 {
        match attribute {
            Attribute::Irradiance | Attribute::TextureCoordinates => self.textured,
            _ => self.vertices,
        }
    }
}
