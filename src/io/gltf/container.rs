//! The container of a glTF scene: a binary file of chunks or a JSON text, and its buffers.
//!
//! ```text
//!   "glTF" version length │ length "JSON" document │ length "BIN" buffer 0 │ others, skipped
//! ```
//!
//! Buffers are read when something of them is needed: from that chunk, a data URI or a file.

use std::borrow::Cow;
use std::cell::{Cell, OnceCell};
use std::io;

use base64::Engine as _;
use data_url::DataUrl;
use percent_encoding::percent_decode_str;
use serde::Deserialize;
use serde_json::{Value, json};

use super::super::files::{FileSource, MAX_BYTES};
use super::document::{Buffer, Document, Image};
use super::fault::Fault;
use crate::error::{quoted, shortened};

/// First bytes of a binary file.
const MAGIC: &[u8] = b"glTF";

/// Chunks of a binary file.
const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");

/// The JSON text of a glTF scene, and the buffer in the same file.
pub(super) struct Container<'a> {
    json: &'a [u8],
    binary: Option<&'a [u8]>,
    /// Kind and content of all chunks of a binary file; none of a JSON file.
    chunks: Vec<(u32, &'a [u8])>,
}

impl<'a> Container<'a> {
    pub fn new(bytes: &'a [u8]) -> Result<Container<'a>, Fault> {
        if !bytes.starts_with(MAGIC) {
            let json = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            return Ok(Container { json, binary: None, chunks: vec![] });
        }
        let word = |at: usize| -> Option<u32> {
            let bytes = bytes.get(at..at.checked_add(4)?)?;
            Some(u32::from_le_bytes(bytes.try_into().ok()?))
        };
        let broken_off = |needed: u64| {
            let found = format!("{} bytes, where its header announces {needed}", bytes.len());
            Fault::new(found, "give the whole file")
        };
        let version = word(4).ok_or_else(|| broken_off(12))?;
        if version != 2 {
            return Err(wrong_version(&version.to_string()));
        }
        let length = word(8).ok_or_else(|| broken_off(12))?;
        if bytes.len() < length as usize {
            return Err(broken_off(length.into()));
        }
        let (mut chunks, mut at) = (vec![], 12);
        while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
            let end = (at + 8).saturating_add(length as usize);
            let chunk = bytes.get(at + 8..end).ok_or_else(|| broken_off(end as u64))?;
            chunks.push((kind, chunk));
            at = end.next_multiple_of(4);
        }
        let first = |of: u32| chunks.iter().find(|(kind, _)| *kind == of).map(|(_, chunk)| *chunk);
        let json = first(JSON);
        let json =
            json.ok_or_else(|| Fault::new("no JSON chunk", "give a glTF 2.0 binary file"))?;
        Ok(Container { json, binary: first(BINARY), chunks })
    }

    /// The JSON text without what some programs pad it with: zeros.
    fn text(&self) -> &'a [u8] {
        let end = self.json.iter().rposition(|&byte| byte != 0).map_or(0, |last| last + 1);
        &self.json[..end]
    }

    /// All of the document.
    pub fn json(&self) -> Result<Value, Fault> {
        serde_json::from_slice(self.text()).map_err(wrong)
    }

    /// The buffer that new numbers of `document` are in, and how many bytes it has before them:
    /// that of the binary file, or one of its own.
    pub fn buffer_of_new(&self, document: &Document) -> (usize, usize) {
        match (self.binary, document.buffers.first()) {
            (Some(binary), Some(Buffer { uri: None, .. })) => (0, binary.len().next_multiple_of(4)),
            _ => (document.buffers.len(), 0),
        }
    }

    /// The same kind of file with this `json`, and `new` numbers in that buffer.
    pub fn with(&self, mut json: Value, new: &[u8], document: &Document) -> io::Result<Vec<u8>> {
        let (buffer, before) = self.buffer_of_new(document);
        let mut binary = vec![];
        if before > 0 || buffer == 0 && self.binary.is_some() {
            binary.extend(self.binary.unwrap_or_default());
            binary.resize(before, 0);
            binary.extend(new);
            json["buffers"][0]["byteLength"] = json!(binary.len());
        } else if !new.is_empty() {
            let data = base64::engine::general_purpose::STANDARD.encode(new);
            let uri = format!("data:application/octet-stream;base64,{data}");
            let added = json!({ "byteLength": new.len(), "uri": uri });
            match json["buffers"].as_array_mut() {
                Some(buffers) => buffers.push(added),
                None => json["buffers"] = json!([added]),
            }
        }
        if self.chunks.is_empty() {
            return Ok(format!("{json:#}\n").into_bytes());
        }
        let mut bytes = [MAGIC, &2u32.to_le_bytes(), &[0; 4]].concat();
        for &(kind, chunk) in &self.chunks {
            let (text, fill) = (json.to_string(), if kind == JSON { b' ' } else { 0 });
            let content = match kind {
                JSON => text.as_bytes(),
                BINARY if !binary.is_empty() => &binary,
                _ => chunk,
            };
            let padded = content.len().next_multiple_of(4);
            let length = u32::try_from(padded).map_err(|_| too_large(padded))?;
            bytes.extend(length.to_le_bytes());
            bytes.extend(kind.to_le_bytes());
            bytes.extend(content);
            bytes.resize(bytes.len().next_multiple_of(4), fill);
        }
        let length = u32::try_from(bytes.len()).map_err(|_| too_large(bytes.len()))?;
        bytes[8..12].copy_from_slice(&length.to_le_bytes());
        Ok(bytes)
    }

    /// The document, if it is of version 2.
    pub fn document(&self) -> Result<Document, Fault> {
        #[derive(Default, Deserialize)]
        #[serde(default)]
        struct Version {
            asset: super::document::Asset,
        }
        let json = self.text();
        let version = serde_json::from_slice::<Version>(json).map_err(wrong)?.asset.version;
        // Some programs write the number in place of the text.
        let version = version.as_str().map_or_else(|| version.to_string(), String::from);
        if !version.starts_with('2') {
            return Err(wrong_version(&version));
        }
        serde_json::from_slice(json).map_err(wrong)
    }
}

fn wrong(e: serde_json::Error) -> Fault {
    let e: String = e.to_string().chars().filter(|c| !c.is_control()).take(300).collect();
    Fault::new(format!("its JSON is not that of a scene: {e}"), "give a glTF 2.0 file")
}

fn too_large(bytes: usize) -> io::Error {
    let found = format!("{bytes} bytes, where glTF binary has room for 4 GiB");
    io::Error::new(io::ErrorKind::FileTooLarge, found)
}

fn wrong_version(version: &str) -> Fault {
    let found = match version {
        "null" => "no version of glTF".into(),
        version => format!("glTF of version {}", shortened(version).escape_debug()),
    };
    Fault::new(found, "give version 2.0: npx gltf-pipeline -i OLD.gltf -o NEW.gltf converts 1.0")
}

/// The buffers of a document, each read once.
pub(super) struct Buffers<'a> {
    document: &'a Document,
    binary: Option<&'a [u8]>,
    files: &'a FileSource<'a>,
    read: Vec<OnceCell<Result<Cow<'a, [u8]>, Fault>>>,
    bytes_left: Cell<u64>,
}

/// A part of a buffer.
#[derive(Clone, Copy)]
pub(super) struct View<'a> {
    pub bytes: &'a [u8],
    pub stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    pub fn new(
        container: &Container<'a>,
        document: &'a Document,
        files: &'a FileSource<'a>,
    ) -> Buffers<'a> {
        let read = document.buffers.iter().map(|_| OnceCell::new()).collect();
        let bytes_left = Cell::new(MAX_BYTES);
        Buffers { document, binary: container.binary, files, read, bytes_left }
    }

    fn buffer(&self, k: usize) -> Result<&[u8], Fault> {
        let cell = self.read.get(k).ok_or_else(|| Fault::index("buffer", k, self.read.len()))?;
        let buffer = cell.get_or_init(|| match (&self.document.buffers[k].uri, self.binary) {
            (Some(uri), _) => self.resource(uri).map(Cow::Owned),
            (None, Some(binary)) if k == 0 => Ok(Cow::Borrowed(binary)),
            (None, _) => Err(Fault::new(format!("buffer {k} has no data"), "give the whole file")),
        });
        buffer.as_deref().map_err(Clone::clone)
    }

    /// What a URI of the document stands for: the data in it, or those of a file beside the scene.
    fn resource(&self, uri: &str) -> Result<Vec<u8>, Fault> {
        let limit = self.bytes_left.get();
        let bytes = if uri.starts_with("data:") {
            let url = DataUrl::process(uri).map_err(|e| format!("{e:?}"));
            let bytes = url.and_then(|url| url.decode_to_vec().map_err(|e| format!("{e:?}")));
            let (bytes, _) =
                bytes.map_err(|e| Fault::new(format!("a data URI: {e}"), "give whole data"))?;
            bytes
        } else {
            let name = self.file(uri).ok_or_else(|| {
                let found = format!("the file {} is not there", quoted(&[uri]));
                Fault::new(found, "put it into the folder of the scene, or give one .glb file")
            })?;
            let cannot = |e| {
                Fault::new(format!("{} cannot be read: {e}", quoted(&[&name])), "give the file")
            };
            self.files.read(&name, limit).map_err(cannot)?
        };
        let left = limit.checked_sub(bytes.len() as u64);
        let found = || format!("buffers of more than {MAX_BYTES} bytes together");
        self.bytes_left.set(left.ok_or_else(|| Fault::new(found(), "give a smaller scene"))?);
        Ok(bytes)
    }

    /// The file that a URI names: decoded, else to the letter.
    fn file(&self, uri: &str) -> Option<String> {
        let decoded = percent_decode_str(uri).decode_utf8().ok();
        decoded.and_then(|name| self.files.find(&name)).or_else(|| self.files.find(uri))
    }

    /// The view `k` of a buffer.
    pub fn view(&self, k: usize) -> Result<View<'_>, Fault> {
        let views = &self.document.buffer_views;
        let view = views.get(k).ok_or_else(|| Fault::index("buffer view", k, views.len()))?;
        let packed = view.extensions.keys().find(|name| name.ends_with("_meshopt_compression"));
        let buffer = self.buffer(view.buffer).map_err(|fault| match packed {
            Some(extension) => Fault::compressed(extension),
            None => fault,
        })?;
        let end = view.byte_offset.checked_add(view.byte_length);
        let bytes = end.and_then(|end| buffer.get(view.byte_offset..end)).ok_or_else(|| {
            let found = format!(
                "buffer view {k} has {} bytes from {} on, and its buffer {}",
                view.byte_length,
                view.byte_offset,
                buffer.len()
            );
            Fault::new(found, "give the whole buffer")
        })?;
        Ok(View { bytes, stride: view.byte_stride.filter(|&stride| stride > 0) })
    }

    /// The bytes of an image, and a name for messages.
    pub fn image(&self, image: &Image) -> Result<Vec<u8>, Fault> {
        match (&image.uri, image.buffer_view) {
            (Some(uri), _) => self.resource(uri),
            (None, Some(view)) => self.view(view).map(|view| view.bytes.to_vec()),
            (None, None) => Err(Fault::new("an image without data", "give its file")),
        }
    }
}
