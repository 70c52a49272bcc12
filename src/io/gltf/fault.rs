//! What is wrong in a glTF file, before its place is known.

use crate::error::{Error, ErrorKind};

/// What is wrong in a file, and the correction; its place is added by those who know it.
#[derive(Clone, Debug)]
pub(super) struct Fault {
    pub found: String,
    pub remedy: String,
}

impl Fault {
    pub fn new(found: impl Into<String>, remedy: impl Into<String>) -> Fault {
        Fault { found: found.into(), remedy: remedy.into() }
    }

    /// An index that is not below the number of these items.
    pub fn index(what: &str, index: usize, count: usize) -> Fault {
        Fault::new(format!("{what} {index}, of {count}"), format!("must be below {count}"))
    }

    /// Data compressed by an extension that is not read.
    pub fn compressed(extension: &str) -> Fault {
        let found = format!("a mesh compressed by {extension}, which is not read");
        Fault::new(found, "uncompress it: npx @gltf-transform/cli copy IN.glb OUT.glb")
    }

    /// The same in this part of the file.
    pub fn inside(mut self, part: &str) -> Fault {
        self.found = format!("{part}: {}", self.found);
        self
    }

    /// The error at this place.
    pub fn at(self, place: impl Into<String>) -> Error {
        Error::new(ErrorKind::Scene, place, self.found, self.remedy)
    }
}
