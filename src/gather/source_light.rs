//! The light that vertices gather: first what was shot, then what they had gathered themselves.

use std::sync::Arc;

use super::RadiosityField;
use crate::mesh::Mesh;
use crate::scene::Rgb;

/// The light that vertices gather.
#[derive(Clone)]
pub(super) struct SourceLight {
    /// What they gather first.
    shot: Arc<VertexLight>,
    /// What they have gathered, once they are to gather that.
    gathered: Option<VertexLight>,
}

/// Light on a mesh of its own: what a [`RadiosityField`] shows.
#[derive(Clone)]
struct VertexLight {
    mesh: Mesh,
    corners: Vec<[u32; 3]>,
    reflected: Vec<Rgb>,
}

impl VertexLight {
    fn of(RadiosityField { mesh, corners, reflected }: RadiosityField) -> VertexLight {
        VertexLight { mesh: mesh.clone(), corners: corners.to_vec(), reflected: reflected.to_vec() }
    }

    fn field(&self) -> RadiosityField<'_> {
        let VertexLight { mesh, corners, reflected } = self;
        RadiosityField { mesh, corners, reflected }
    }
}

impl SourceLight {
    /// What was `shot`.
    pub fn new(shot: RadiosityField) -> SourceLight {
        SourceLight { shot: Arc::new(VertexLight::of(shot)), gathered: None }
    }

    /// Puts `light` in the place of what was gathered so far.
    pub fn replace_by(&mut self, light: RadiosityField) {
        self.gathered = Some(VertexLight::of(light));
    }

    /// What was shot.
    pub fn shot(&self) -> RadiosityField<'_> {
        self.shot.field()
    }

    /// The light as a [`Gather`](super::Gather) sees it.
    pub fn field(&self) -> RadiosityField<'_> {
        self.gathered.as_ref().unwrap_or(&self.shot).field()
    }
}
