//! Rows and light that tests make up.

use std::collections::HashMap;

use glam::DVec3;
use radiosity::form_factor::Row;
use radiosity::gather::{GatherPoint, RadiosityField};
use radiosity::mesh::NodeId;
use radiosity::{Error, FormFactors, Mesh, Rgb};

/// Returns the same rows whatever it is asked for.
pub struct GivenRows(pub Vec<Row>);

impl FormFactors for GivenRows {
    fn rows(&mut self, _: &Mesh, _: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        Ok(self.0.clone())
    }
}

/// Rows of all elements of a mesh, made once and checked.
#[derive(Clone)]
pub struct StoredRows(pub HashMap<NodeId, Row>);

impl StoredRows {
    /// Rows of `mesh` by `rows`.
    pub fn of(mesh: &Mesh, rows: &mut dyn FormFactors) -> StoredRows {
        let elements: Vec<NodeId> = (0..mesh.element_count()).map(|e| mesh.element(e)).collect();
        let rows = rows.rows(mesh, &elements, 1.0).unwrap();
        for (row, &element) in rows.iter().zip(&elements) {
            row.check(mesh, element).unwrap();
        }
        StoredRows(elements.into_iter().zip(rows).collect())
    }
}

impl FormFactors for StoredRows {
    fn rows(&mut self, _: &Mesh, patches: &[NodeId], _: f64) -> Result<Vec<Row>, Error> {
        Ok(patches.iter().map(|p| self.0[p].clone()).collect())
    }

    fn preferred_batch_len(&self) -> usize {
        16
    }
}

/// Radiosity given as a function of element and position.
pub struct GivenRadiosity {
    pub mesh: Mesh,
    pub corners: Vec<[u32; 3]>,
    pub reflected: Vec<Rgb>,
}

impl GivenRadiosity {
    /// `value` of element and point, W/m².
    pub fn new(mesh: Mesh, value: impl Fn(usize, DVec3) -> Rgb) -> GivenRadiosity {
        let (mut corners, mut reflected) = (vec![], vec![]);
        for e in 0..mesh.element_count() {
            let (node, first) = (mesh.element(e), reflected.len() as u32);
            corners.push([first, first + 1, first + 2]);
            reflected.extend(mesh.corners(node).map(|p| value(e, p)));
        }
        GivenRadiosity { mesh, corners, reflected }
    }

    pub fn sources(&self) -> RadiosityField<'_> {
        RadiosityField { mesh: &self.mesh, corners: &self.corners, reflected: &self.reflected }
    }

    /// Places just over the middle of elements, `count` of them all over the scene.
    pub fn places(&self, count: usize, above: f64) -> Vec<GatherPoint> {
        let place = |k: usize| {
            let node = self.mesh.element(k * 7919 % self.mesh.element_count());
            let normal = self.mesh.normal(node);
            let position = self.mesh.centroid(node) + normal * above;
            GatherPoint { position, normal, near: above }
        };
        (0..count).map(place).collect()
    }
}
