//! What is added to a glTF document: items of its lists, and numbers behind those of its buffers.

use serde_json::{Value, json};

use super::container::Container;
use super::document::Document;
use super::fault::Fault;
use crate::error::Error;
use crate::io::Output;

/// Targets of buffer views: attributes of vertices, and indices of them.
pub(super) const ARRAY_BUFFER: u32 = 34962;
#[cfg(feature = "light-map")]
pub(super) const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A document, and new numbers for it.
pub(super) struct Additions {
    /// All of the document, as it was and with what was added.
    pub source: Value,
    pub json: Value,
    /// The buffer of new numbers, and how many bytes it has before them.
    buffer: (usize, usize),
    /// New numbers.
    binary: Vec<u8>,
}

impl Additions {
    pub fn new(container: &Container<'_>, document: &Document) -> Result<Additions, Fault> {
        let buffer = container.buffer_of_new(document);
        let source = container.json()?;
        Ok(Additions { json: source.clone(), source, buffer, binary: vec![] })
    }

    /// Adds an item to a list of the document: its number.
    pub fn push(&mut self, list: &str, item: Value) -> usize {
        if !self.json[list].is_array() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().expect("it was made one");
        list.push(item);
        list.len() - 1
    }

    /// Adds a view of new bytes: its number.
    pub fn view(&mut self, bytes: &[u8], stride: Option<usize>, target: Option<u32>) -> usize {
        // Numbers of any type begin at a multiple of four.
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let (buffer, before) = self.buffer;
        let mut view = json!({
            "buffer": buffer, "byteOffset": before + self.binary.len(), "byteLength": bytes.len(),
        });
        if let Some(stride) = stride {
            view["byteStride"] = json!(stride);
        }
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.binary.extend(bytes);
        self.push("bufferViews", view)
    }

    /// Writes the file of `container` and its `document` with what was added.
    ///
    /// # Errors
    /// [`crate::ErrorKind::File`] when the file cannot be written.
    pub fn write(
        self,
        out: Output<'_>,
        container: &Container<'_>,
        document: &Document,
    ) -> Result<(), Error> {
        let file = container.with(self.json, &self.binary, document);
        let file = file.map_err(|e| out.cannot_write(e))?;
        out.write_bytes(&file)
    }
}

/// Adds to the extras of an object what is said `about` its light, unless these are no object.
pub(super) fn add_extras(object: &mut Value, about: Value) {
    let extras =
        object.as_object_mut().map(|object| object.entry("extras").or_insert_with(|| json!({})));
    if let Some(Value::Object(extras)) = extras {
        extras.insert("radiosity".into(), about);
    }
}

/// Whether `mesh` is also of nodes that are not written anew: instances, and those that are not in
/// the scene, as `is_placed` says of each.
pub(super) fn has_other_users(document: &Document, is_placed: &[bool], mesh: usize) -> bool {
    let users = document.nodes.iter().zip(is_placed).filter(|(node, _)| node.mesh == Some(mesh));
    users.into_iter().any(|(node, is_placed)| !is_placed || node.extensions.instances.is_some())
}
