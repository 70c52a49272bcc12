//! A mesh refined where the light asks for it, with the radiosity gathered at its vertices.
//!
//! The result of a gather, and also its input: [`GatheredMesh::from_elements`] turns a solution per
//! element into one, and [`GatheredMesh::radiosity_field`] is what the next gather sees.

use super::RadiosityField;
use crate::error::{Error, ErrorKind};
use crate::mesh::Mesh;
use crate::progress::StopReason;
use crate::scene::Rgb;
use crate::vertex::VertexMesh;

/// A mesh refined where the light asks for it, with the radiosity gathered at its vertices.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct GatheredMesh {
    /// The mesh that gathering started on, with the elements that were split.
    pub mesh: Mesh,
    /// Radiosity at the vertices, to be shown or exported.
    pub surface: VertexMesh,
    /// Per element, the indices of its three corners in `reflected`.
    pub corners: Vec<[u32; 3]>,
    /// Reflected radiosity B − E at the vertices, W/m² per channel, as a source of light for
    /// others, with the reflectance of the material: see [`RadiosityField`]. It differs from
    /// `surface` by what makes the mean over each element right: that of the quadratic interpolant,
    /// which a linear one through the exact vertex values does not have.
    pub reflected: Vec<Rgb>,
    /// Points at which light was gathered, repeated attempts included.
    pub gather_count: u64,
    /// Change of the reflected radiosity at the vertices by the last gather pass: its root mean
    /// square over that of the radiosity, both weighted by area. 0 where nothing gathered.
    pub relative_change: f64,
    /// Why refinement ended: [`StopReason::Elements`] where more elements were to be split than
    /// there may be.
    pub stop: StopReason,
}

impl GatheredMesh {
    /// The radiosity of the elements of `mesh`, averaged to its vertices as [`VertexMesh::new`]
    /// does: one value an element, W/m² per channel. Nothing is gathered.
    ///
    /// # Errors
    /// [`ErrorKind::Setting`] when `radiosity` has not one value an element.
    pub fn from_elements(mesh: &Mesh, radiosity: &[Rgb]) -> Result<GatheredMesh, Error> {
        check_count(mesh, radiosity)?;
        let (surface, corners, reflected) = VertexMesh::with_corners(mesh, radiosity);
        Ok(GatheredMesh {
            mesh: mesh.clone(),
            surface,
            corners,
            reflected,
            gather_count: 0,
            relative_change: 0.0,
            stop: StopReason::Converged,
        })
    }

    /// Checks that this is the light of the scene of `mesh`.
    pub(crate) fn check_scene(&self, mesh: &Mesh) -> Result<(), Error> {
        let (scene, other) = (self.mesh.scene(), mesh.scene());
        let same = std::ptr::eq(scene, other)
            || scene.positions() == other.positions() && scene.triangles() == other.triangles();
        if same {
            return Ok(());
        }
        let remedy = "give light that was found on a mesh of the same scene";
        let found = "light of another scene than the mesh's";
        Err(Error::new(ErrorKind::Setting, "light to gather", found, remedy))
    }

    /// The light as a [`Gather`](super::Gather) sees it.
    pub fn radiosity_field(&self) -> RadiosityField<'_> {
        RadiosityField { mesh: &self.mesh, corners: &self.corners, reflected: &self.reflected }
    }
}

fn check_count(mesh: &Mesh, radiosity: &[Rgb]) -> Result<(), Error> {
    if radiosity.len() == mesh.element_count() {
        return Ok(());
    }
    let place = format!("{} values of radiosity", radiosity.len());
    let remedy = format!("give one for each of the {} elements", mesh.element_count());
    Err(Error::new(ErrorKind::Setting, place, "not one an element", remedy))
}
