//! glTF files that are made up: a document, and the numbers of its buffer.
#![allow(dead_code, reason = "each test program uses a part of it")]

use serde_json::{Value, json};

/// A glTF 2.0 file in the making.
pub struct Gltf {
    pub json: Value,
    pub binary: Vec<u8>,
}

/// A square of unit sides in the plane z = 0, facing +z: corners, and the corners of its triangles.
pub const SQUARE: [[f32; 3]; 4] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
pub const HALVES: [u16; 6] = [0, 1, 2, 0, 2, 3];

impl Gltf {
    /// A document whose scene has these nodes.
    pub fn new(nodes: Value) -> Gltf {
        let roots: Vec<usize> = (0..nodes.as_array().unwrap().len()).collect();
        let json = json!({
            "asset": { "version": "2.0" },
            "scenes": [{ "nodes": roots }],
            "nodes": nodes,
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [],
        });
        Gltf { json, binary: vec![] }
    }

    /// One square of the only material, which has these properties.
    pub fn of_material(material: Value) -> Gltf {
        let mut gltf = Gltf::new(json!([{ "mesh": 0 }]));
        gltf.add_square(0);
        gltf.json["materials"] = json!([material]);
        gltf
    }

    fn push(&mut self, list: &str, item: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(item);
        list.len() - 1
    }

    /// Adds bytes as a buffer view: its number.
    pub fn add_view(&mut self, bytes: &[u8]) -> usize {
        let (offset, length) = (self.binary.len(), bytes.len());
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": length });
        self.push("bufferViews", view)
    }

    /// Adds an accessor of `count` items, with `more` properties: its number.
    pub fn add(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.add_view(bytes);
        self.push(
            "accessors",
            json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }),
        )
    }

    pub fn add_floats<const N: usize>(&mut self, items: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = items.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
        let kind = ["", "SCALAR", "VEC2", "VEC3", "VEC4"].get(N).copied().unwrap_or("MAT4");
        self.add(&bytes, 5126, kind, items.len())
    }

    pub fn add_indices(&mut self, indices: &[u16]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|k| k.to_le_bytes()).collect();
        self.add(&bytes, 5123, "SCALAR", indices.len())
    }

    /// Adds a mesh of one primitive: its number.
    pub fn add_mesh(&mut self, primitive: Value) -> usize {
        self.push("meshes", json!({ "primitives": [primitive] }))
    }

    /// Adds [`SQUARE`] of a material, with texture coordinates (x, 1 − y): its number.
    pub fn add_square(&mut self, material: usize) -> usize {
        let (positions, indices) = (self.add_floats(&SQUARE), self.add_indices(&HALVES));
        let places = self.add_floats(&SQUARE.map(|[x, y, _]| [x, 1.0 - y]));
        let attributes = json!({ "POSITION": positions, "TEXCOORD_0": places });
        let primitive = json!({ "attributes": attributes, "indices": indices });
        self.add_mesh(merged(primitive, json!({ "material": material })))
    }

    /// The binary file.
    pub fn glb(&self) -> Vec<u8> {
        let mut document = self.json.clone();
        if document.get("buffers").is_none() {
            document["buffers"] = json!([{ "byteLength": self.binary.len() }]);
        }
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + json.len() + 8 + self.binary.len();
        let mut bytes = b"glTF".to_vec();
        for number in [2, total, json.len()] {
            bytes.extend((number as u32).to_le_bytes());
        }
        bytes.extend(b"JSON");
        bytes.extend(json);
        bytes.extend((self.binary.len() as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(&self.binary);
        bytes
    }
}

/// The properties of both objects.
pub fn merged(mut object: Value, more: Value) -> Value {
    object.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    object
}
