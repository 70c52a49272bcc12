//! A glTF file that is read, and written again with additions.

use std::path::Path;

use super::additions::Additions;
use super::container::{Buffers, Container};
use super::document::Document;
use super::fault::Fault;
use super::geometry::{Geometry, Group, MeshReader};
use super::materials;
use super::nodes::Nodes;
use crate::error::Error;
use crate::io::files::MAX_BYTES;
use crate::io::{Input, Output};

/// A glTF file that is to be written again.
pub(super) struct Source<'a, 'b> {
    pub document: &'a Document,
    pub reader: MeshReader<'a, 'b>,
    /// The groups of its scene, in their order.
    pub groups: &'a [Group],
    /// Whether each node is in the scene.
    pub is_placed: Vec<bool>,
    path: &'a Path,
}

impl Source<'_, '_> {
    /// What is wrong with the file, with its name.
    pub fn error(&self, fault: Fault) -> Error {
        fault.at(self.path.display().to_string())
    }
}

/// Writes the glTF file `source` again to `out`, with the additions that `add` makes for `scene`.
///
/// # Errors
/// [`crate::ErrorKind::File`] when a file cannot be read or written, [`crate::ErrorKind::Scene`]
/// for a source that is no glTF file; those of `add`.
pub(super) fn rewritten<T>(
    out: Output<'_>,
    source: &Input<'_>,
    scene: Option<&str>,
    add: impl FnOnce(Source<'_, '_>, &mut Additions) -> Result<T, Error>,
) -> Result<T, Error> {
    let path = source.path();
    let at_source = |fault: Fault| fault.at(path.display().to_string());
    let bytes = source.read(MAX_BYTES, "give the glTF file of the scene")?;
    let files = source.files();
    let container = Container::new(&bytes).map_err(at_source)?;
    let document = &container.document().map_err(at_source)?;
    let buffers = Buffers::new(&container, document, &files);
    let nodes = Nodes::new(document, scene).map_err(at_source)?;
    let set_of = |material: Option<usize>| materials::coordinate_set(document, material);
    let geometry = Geometry::new(document, &buffers, &nodes, &set_of);
    let geometry = geometry.map_err(|(node, fault)| fault.at(node).inside(path))?;
    let mut additions = Additions::new(&container, document).map_err(at_source)?;
    let reader = MeshReader::new(document, &buffers, &nodes, &set_of);
    let (groups, is_placed) = (&geometry.places[..], nodes.is_placed());
    let all = Source { document, reader, groups, is_placed, path };
    let added = add(all, &mut additions)?;
    additions.write(out, &container, document)?;
    Ok(added)
}
