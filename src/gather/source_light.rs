//! The light that vertices gather: first what was shot, then what they had gathered themselves.

use super::RadiosityField;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// The light that vertices gather.
#[derive(Clone)]
pub(super) struct SourceLight<'a> {
    /// What they gather first.
    pub shot: RadiosityField<'a>,
    /// What they have gathered, once they are to gather that.
    gathered: Option<GatheredLight>,
}

/// Light on a mesh of its own: what a [`RadiosityField`] shows.
#[derive(Clone)]
struct GatheredLight {
    mesh: Mesh,
    corners: Vec<[u32; 3]>,
    reflected: Vec<Rgb>,
}

impl<'a> SourceLight<'a> {
    /// What was `shot`.
    pub fn new(shot: RadiosityField<'a>) -> SourceLight<'a> {
        SourceLight { shot, gathered: None }
    }

    /// Puts `light` in the place of what was gathered so far.
    pub fn replace_by(&mut self, light: RadiosityField) {
        let RadiosityField { mesh, corners, reflected } = light;
        self.gathered = Some(GatheredLight {
            mesh: mesh.clone(),
            corners: corners.to_vec(),
            reflected: reflected.to_vec(),
        });
    }

    /// The light as a [`Gather`](super::Gather) sees it.
    pub fn field(&self) -> RadiosityField<'_> {
        match &self.gathered {
            Some(GatheredLight { mesh, corners, reflected }) => {
                RadiosityField { mesh, corners, reflected }
            }
            None => self.shot,
        }
    }
}
