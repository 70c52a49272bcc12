//! Parts of a glTF document that all files of this crate share.

use std::collections::BTreeMap;

use glam::Vec3;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Stride, Target, View};
use gltf_json::extras::RawValue;
use gltf_json::image::MimeType;
use gltf_json::material::{PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::Node;
use gltf_json::texture::{Sampler, Texture};
use gltf_json::validation::Checked::{self, Valid};
use gltf_json::{Accessor, Asset, Buffer, Image, Index, Material, Mesh, Root, Scene, Value};

use super::INDEX_BYTES;
use crate::scene::{self, Rgb};

/// Accessors of the attributes of a primitive.
pub(super) type Attributes = BTreeMap<Checked<Semantic>, Index<Accessor>>;

/// A document with one buffer of `binary_length` bytes, and with these notes.
pub(super) fn document(binary_length: u64, notes: &BTreeMap<&str, Value>) -> Root {
    let asset = Asset {
        generator: Some(concat!("radiosity ", env!("CARGO_PKG_VERSION")).into()),
        extras: notes_of(notes),
        ..Default::default()
    };
    let mut root = Root { asset, ..Default::default() };
    root.extensions_used.push("KHR_materials_unlit".into());
    root.push(Buffer {
        byte_length: binary_length.into(),
        name: None,
        uri: None,
        extensions: None,
        extras: None,
    });
    root
}

/// Adds a view of the buffer, `length` bytes from `offset` on, and moves `offset` to its end.
pub(super) fn add_view(
    root: &mut Root,
    offset: &mut u64,
    length: u64,
    stride: Option<u64>,
    target: Option<Target>,
) {
    root.push(View {
        buffer: Index::new(0),
        byte_length: length.into(),
        byte_offset: Some((*offset).into()),
        byte_stride: stride.map(|bytes| Stride(bytes as usize)),
        name: None,
        target: target.map(Valid),
        extensions: None,
        extras: None,
    });
    *offset += length;
}

/// Adds the PNG image in a view.
pub(super) fn add_image(root: &mut Root, view: u32, name: Option<&str>) -> Index<Image> {
    root.push(Image {
        buffer_view: Some(Index::new(view)),
        mime_type: Some(MimeType("image/png".into())),
        name: name.map(Into::into),
        uri: None,
        extensions: None,
        extras: None,
    })
}

/// Adds a texture that shows the image `source`.
pub(super) fn add_texture(
    root: &mut Root,
    source: Index<Image>,
    sampler: Sampler,
) -> Index<Texture> {
    let sampler = Some(root.push(sampler));
    root.push(Texture { sampler, source, name: None, extensions: None, extras: None })
}

/// Triangles given by `faces` index triples in a view, after the first `faces_before`.
pub(super) fn triangles(
    root: &mut Root,
    attributes: Attributes,
    (index_view, faces_before, faces): (usize, u64, usize),
    material: Index<Material>,
) -> Primitive {
    let indices = Accessor {
        component_type: Valid(GenericComponentType(ComponentType::U32)),
        type_: Valid(Type::Scalar),
        ..accessor(index_view, 3 * faces_before * INDEX_BYTES, 3 * faces)
    };
    Primitive {
        attributes,
        indices: Some(root.push(indices)),
        material: Some(material),
        mode: Valid(Mode::Triangles),
        targets: None,
        extensions: None,
        extras: None,
    }
}

/// Adds a node for a group, with a mesh of its `primitives`.
pub(super) fn add_group(root: &mut Root, name: &str, primitives: Vec<Primitive>) -> Index<Node> {
    let name = Some(name.to_owned());
    let mesh = root.push(Mesh {
        primitives,
        name: name.clone(),
        weights: None,
        extensions: None,
        extras: None,
    });
    root.push(Node { mesh: Some(mesh), name, ..Default::default() })
}

/// Adds the scene: a node with the nodes of all `groups`, whose positions are relative to `origin`.
pub(super) fn add_scene(root: &mut Root, groups: Vec<Index<Node>>, origin: Vec3) {
    let translation = (origin != Vec3::ZERO).then(|| origin.to_array());
    let name = Some("scene".into());
    let top = Node { name, children: Some(groups), translation, ..Default::default() };
    let nodes = vec![root.push(top)];
    let scene = Scene { nodes, name: None, extensions: None, extras: None };
    root.scene = Some(root.push(scene));
}

/// A material of the scene with its light as its unlit `colour`.
pub(super) fn unlit(material: &scene::Material, colour: PbrMetallicRoughness) -> Material {
    let channels = |c: Rgb| Value::from(c.to_array().to_vec());
    let notes = BTreeMap::from([
        ("reflectance", channels(material.reflectance)),
        ("exitance", channels(material.exitance)),
    ]);
    let unlit = gltf_json::extensions::material::Unlit {};
    Material {
        name: Some(material.name.clone()),
        pbr_metallic_roughness: PbrMetallicRoughness {
            metallic_factor: StrengthFactor(0.0),
            ..colour
        },
        extensions: Some(gltf_json::extensions::material::Material { unlit: Some(unlit) }),
        extras: notes_of(&notes),
        ..Default::default()
    }
}

/// Float vectors in a view, from an offset in bytes on.
pub(super) fn accessor(view: usize, offset: u64, count: usize) -> Accessor {
    Accessor {
        buffer_view: Some(Index::new(view as u32)),
        byte_offset: Some(offset.into()),
        count: count.into(),
        component_type: Valid(GenericComponentType(ComponentType::F32)),
        type_: Valid(Type::Vec3),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

/// The same with the minimum and the maximum of its `positions`.
pub(super) fn with_bounds(
    accessor: Accessor,
    positions: impl Iterator<Item = Vec3> + Clone,
) -> Accessor {
    let numbers = |v: Vec3| Some(Value::from(v.to_array().to_vec()));
    Accessor {
        min: numbers(positions.clone().fold(Vec3::INFINITY, Vec3::min)),
        max: numbers(positions.fold(Vec3::NEG_INFINITY, Vec3::max)),
        ..accessor
    }
}

/// `extras` with these entries.
fn notes_of(notes: &BTreeMap<&str, Value>) -> Option<Box<RawValue>> {
    let text = gltf_json::serialize::to_string(notes).ok()?;
    RawValue::from_string(text).ok()
}
