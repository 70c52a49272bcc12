//! A glTF binary file in the making: the document, and the views of its binary chunk.

use std::collections::BTreeMap;
use std::io;

use glam::Vec3;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Stride, Target, View};
use gltf_json::extras::RawValue;
use gltf_json::image::MimeType;
use gltf_json::mesh::{Mode, Primitive, Semantic};
use gltf_json::scene::Node;
use gltf_json::texture::{MagFilter, MinFilter, Sampler, Texture, WrappingMode};
use gltf_json::validation::Checked::{self, Valid};
use gltf_json::{Accessor, Asset, Buffer, Image, Index, Material, Mesh, Root, Scene, Value};

use crate::error::Error;
use crate::io::Output;

/// Accessors of the attributes of a primitive.
pub(super) type Attributes = BTreeMap<Checked<Semantic>, Index<Accessor>>;

/// A file in the making.
pub(super) struct GlbFile {
    root: Root,
    /// In the order of the binary chunk. Images come last: numbers begin at multiples of four.
    views: Vec<FileView>,
}

/// A part of the binary chunk.
struct FileView {
    /// The attribute that it has of all primitives, `indices`, or `image`.
    name: &'static str,
    bytes: Vec<u8>,
    stride: Option<Stride>,
    target: Option<Target>,
}

impl GlbFile {
    /// A file with these notes.
    pub fn new(notes: &BTreeMap<&str, Value>) -> GlbFile {
        let asset = Asset {
            generator: Some(concat!("radiosity ", env!("CARGO_PKG_VERSION")).into()),
            extras: notes_of(notes),
            ..Default::default()
        };
        let mut root = Root { asset, ..Default::default() };
        root.extensions_used.push("KHR_materials_unlit".into());
        GlbFile { root, views: vec![] }
    }

    /// Adds `vectors`, two or three numbers each, to the view of the attribute `name`.
    pub fn add_vectors<const N: usize>(
        &mut self,
        name: &'static str,
        vectors: &[[f32; N]],
    ) -> Index<Accessor> {
        let accessor = self.vectors(name, vectors);
        self.root.push(accessor)
    }

    /// Adds positions, with their minimum and maximum.
    pub fn add_positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let vectors = || positions.iter().copied().map(Vec3::from);
        let numbers = |v: Vec3| Some(Value::from(v.to_array().to_vec()));
        let accessor = Accessor {
            min: numbers(vectors().fold(Vec3::INFINITY, Vec3::min)),
            max: numbers(vectors().fold(Vec3::NEG_INFINITY, Vec3::max)),
            ..self.vectors("POSITION", positions)
        };
        self.root.push(accessor)
    }

    fn vectors<const N: usize>(&mut self, name: &'static str, vectors: &[[f32; N]]) -> Accessor {
        let bytes = vectors.as_flattened().iter().flat_map(|x| x.to_le_bytes());
        let (view, offset) = self.append(name, Some(4 * N), Some(Target::ArrayBuffer), bytes);
        let type_ = if N == 2 { Type::Vec2 } else { Type::Vec3 };
        accessor(view, offset, vectors.len(), ComponentType::F32, type_)
    }

    /// Triangles of vertices with these attributes, the corners of each in `faces`.
    pub fn triangles(
        &mut self,
        attributes: Attributes,
        faces: &[[u32; 3]],
        material: Index<Material>,
    ) -> Primitive {
        let bytes = faces.as_flattened().iter().flat_map(|v| v.to_le_bytes());
        let target = Some(Target::ElementArrayBuffer);
        let (view, offset) = self.append("indices", None, target, bytes);
        let indices = accessor(view, offset, 3 * faces.len(), ComponentType::U32, Type::Scalar);
        Primitive {
            attributes,
            indices: Some(self.root.push(indices)),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: None,
            extensions: None,
            extras: None,
        }
    }

    /// Adds `bytes` to the view `name`; returns its number and the offset there.
    fn append(
        &mut self,
        name: &'static str,
        stride: Option<usize>,
        target: Option<Target>,
        bytes: impl Iterator<Item = u8>,
    ) -> (usize, usize) {
        let known = self.views.iter().position(|view| view.name == name);
        let number = known.unwrap_or_else(|| {
            let stride = stride.map(Stride);
            self.views.push(FileView { name, bytes: vec![], stride, target });
            self.views.len() - 1
        });
        let view = &mut self.views[number].bytes;
        let offset = view.len();
        view.extend(bytes);
        (number, offset)
    }

    /// Adds a PNG image, after all numbers.
    pub fn add_image(&mut self, png: Vec<u8>, name: Option<&str>) -> Index<Image> {
        let view = FileView { name: "image", bytes: png, stride: None, target: None };
        self.views.push(view);
        self.root.push(Image {
            buffer_view: Some(Index::new(self.views.len() as u32 - 1)),
            mime_type: Some(MimeType("image/png".into())),
            name: name.map(Into::into),
            uri: None,
            extensions: None,
            extras: None,
        })
    }

    /// Adds a texture that shows the image `source`, smoothly filtered; repeated unless `clamped`.
    pub fn add_texture(
        &mut self,
        source: Index<Image>,
        min_filter: MinFilter,
        clamped: bool,
    ) -> Index<Texture> {
        let wrap = Valid(if clamped { WrappingMode::ClampToEdge } else { WrappingMode::Repeat });
        let sampler = Some(self.root.push(Sampler {
            mag_filter: Some(Valid(MagFilter::Linear)),
            min_filter: Some(Valid(min_filter)),
            wrap_s: wrap,
            wrap_t: wrap,
            ..Default::default()
        }));
        self.root.push(Texture { sampler, source, name: None, extensions: None, extras: None })
    }

    pub fn add_material(&mut self, material: Material) -> Index<Material> {
        self.root.push(material)
    }

    /// Adds a node for a group, with a mesh of its `primitives`.
    pub fn add_group(&mut self, name: &str, primitives: Vec<Primitive>) -> Index<Node> {
        let name = Some(name.to_owned());
        let mesh = self.root.push(Mesh {
            primitives,
            name: name.clone(),
            weights: None,
            extensions: None,
            extras: None,
        });
        self.root.push(Node { mesh: Some(mesh), name, ..Default::default() })
    }

    /// Puts the views one after the other in the buffer; returns the bytes that they take.
    fn lay_out_views(&mut self) -> usize {
        let mut length = 0;
        for view in &self.views {
            self.root.push(View {
                buffer: Index::new(0),
                byte_length: view.bytes.len().into(),
                byte_offset: Some(length.into()),
                byte_stride: view.stride,
                name: None,
                target: view.target.map(Valid),
                extensions: None,
                extras: None,
            });
            length += view.bytes.len();
        }
        length
    }

    /// Writes the file: a header, a chunk of JSON and one of numbers. Its scene is the node `top`
    /// with the nodes of all `groups`.
    ///
    /// # Errors
    /// [`crate::ErrorKind::File`] when the file cannot be written, or would be larger than 4 GiB.
    pub fn write(
        mut self,
        out: Output<'_>,
        top: Node,
        groups: Vec<Index<Node>>,
    ) -> Result<(), Error> {
        let nodes = vec![self.root.push(Node { children: Some(groups), ..top })];
        let scene = Scene { nodes, name: None, extensions: None, extras: None };
        self.root.scene = Some(self.root.push(scene));
        let length = self.lay_out_views();
        let binary = length.next_multiple_of(4);
        self.root.push(Buffer {
            byte_length: binary.into(),
            name: None,
            uri: None,
            extensions: None,
            extras: None,
        });
        let mut json = self.root.to_vec().map_err(|e| out.cannot_write(e))?;
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + binary;
        let Ok(total) = u32::try_from(total) else {
            let found = format!("{total} bytes, where glTF binary has room for 4 GiB");
            return Err(out.cannot_write(io::Error::new(io::ErrorKind::FileTooLarge, found)));
        };
        out.write(|out| {
            let kind = u32::from_le_bytes;
            for word in [kind(*b"glTF"), 2, total, json.len() as u32, kind(*b"JSON")] {
                out.write_all(&word.to_le_bytes())?;
            }
            out.write_all(&json)?;
            for word in [binary as u32, kind(*b"BIN\0")] {
                out.write_all(&word.to_le_bytes())?;
            }
            self.views.iter().try_for_each(|view| out.write_all(&view.bytes))?;
            out.write_all(&[0; 4][..binary - length])
        })
    }
}

/// `count` items in a view, from an offset in bytes on.
fn accessor(
    view: usize,
    offset: usize,
    count: usize,
    component: ComponentType,
    type_: Type,
) -> Accessor {
    Accessor {
        buffer_view: Some(Index::new(view as u32)),
        byte_offset: Some(offset.into()),
        count: count.into(),
        component_type: Valid(GenericComponentType(component)),
        type_: Valid(type_),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

/// `extras` with these entries.
pub(super) fn notes_of(notes: &BTreeMap<&str, Value>) -> Option<Box<RawValue>> {
    let text = gltf_json::serialize::to_string(notes).ok()?;
    RawValue::from_string(text).ok()
}
